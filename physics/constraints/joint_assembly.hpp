// The matrix of joint rows: what an impulse along each does to the velocity of each.
#pragma once

#include <span>

#include "physics/constraints/joint_rows.hpp"
#include "physics/math/short_list.hpp"

namespace soda::physics {

// Sets up `system.matrix` of the rows that take part, by the plan there is; finds their twists and
// places. Returns the scales for its factorisation. `bodies` and `regularisation` as in
// factor_joint_rows.
ShortList<double, 32> assemble_joint_rows(std::span<const SolverBody> bodies, double regularisation,
                                          JointSystem& system);

}  // namespace soda::physics
