// The energy of islands with joints: a step gives none, but what motors, springs, drives and
// position correction do.
#pragma once

#include <span>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// Whether nothing connects the island with the world or a static.
bool is_isolated(std::size_t body_count, const JointSystem& joints, const ContactProblem* problem);

// How much a step from `from` to `to` gives the island beyond `work_joule`, 0 where that is
// rounding; its energy of motion at `to`; and that of a fall of one step.
struct EnergyExcess {
  double gain_joule = 0.0, moving_joule = 0.0, falling_joule = 0.0;

  // Whether it is at most this part of the energy of motion.
  bool is_trace(double part) const { return gain_joule <= part * moving_joule; }
  // What hangs at rest moves by the rounding of its places alone: no part of that is a measure.
  bool is_rounding(double joule) const {
    constexpr double kOfFall = 1e-9;
    return joule <= kOfFall * falling_joule;
  }
};
EnergyExcess energy_excess(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                           std::span<const BodyState> from, std::span<const BodyState> to,
                           double work_joule);

// Scales velocities to where the excess (of either sign) is gone, or as much of it as there is
// energy of motion; joints hold as before. Returns what is left of it. Of an island that is
// isolated momentum stays, and where it bends enough angular momentum; else the world gave what
// changes, which `report` gets.
double take_excess(const SceneDescription& scene, std::span<const BodyId> ids,
                   const EnergyExcess& excess, bool isolated, std::span<BodyState> states,
                   IslandReport& report);

// The same of an excess that is at most a thousandth of the energy of motion, as seen from the
// whole where the island is isolated: momenta stay. Else nothing, and false.
bool take_trace(const SceneDescription& scene, std::span<const BodyId> ids,
                const EnergyExcess& excess, bool isolated, std::span<BodyState> states,
                IslandReport& report);

// What an unconverged or implicit solution of joints and contacts gives beyond the work of motors,
// springs and what pushes the bodies: goes back so far towards joints alone, which give nothing,
// that the step gives nothing either. `free`: velocities after external forces.
void clamp_joint_gain(double dt_s, std::span<const BodyState> before,
                      std::span<const SolverBody> free, JointSystem& joints,
                      ContactProblem& problem);

// What drives, thrusters and damping (as a field), and motors, do over the step at final
// velocities, J.
double external_work_joule(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                           std::span<const BodyState> before, std::span<const SolverBody> free,
                           const ContactProblem& problem);
double motor_work_joule(const JointSystem& joints, std::span<const SolverBody> bodies);

}  // namespace soda::physics
