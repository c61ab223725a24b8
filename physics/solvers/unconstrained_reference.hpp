// Joints without contacts: the solution of an island that nothing throws and that gives no energy.
// A bad one of joints and contacts goes back towards it.
#pragma once

#include <span>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/solvers/convex_contacts.hpp"

namespace soda::physics {

// Iterations that diverged: nothing in their result is worth a share.
bool is_out_of_bounds(const ContactProblem& problem);

// What joints, motors and springs alone would do, along the same rows: contacts have no impulse.
// Where the factors cannot be trusted, nothing: poses are closed then, if they can be at all.
// `free`: velocities after external forces.
void solve_unconstrained_reference(std::span<const SolverBody> free, JointSystem& joints,
                                   ContactProblem& problem);

// `joints` and `problem` become this share, 0 to 1, of themselves, and the rest of `from`, which
// has the same rows.
void mix(double share, const JointSystem& from_joints, const ContactProblem& from,
         JointSystem& joints, ContactProblem& problem);

// Gives the bodies of `problem` the contact impulses of another solution.
void take_contact_impulses(const ContactProblem& from, ContactProblem& problem);

// Contacts of what is light and jammed between heavy bodies do not converge, and what is left of
// large impulses throws it. Nothing gets faster by contacts than 30 times the fastest body of its
// mass and more, or three times its own speed, at the radius of gyration: the island goes back
// towards joints alone as far as that takes. Speeds count before the step, after external forces,
// and after joints, motors and springs without contacts. Whether it had to.
bool limit_throws(std::span<const BodyState> before, std::span<const SolverBody> free,
                  JointSystem& joints, ContactProblem& problem);

}  // namespace soda::physics
