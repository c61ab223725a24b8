// Solves the contacts of an island by Newton's method on the convex problem (convex_contacts.hpp),
// and with it the exact contact laws. Two corrections take out what the convex problem changes:
//   the compliance:              start <- P(start + (target - u) / compliance)
//   the lift of sliding points:  target_n <- target_n - friction |u_t|
// Both are one fixed-point iteration, which is accelerated (anderson.hpp).
// Sources: the first is the augmented Lagrangian of P. Alart, A. Curnier, "A mixed formulation for
// frictional contact problems prone to Newton like solution methods", Comput. Methods Appl. Mech.
// Eng. 92, 1991. The second is the shift of G. de Saxce, Z.-Q. Feng, "The bipotential method: a
// constructive approach to design the complete contact law with friction", Math. Comput. Modelling
// 28, 1998.
#pragma once

#include <vector>

#include "physics/math/block_cholesky.hpp"
#include "physics/solvers/convex_contacts.hpp"

namespace soda::physics {

struct NewtonLimits {
  double scale_m_s = 0.0;     // largest velocity of a point without contacts
  double wanted_m_s = 0.0;    // error at which the work ends
  double rounding_m_s = 0.0;  // below it, an error that does not fall any more is rounding
  double accepted_m_s = 0.0;  // error that is accepted where a limit ends the work before
  int factorisations = 0;     // at most
  int corrections = 0;        // of compliance and shift, at most
  int further = 1000;         // factorisations once an error is accepted, at most
  double stalled_m_s = 0.0;   // error that is accepted where the exact laws come no nearer
  // Of the fastest body against one that it touches, or of the scale: an accepted error at which
  // the work ends that has taken so many factorisations. Where something moves, more does not bring
  // the rest to rest.
  double of_motion = 0.0;
  int many = 0;
};

struct NewtonOutcome {
  bool converged = false;  // to the accepted error
  int factorisations = 0;
  int steps = 0;  // of Newton's method
};

// Whether a factorisation takes several times as long as the rest of a step.
bool is_costly(const Elimination& plan, std::size_t points);

// `twists`: a guess, overwritten. `responses`: overwritten with one per point and row; where it
// converges, their impulses fulfil the contact laws to the accepted error. The problem's start
// impulses are a guess too; they, its targets and its compliance are changed. A function of its
// arguments only.
NewtonOutcome solve_by_newton(const NewtonLimits& limits, const Elimination& plan,
                              ConvexContacts& problem, std::vector<Twist>& twists,
                              Responses& responses);

}  // namespace soda::physics
