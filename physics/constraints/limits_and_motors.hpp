// Limits and motors: rows of a joint whose impulse is bounded.
#pragma once

#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"

namespace soda::physics {

// For velocities at the rows' poses, at either end of a part of a step: motors may push for
// `time_s`, half of it, and limits that are nearer than that stop what goes on towards them.
void bound_velocities(double time_s, double reached_m, JointSystem& system);

// For a step of `time_s`: the same of motors; limits stop what would pass them within it.
void bound_step(double time_s, JointSystem& system);

// No limit holds, and motors rest.
void rest_bounds(JointSystem& system);

// For corrections of place: limits that are passed by more than that hold, in addition to those
// that do already; motors rest. Whether more hold than before.
bool hold_passed_limits(double passed_m, JointSystem& system);

// Of rows built at other poses: the same limits hold.
void hold_same_limits(const JointSystem& from, JointSystem& system);

// As solve_joint_velocities, for a system that is factored, but the impulse of each limit and motor
// stays within its bounds, where its row need not have its target: that of a limit may be faster,
// that of a motor falls short of it. Factors again where bounds become or cease to be reached. A
// function of the rows and bodies; ends after a number of changes that grows with the rows.
void solve_bounded(std::span<SolverBody> bodies, double regularisation, JointSystem& system);

}  // namespace soda::physics
