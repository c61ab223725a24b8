// Contact constraints of one island and their solution by projected Gauss-Seidel.
#pragma once

#include <span>
#include <vector>

#include "physics/body_state.hpp"
#include "physics/contact_manifold.hpp"
#include "physics/scene.hpp"
#include "physics/selection.hpp"
#include "physics/need.hpp"
#include "physics/stage_counters.hpp"

namespace soda::physics {

// Overlap that is left alone, of the smaller body's size.
inline constexpr double kSlop = 5e-4;

// The width of a body, roughly: twice the way from its centre to what is nearest of its surface; of
// a hull, of its corners. 1e300 of what has none.
double size_of(const Shape& shape);

// Velocities of a body while its island is solved.
struct SolverBody {
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();
  double inverse_mass = 0.0;
  Mat3 inverse_inertia = Mat3::Zero();  // world frame
};

// As the state has it, without external forces.
SolverBody solver_body(const BodyParams& params, const BodyState& state);

// One contact point: the relative velocity along the normal must not fall below `target_m_s`.
struct NormalRow {
  std::uint32_t a = 0, b = 0;  // local indices; statics share one index, of infinite mass
  Vec3 normal = Vec3::Zero();
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();    // arm x normal
  Vec3 turn_a = Vec3::Zero(), turn_b = Vec3::Zero();  // inverse inertia of that
  double mass_kg = 0.0;                               // effective
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

// Along the two tangents.
using Tangential = std::array<double, 2>;

// The impulse that stops a point which slides at this velocity with the impulse `old`.
inline Tangential stopping_impulse(const FrictionRow& row, const Tangential& old,
                                   const Tangential& velocity_m_s) {
  const auto [v0, v1] = velocity_m_s;
  return {old[0] - (row.inverse[0] * v0 + row.inverse[1] * v1),
          old[1] - (row.inverse[1] * v0 + row.inverse[2] * v1)};
}

// The same if the disc of impulses up to `limit` allows it. Else the point slides: a step along the
// velocity itself, so that friction opposes the motion exactly however differently the two
// directions respond.
Tangential friction_impulse(const FrictionRow& row, double limit, const Tangential& old,
                            const Tangential& velocity_m_s);

// What a contact point needs beside its rows.
struct RowContact {
  std::uint32_t manifold = 0, point = 0;
  std::int32_t friction_row = -1;
  double separation_m = 0.0;
  double slop_m = 0.0;  // penetration that is left alone
  double size_m = 0.0;  // of the smaller body
  Vec3 arm_a = Vec3::Zero();
  // Impact within this step, where the pair bounces.
  bool bounces = false;
  double impact_time_s = 0.0;
  double rebound_m_s = 0.0;  // target at the end of the step
};

struct ContactProblem {
  // Those of the island, one for all statics, one for each moving surface: of infinite mass, with
  // the surface's velocity. Only friction meets those.
  std::vector<SolverBody> bodies;
  std::vector<std::uint32_t> moving_surfaces;  // their static indices, parallel to those bodies
  std::vector<NormalRow> normals;
  std::vector<FrictionRow> frictions;
  std::vector<RowContact> contacts;  // parallel to normals
  int restitution_rows = 0;
  int conveyor_rows = 0;

  void clear();  // keeps the memory
};

inline std::uint64_t rows_of(const ContactProblem& problem) {
  return problem.normals.size() + problem.frictions.size();
}

// Of rows, and of starting impulses.
Need friction_needed(const SceneDescription& scene);
Need conveyors_needed(const SceneDescription& scene);
Need restitution_needed(const SceneDescription& scene);
Need warm_starts_needed(const SceneDescription& scene);

// Rows in the manifolds' order; impulses start from the bodies' stored ones where warm starting is
// on, and are applied. `bodies` hold the velocities after external forces.
void build_rows(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                const Selection<ContactManifold>& manifolds, const Selection<BodyState>& states,
                ContactProblem& problem, StageCounters& counters);

// Sweeps until the largest change of an impulse is negligible or the iterations are used up.
// Returns the number of sweeps.
int solve_velocities(int iterations, ContactProblem& problem);

// Gives the rows that bounce their rebound as target. Returns whether there are any.
bool aim_rebounds(ContactProblem& problem);

// One sweep: frictions, then normals in the order of rows or backwards. Returns the largest change
// of an impulse.
double sweep_velocities(bool forward, ContactProblem& problem);
double sweep_frictions(ContactProblem& problem);

// Displacement velocities that push overlapping bodies apart; they never become kinetic energy.
struct PushOut {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};

// The rows of a contact problem once more, for displacement.
struct PushOutProblem {
  std::vector<PushOut> bodies;                       // parallel to the problem's
  std::vector<double> target_m_s, impulse_newton_s;  // parallel to its normals
};

// Whether something overlaps by more than its slop.
bool needs_push_out(const ContactProblem& problem);
// What it wants of one contact: the velocity along the normal must not fall below it.
double push_out_target_m_s(const RowContact& contact, double dt_s);

// Bodies and impulses at zero, and the targets.
void aim_push_out(double dt_s, const ContactProblem& problem, PushOutProblem& push);

struct PushOutSweep {
  double change_newton_s = 0.0, largest_newton_s = 0.0;  // over the rows' impulses
};
PushOutSweep sweep_push_out(bool forward, const ContactProblem& problem, PushOutProblem& push);

// Sweeps until it changes little. `push` is left without bodies if none is needed.
void solve_push_out(int iterations, double dt_s, const ContactProblem& problem,
                    PushOutProblem& push);

// Largest violation of a normal or friction constraint by the present velocities and impulses.
double residual_m_s(const ContactProblem& problem);

}  // namespace soda::physics
