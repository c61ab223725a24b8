// The constraints of an island's joints, and their direct solution.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "physics/constraints/joint_elimination.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/math/sparse_ldl.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/need.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

enum class JointRowKind : std::uint8_t {
  kHolds,     // any impulse
  kSpring,    // has softness
  kLimit,     // `error` is what is left to the limit; its impulse pushes away from it
  kMotor,     // impulse within bounds
  kStiffness  // has softness: across what pulls (joint_stiffness.hpp)
};

// The velocity of a row is linear . (v_b - v_a) + angular_b . w_b - angular_a . w_a, in m/s. What
// turns is told at the end of a lever as long as the island: all rows of a system have the same
// units, and an angle counts as much as what it can move.
struct JointRow {
  std::uint32_t a = 0, b = 0;  // local indices; the world has that of the statics
  Vec3 linear = Vec3::Zero(), angular_a = Vec3::Zero(), angular_b = Vec3::Zero();
  double error = 0.0;  // how far off, m; its rate is the row's velocity
  // Wanted is velocity + softness * impulse = target; hard rows have no softness.
  double softness_1_kg = 0.0;
  double target_m_s = 0.0;
  double stiffness_share_1_s = 0.0;  // of springs: stiffness / (damping + dt stiffness)
  JointRowKind kind = JointRowKind::kHolds;
  bool idle = false;                  // of limits and motors: takes no part in solutions
  const JointMotor* motor = nullptr;  // of motors
  double left = 0.0;                  // of servos: to the target, m or rad
  double lever_m = 1.0;               // of rows that turn: m a rad
  // Between which its impulse has to be, of limits and motors (see limits_and_motors.hpp).
  double least_newton_s = 0.0, most_newton_s = 0.0;
  double impulse_newton_s = 0.0;
};
// Limits and motors.
inline bool is_bounded(const JointRow& row) {
  return row.kind == JointRowKind::kLimit || row.kind == JointRowKind::kMotor;
}

// What an impulse of 1 along a row does to the angular velocities of its bodies, but for the sign
// of a's.
struct RowTwist {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
};

// Of a row that takes no part in the matrix.
inline constexpr std::uint32_t kNoPlace = std::numeric_limits<std::uint32_t>::max();

// Of one island. Joints that are swept follow each other from neighbour to neighbour (reverse
// Cuthill-McKee); the order depends on the island's content alone.
struct JointSystem {
  std::vector<std::uint32_t> joints;                 // indices into SceneDescription::joints
  std::vector<std::array<std::uint32_t, 2>> bodies;  // a and b of each of them, as in the rows
  std::vector<std::uint32_t> first_row;              // of each of them, and the end: known first
  std::vector<JointRow> rows;
  std::vector<JointEnds> ends;                          // of each of them: what it can move
  std::vector<std::uint32_t> breakable;                 // places of those that can break
  std::shared_ptr<const JointElimination> elimination;  // once it was planned
  // Of rows of stiffness: as they were when they were dropped; the elimination that is not in use,
  // of the joints with them or without.
  std::vector<JointRow> dropped;
  std::shared_ptr<const JointElimination> other_elimination;
  // Of factor_joint_rows.
  SparseLdl matrix;
  std::vector<std::uint32_t> place_of_row;  // in the matrix, or kNoPlace
  bool in_place = false;         // whether that is the place among the rows, for all of them
  std::vector<RowTwist> twists;  // of each row
  double regularisation = 0.0;
  bool factored = false;  // and rows were not built since
  bool bounded = false;   // whether a joint has limits or a motor
  double reach_m = 0.0;   // of bodies that it moves: radii of gyration, anchors from centres
  double lever_m = 0.0;   // of rows that turn: how far the island reaches, known first

  bool empty() const { return joints.empty(); }
};

Need joint_rows_needed(const SceneDescription& scene);
Need limits_needed(const SceneDescription& scene);
Need motors_needed(const SceneDescription& scene);

// Which joints there are; no rows yet. `ids` ascending.
JointSystem find_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds);
bool has_springs(const SceneDescription& scene, const JointSystem& system);

// Rows at these poses; impulses are 0. Of springs only if `with_springs`: else their rows do
// nothing. Limits and motors are idle.
void build_joint_rows(const SceneDescription& scene, double dt_s, std::span<const BodyState> states,
                      bool with_springs, JointSystem& system);

// The errors alone, of rows that were built before at other poses; limits are idle.
void build_joint_errors(const SceneDescription& scene, std::span<const BodyState> states,
                        JointSystem& system);

// For rows at the poses that the bodies would have after a step of dt_s with these velocities:
// targets for which the joints hold there (springs: pull as they will there), to first order.
void aim_joint_rows(double dt_s, std::span<const SolverBody> bodies, JointSystem& system);

// A spring at some poses: its row has the direction, and the length beyond that at rest as error.
struct SpringRow {
  JointRow row;
  double stiffness_newton_m = 0.0, damping_newton_s_m = 0.0;
  double length_m = 0.0;          // from end to end
  std::array<double, 2> arm_m{};  // from the centres of a and b to their ends
  std::uint32_t joint = 0;        // index into SceneDescription::joints
  bool can_break = false;
};
std::vector<SpringRow> spring_rows(const SceneDescription& scene, std::span<const BodyState> states,
                                   const JointSystem& system);

// Multiplications of one factorisation (factor_joint_rows), roughly; infinity where they are more
// than `most`. Plans it if it is not planned yet. There need be no rows.
double factor_multiplications(double most, JointSystem& system);

double velocity_of(const JointRow& row, std::span<const SolverBody> bodies);
void apply_joint_impulse(const JointRow& row, double impulse, std::span<SolverBody> bodies);

// Takes the rows' impulses back.
void take_back_joint_impulses(JointSystem& system, std::span<SolverBody> bodies);

// The matrix of the rows that are not idle, factored; the functions below need it. `bodies` as in a
// ContactProblem: inverse mass and inertia are read. `regularisation`: part of its diagonal that is
// added to each row.
void factor_joint_rows(std::span<const SolverBody> bodies, JointSystem& system,
                       double regularisation = 0.0);

// Overwrites the right-hand side, one number a row, with the impulses that give these velocities.
void solve_joint_rows(const JointSystem& system, std::span<double> rows);

// Gives the bodies the velocities with which every row that is not idle has its target: exact but
// for rounding.
void solve_joint_velocities(JointSystem& system, std::span<SolverBody> bodies);

// Factors, and takes away the velocities that the joints do not allow; targets are 0, but those of
// motors, and bounds are kept. That costs energy and never gives any, but by motors. Where joints
// contradict each other, as in a taut chain between two walls, exact impulses would: then as little
// softness as is needed is added. Leaves the factors. `factored`: that they are there already.
void stop_joint_velocities(std::span<SolverBody> bodies, JointSystem& system,
                           bool factored = false);

// The displacements that take every row's error away to first order, as impulse over mass:
// `moves[i]` of body i is overwritten.
struct JointMove {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};
void solve_joint_errors(const JointSystem& system, std::span<const SolverBody> bodies,
                        std::vector<JointMove>& moves);

// Adds an impulse to each row.
void add_joint_impulses(std::span<const double> impulses, JointSystem& system,
                        std::span<SolverBody> bodies);

// Errors of joints that are no springs, m; of a limit that is idle, by how much it is
// passed: the largest, and the root of the sum of all squares.
double largest_error(const JointSystem& system);
double norm_of_errors(const JointSystem& system);

}  // namespace soda::physics
