// The constraints of an island's joints, and their direct solution.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/body_state.hpp"
#include "physics/contact_manifold.hpp"
#include "physics/contact_solver.hpp"
#include "physics/scene.hpp"

namespace soda::physics {

// The velocity of a row is linear . (v_b - v_a) + turn_b . w_b - turn_a . w_a.
struct JointRow {
  std::uint32_t a = 0, b = 0;  // local indices; the world has that of the statics
  Vec3 linear = Vec3::Zero(), turn_a = Vec3::Zero(), turn_b = Vec3::Zero();
  double error = 0.0;             // how far off, m or rad; its rate is the row's velocity
  double softness_1_kg = 0.0;     // springs: velocity + softness * impulse is wanted to be target
  double target_m_s = 0.0;        // springs only
  double impulse_newton_s = 0.0;  // or newton m s
};

// A symmetric positive matrix, factored into L D L^T. Of each row, what comes before its first
// entry stays zero. Rows that depend on earlier ones get no pivot: their unknown is 0.
class EnvelopeMatrix {
 public:
  // `first[i]` <= i: column of the first entry of row i. All zero.
  void reset(std::span<const std::uint32_t> first);
  double& at(std::size_t row, std::size_t column) {
    return values_[begin_[row] + column - first_[row]];
  }
  void factor();
  // Overwrites the right-hand side with the solution.
  void solve(std::span<double> unknowns) const;

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::size_t> begin_;  // of each row in values_; ends with its diagonal
  std::vector<double> values_;
  std::vector<double> inverse_pivots_;
};

// Of one island. Joints are in an order of elimination (reverse Cuthill-McKee) that depends on the
// island's content alone.
struct JointSystem {
  std::vector<std::uint32_t> joints;     // indices into SceneDescription::joints
  std::vector<std::uint32_t> first_row;  // of each of them, and the end
  std::vector<JointRow> rows;
  std::vector<std::uint32_t> earliest;  // place of the first joint that shares a body with each
  EnvelopeMatrix matrix;

  bool empty() const { return joints.empty(); }
};

// Which joints there are; no rows yet. `ids` ascending.
JointSystem find_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds);
bool has_springs(const SceneDescription& scene, const JointSystem& system);

// Rows at these poses; impulses are 0. Of springs only if `with_springs`: else their rows do
// nothing.
void build_joint_rows(const SceneDescription& scene, std::span<const BodyId> ids,
                      std::span<const BodyState> states, bool with_springs, JointSystem& system);

// The matrix of these rows, factored; the functions below need it. `bodies` as in a ContactProblem:
// inverse mass and inertia are read.
void factor_joint_rows(std::size_t body_count, std::span<const SolverBody> bodies,
                       JointSystem& system);

// Gives the bodies the velocities with which every row has its target: exact but for rounding.
void solve_joint_velocities(JointSystem& system, std::span<SolverBody> bodies);

// The displacements that take every row's error away to first order, as impulse over mass:
// `moves[i]` of body i is overwritten.
struct JointMove {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};
void solve_joint_errors(const JointSystem& system, std::span<const SolverBody> bodies,
                        std::vector<JointMove>& moves);

// Adds the impulses that take the rows' errors, here those of velocity, away.
void add_joint_impulses(JointSystem& system, std::span<SolverBody> bodies);

// The largest error of rows that are no springs, m or rad.
double largest_error(const JointSystem& system);

}  // namespace soda::physics
