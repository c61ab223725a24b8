// Contact rows solved by projected Gauss-Seidel. A row of effective mass m and relative velocity u
// is corrected by
//   impulse <- max(0, impulse + m (target - u)),
// and friction by what stops its point, projected into the disc that the normal impulse allows.
// Source: E. Catto, "Iterative dynamics with temporal coherence", Game Developers Conference 2005:
// these iterations on accumulated impulses, which start from those of the step before.
#pragma once

#include <vector>

#include "physics/constraints/contact_rows.hpp"

namespace soda::physics {

// stopping_impulse() if the disc of impulses up to `limit` allows it. Else the point slides: a step
// along the velocity itself, so that friction opposes the motion exactly however differently the
// two directions respond.
Tangential friction_impulse(const FrictionRow& row, double limit, const Tangential& old,
                            const Tangential& velocity_m_s);

// Iterates until the largest change of an impulse is negligible or there have been enough.
// Returns the number of iterations.
int solve_velocities(int iterations, ContactProblem& problem);

// Gives the rows that bounce their rebound as target. Returns whether there are any.
bool set_restitution_targets(ContactProblem& problem);

// One iteration: frictions (rolling ones first), then normals in the order of rows or backwards.
// Returns the largest change of an impulse.
double iterate_velocities(bool forward, ContactProblem& problem);
double iterate_frictions(ContactProblem& problem);

// The rows of a contact problem once more, for displacement.
struct PositionCorrectionProblem {
  std::vector<PositionCorrection> bodies;            // parallel to the problem's
  std::vector<double> target_m_s, impulse_newton_s;  // parallel to its normals
};

// Whether something overlaps by more than its slop.
bool needs_position_correction(const ContactProblem& problem);
// What it wants of one contact: the velocity along the normal must not fall below it.
double correction_target_m_s(const RowContact& contact, double dt_s);

// Bodies and impulses at zero, and the targets.
void set_correction_targets(double dt_s, const ContactProblem& problem,
                            PositionCorrectionProblem& correction);

struct PositionCorrectionIteration {
  double change_newton_s = 0.0, largest_newton_s = 0.0;  // over the rows' impulses
};
PositionCorrectionIteration iterate_position_correction(bool forward, const ContactProblem& problem,
                                                        PositionCorrectionProblem& correction);

// Iterates until it changes little. `correction` is left without bodies if none is needed.
void solve_position_correction(int iterations, double dt_s, const ContactProblem& problem,
                               PositionCorrectionProblem& correction);

// Largest violation of a normal or friction constraint by the present velocities and impulses.
double residual_m_s(const ContactProblem& problem);

}  // namespace soda::physics
