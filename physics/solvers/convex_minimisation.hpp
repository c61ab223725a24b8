// Newton's method for the convex problem (convex_contacts.hpp), with the targets, start impulses
// and compliance that it has at the time. Sparse Cholesky factors give the directions, and a search
// along each the step.
#pragma once

#include <span>
#include <vector>

#include "physics/math/block_cholesky.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/newton_solver.hpp"

namespace soda::physics {

class ConvexMinimisation {
 public:
  // `responses` of as many points and rows as the problem has. What is passed has to last.
  ConvexMinimisation(const NewtonLimits& limits, const Elimination& plan, ConvexContacts& problem,
                     std::vector<Twist>& twists, Responses& responses);

  // Responses at the twists.
  void update();

  // Until the gradient is `wanted_m_s` or rounding. False if the limits are used up. `accepted`:
  // an error has been accepted, so that only `further` factorisations are left.
  bool minimise(double wanted_m_s, bool accepted);

  // Another guess: every point that would close is held. What rests, but has no impulses of an
  // earlier step, is found in this one solve; else layer by layer. Not taken if it is no nearer.
  void start_from_all_held();

  // Ten times as stiff.
  void harden_points();
  void harden_rows();

  // Its blocks, for another method with the same masses and rows.
  BodyBlocks& body_blocks() { return bodies_; }

  // The largest speed that a body alone would get from what is missing in its balance; of angular
  // velocities, that of the same energy. And what rounding leaves of it, which grows with the
  // stiffness.
  double gradient_m_s() const;
  double rounding_m_s() const;

  std::span<const Vec3> velocities_m_s() const { return velocity_; }  // of the points
  double softness() const { return softness_; }            // compliance over that at the start
  double row_stiffness() const { return row_stiffness_; }  // over that at the start
  // Factorisations that others made count as well.
  void spend(int factorisations) { factorisations_ += factorisations; }
  int factorisations() const { return factorisations_; }
  int steps() const { return steps_; }

 private:
  double rounding_of_rows_m_s() const;
  double objective() const;
  bool fits_factor() const;
  bool refactor(bool accepted);  // unless it fits
  void find_direction();
  void move(double step);
  double slope_of_bodies(double step) const;
  double slope_at_start() const;
  double slope(double step) const;
  double step_length() const;

  const NewtonLimits& limits_;
  const Elimination& plan_;
  ConvexContacts& problem_;
  std::vector<Twist>& twists_;
  Responses& all_;
  std::vector<PointResponse>& responses_;  // of the points
  int factorisations_ = 0, steps_ = 0;
  int further_ = 0;  // factorisations since an error was accepted
  double softness_ = 1.0, row_stiffness_ = 1.0;
  double row_rounding_m_s_ = 0.0;                  // of the gradient, at their first stiffness
  std::vector<Vec3> velocity_, change_;            // of the points; along the direction
  std::vector<Vec3> turning_, turning_change_;     // the same of rotations
  std::vector<double> row_velocity_, row_change_;  // the same of the rows
  std::vector<Twist> gradient_, direction_;
  BodyBlocks bodies_;
  std::vector<Block> factor_;
  std::vector<BlockVector> values_;
  std::vector<ContactMode> factor_modes_;
  std::vector<TurningResponse> factor_turnings_;
  std::vector<bool> factor_held_;  // of the rows
  bool factored_ = false;
};

}  // namespace soda::physics
