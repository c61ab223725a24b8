// Contact constraints of one island.
#pragma once

#include <span>
#include <vector>

#include "physics/math/indexed_span.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/need.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

// Overlap that is left alone, of the smaller body's size.
inline constexpr double kSlop = 5e-4;

// The width of a body, roughly: twice the distance from its centre to what is nearest of its
// surface; of a hull, of its corners. 1e300 of what has none.
double size_of(const Shape& shape);
// Of one of the scene's shapes: of a compound, that of its smallest part.
double size_of(const SceneDescription& scene, std::uint32_t shape);
// Of the smaller body of a pair.
double size_of(const SceneDescription& scene, const ContactManifold& m);

// One contact point: the relative velocity along the normal must not fall below `target_m_s`.
struct NormalRow {
  std::uint32_t a = 0, b = 0;  // local indices; statics share one index, of infinite mass
  Vec3 normal = Vec3::Zero();
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();            // arm x normal
  Vec3 response_a = Vec3::Zero(), response_b = Vec3::Zero();  // inverse inertia of that
  double mass_kg = 0.0;                                       // effective
  double target_m_s = 0.0;
  double impulse_newton_s = 0.0;
};

// Friction of the same point: impulse in the tangent plane, inside the disc of radius
// friction * normal impulse.
struct FrictionRow {
  std::uint32_t a = 0, b = 0;  // b of the normal row, but the moving surface where there is one
  std::uint32_t normal_row = 0;
  double friction = 0.0;
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();  // from the centres to the point
  Vec3 tangent[2] = {Vec3::Zero(), Vec3::Zero()};
  double inverse[3] = {0, 0, 0};  // of the 2x2 effective-mass matrix: 11, 12, 22
  double slide_mass_kg = 0.0;     // 1 / its largest eigenvalue's inverse mass
  double impulse_newton_s[2] = {0.0, 0.0};
};

// Rolling and torsional friction, of all points of a manifold together: an impulse of torque on b.
// In the contact plane it lies inside the disc of radius rolling_m * normal impulses; along the
// normal it is at most torsional_m * these.
struct RollingRow {
  std::uint32_t a = 0, b = 0;  // those of the normal rows
  std::uint32_t first_normal = 0, points = 0;
  double rolling_m = 0.0, torsional_m = 0.0;
  Vec3 axis[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  // two tangents, the normal
  double inverse[3] = {0, 0, 0};     // of the tangents' 2x2 effective-inertia matrix: 11, 12, 22
  double slide_inertia_kg_m2 = 0.0;  // 1 / its largest eigenvalue's inverse inertia
  double torsional_inertia_kg_m2 = 0.0;    // effective, about the normal
  double gyration_m = 0.0;                 // that the two bodies have together
  Vec3 impulse_newton_m_s = Vec3::Zero();  // along the axes
};

// Along the two tangents.
using Tangential = std::array<double, 2>;

// The impulse that stops a point which slides at this velocity with the impulse `old`.
inline Tangential stopping_impulse(const FrictionRow& row, const Tangential& old,
                                   const Tangential& velocity_m_s) {
  const auto [v0, v1] = velocity_m_s;
  return {old[0] - (row.inverse[0] * v0 + row.inverse[1] * v1),
          old[1] - (row.inverse[1] * v0 + row.inverse[2] * v1)};
}

// What a contact point needs beside its rows.
struct RowContact {
  std::uint32_t manifold = 0, point = 0;
  std::int32_t friction_row = -1;
  double separation_m = 0.0;
  double slop_m = 0.0;  // penetration that is left alone
  double size_m = 0.0;  // of the smaller body
  double fastest_correction_m_s = 0.0;
  Vec3 arm_a = Vec3::Zero();
  double carried_m = 0.0;  // added to gaps that arms as they are now give (carried_rows.hpp)
  // Impact within this step, where the pair bounces.
  bool bounces = false;
  double impact_time_s = 0.0;
  double rebound_m_s = 0.0;  // target at the end of the step
};

// Rows of a contact with a kinematic body that turns (carried_rows.hpp).
struct CarriedRows {
  std::uint32_t kinematic = 0;  // local index
  bool is_a = false;
  std::uint32_t first = 0, points = 0;
  Vec3 arm_m = Vec3::Zero();     // from its centre to the other body's, at the step's start
  Vec3 change_m = Vec3::Zero();  // of the kinematic body's arms
};

struct ContactProblem {
  // Those of the island, one for all statics, one for each moving surface: of infinite mass, with
  // the surface's velocity. Only friction meets those.
  std::vector<SolverBody> bodies;
  std::vector<std::uint32_t> moving_surfaces;  // their static indices, parallel to those bodies
  std::vector<NormalRow> normals;
  std::vector<FrictionRow> frictions;
  std::vector<RollingRow> rollings;
  std::vector<CarriedRows> carried;
  std::vector<RowContact> contacts;  // parallel to normals
  int restitution_rows = 0;
  int conveyor_rows = 0;

  void clear();  // keeps the memory
};

inline std::uint64_t rows_of(const ContactProblem& problem) {
  return problem.normals.size() + problem.frictions.size() + problem.rollings.size();
}

// Of rows, and of starting impulses.
Need friction_needed(const SceneDescription& scene);
Need rolling_needed(const SceneDescription& scene);
Need conveyors_needed(const SceneDescription& scene);
Need restitution_needed(const SceneDescription& scene);
Need warm_starts_needed(const SceneDescription& scene);

// Bodies at the start of a step in which their contacts are solved together. Refers to all of it.
struct SolveStep {
  const SceneDescription& scene;
  double dt_s;  // 0: an impact
  std::span<const BodyId> ids;
  IndexedSpan<BodyState> before;  // parallel to the ids
};

// Rows in the manifolds' order; impulses start from the bodies' stored ones where warm starting is
// on, and are applied; those of rolling rows are not stored, and start without. `bodies` hold the
// velocities after external forces.
void build_rows(const SolveStep& step, const IndexedSpan<ContactManifold>& manifolds,
                ContactProblem& problem, StageCounters& counters);

// The rows' impulses are 0; bodies keep what they have.
void forget_impulses(ContactProblem& problem);

// Displacement velocities that push overlapping bodies apart; they never become kinetic energy.
struct PositionCorrection {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};

}  // namespace soda::physics
