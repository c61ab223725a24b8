// Judges of joints, from the states alone: how far apart they come, and what they carry.
#pragma once

#include "analysis/accuracy/judge.hpp"

namespace soda::analysis {

// How far the joint is apart in these states, m: the distance of its anchors, of a slider off its
// axis, of a distance joint against its length; 0 for a spring.
double joint_gap_m(const physics::Joint& joint, std::span<const physics::BodyState> states);

std::unique_ptr<Judge> judge_joints(const scenarios::Scenario& scenario);
// What a joint of the chain carries is the weight below it and what the momentum below it changes
// by, over a step.
std::unique_ptr<Judge> judge_hanging_chain(const scenarios::Scenario& scenario, double dt_s,
                                           double duration_s);

}  // namespace soda::analysis
