// What an implicit solution of joints takes from what turns, given back.
#pragma once

#include <span>

#include "physics/constraints/joint_rows.hpp"
#include "physics/integrators/joint_kicks.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// Rows in the middle of the step, and what meets external forces there.
struct HalfWay {
  const JointSystem& rows;
  const JointKicks& kicks;
};

// An implicit solution pulls in the directions that joints have at the end of the step, and so
// against what moves: a body on a tether loses (w dt)^2 of its speed a step. In the directions of
// the start the same impulses take nothing. Places stay implicit, so that is stable however taut.
// The bodies get a share of the difference, as far as the joints let it pass, half-way between
// both directions: a light body between others is pulled by both. They resist it by the joints'
// geometric stiffness as well (joint_stiffness.hpp): a taut rope that flutters faster than the step
// is damped, however fast it moves as a whole. The share is one for the island, E / (E + E') of the
// body that changes most, with its energy E, and E' that of the change. Of what meets external
// forces half is turned (joint_kicks.hpp).
//
// `states` are those at the end. They get no more energy than joints have taken, nor more than
// `most_joule`. The report gets what the world gives.
void give_back_turning(const JointedStep& step, const JointedSolution& solved,
                       const HalfWay& half_way, double most_joule, std::span<BodyState> states,
                       IslandReport& report);

}  // namespace soda::physics
