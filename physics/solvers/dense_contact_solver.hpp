// Iterations over the contacts of few points, seen from the points instead of the bodies.
#pragma once

#include "physics/constraints/contact_rows.hpp"

namespace soda::physics {

inline constexpr std::size_t kFewPoints = 4;
inline constexpr std::size_t kMostFewLines = 3 * kFewPoints + 6;
inline bool are_few(const ContactProblem& problem) {
  return problem.normals.size() <= kFewPoints &&
         problem.normals.size() + 2 * problem.frictions.size() + 3 * problem.rollings.size() <=
             kMostFewLines;
}

// As iterate_velocities() for iterations number `done` + 1 to `iterations`, until the largest
// change of an impulse is at most `negligible` of the largest impulse; equal to it but for
// rounding. What an impulse at one point changes at the others is computed once, so that an
// iteration costs a tenth: worth it where many are to come. Only where are_few(). Returns the
// number of iterations, `done` included.
int solve_dense_contacts(int done, int iterations, double negligible, ContactProblem& problem);

}  // namespace soda::physics
