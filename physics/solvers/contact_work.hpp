// The work of contact impulses. Those that fulfil the contact laws take energy out of an island, by
// rebounds at most as much as the impact took comes back; what a solver has left unsolved must not
// put any in.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/math/selection.hpp"
#include "physics/math/solver_body.hpp"

namespace soda::physics {

// Scales all impulses, and the velocities with them, to where they do no work in the velocities
// that they lead to; leaves them alone where they do none. `free`: velocities after external
// forces, without contacts. Momentum, the friction cones and the signs of impulses stay; a contact
// closes by the share that is taken off. Targets are at most 0: rebounds come later.
void limit_work(std::span<const SolverBody> free, ContactProblem& problem);

// The same where a step of dt_s gives the island energy, potential energy in the field of the
// external forces included; what moves beyond its final velocity is not counted. `before`: the
// states at the step's start.
void limit_gain(double dt_s, const Selection<BodyState>& before, std::span<const SolverBody> free,
                ContactProblem& problem);

// The impulses of a problem, and the velocities that they lead to.
struct SolvedContacts {
  std::vector<SolverBody> bodies;
  std::vector<double> normal_newton_s;
  std::vector<Vec3> friction_newton_s;  // x, y: the two tangents
};
SolvedContacts solved_contacts(const ContactProblem& problem);

// After rebounds were solved for: goes back towards the solution without them so far that the step
// gives the island no energy, potential energy in the field of the external forces included. dt_s
// of 0 is an impact, on which no force acts. `plastic`: that solution; `before`: the states at the
// step's start.
void limit_rebounds(double dt_s, const Selection<BodyState>& before,
                    std::span<const SolverBody> free, const SolvedContacts& plastic,
                    ContactProblem& problem);

// A body in flight may end a step faster downwards than would close a gap, as its way is curved. If
// one that is held after all is so fast that it would get through: gives all contacts the target to
// close, none bounces any more, and returns true. Then they are to be solved again.
bool aim_to_close(double dt_s, ContactProblem& problem);

}  // namespace soda::physics
