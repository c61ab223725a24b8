// Geometric stiffness: what joints pull with turns along with the bodies that they pull at.
// Source: M. Tournier, M. Nesme, B. Gilles, F. Faure, "Stable constrained dynamics", ACM
// Transactions on Graphics 34(4), 2015: of a rigid body's anchors, and of distances. Deviation: of
// each pull only the part that holds the attitude.
#pragma once

#include <span>

#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// Whether Newton's method and stiffness serve: between masses that are more unequal than 1e6 to 1
// too few digits are left to the light ones, and they are thrown.
bool are_even(const SceneDescription& scene, std::span<const BodyId> ids);

// For the next of several solutions (Newton's method on the directions of joints at a step's end):
// `bodies`, the bodies with the velocities of the one before, get those to solve from, without any
// impulse, and inertias that have what `solved`'s impulses add to them over dt_s. So few solutions
// are enough even of a chain between two walls. A solution that is found again is one without
// stiffness. `there`: states at the step's end. `free`: velocities after external forces, true
// inertias.
void stiffen(const SceneDescription& scene, double dt_s, std::span<const BodyState> there,
             const JointSystem& solved, std::span<const SolverBody> free,
             std::span<SolverBody> bodies);

// Gives the bodies their true inertias back; velocities stay.
void unstiffen(std::span<const SolverBody> free, std::span<SolverBody> bodies);

// The same of what pulls along the line between two anchors, distances and springs: these lines
// turn as one anchor moves across them against the other. Two rows more for each of them, the last
// ones of a joint in `system`, whose rows are those at `there`: an anchor that moves across
// otherwise than `bodies` do is pulled back by pull / length. Joints that push have rows that do
// nothing.
void add_stiffness_rows(const SceneDescription& scene, double dt_s,
                        std::span<const BodyState> there, const JointSystem& solved,
                        std::span<const SolverBody> bodies, JointSystem& system);

// Takes them out again, into `dropped`; impulses and velocities stay. The rest is to be factored
// anew.
void drop_stiffness_rows(JointSystem& system);

}  // namespace soda::physics
