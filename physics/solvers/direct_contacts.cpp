#include "physics/solvers/direct_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/island_blocks.hpp"

namespace soda::physics {
namespace {

constexpr double kMostMultiplications = 5e6;  // of one factorisation: 10 Mflop
// What has no speed at all is found to stay so once, or to move on: a structure that was built at
// rest. In substeps it would cost as much in each step for ever.
constexpr double kMostAtRest = 1e8;
// Newton's method needs many steps for what slides or falls. So what is not quasi-static must be
// small, and have bodies for which iterations fail.
constexpr double kSmall = 1e4;  // multiplications
constexpr double kMuchHeavier = 10.0;
// An impact of few bodies: iterations get there, too.
constexpr double kSmallImpact = 1e5;  // multiplications
// With joints, in motion: what iterations take there costs as much as a factorisation.
constexpr double kSmallWithJoints = 1e6;  // multiplications
constexpr double kQuasiStatic = 0.1;      // of the speed that fields give in a step
// Overlap, of the smaller body. Iterations let what is high or heavy sink, ever deeper: an island
// that has sunk so far is solved directly until it is up again.
constexpr double kSunk = 5e-3;
// Multiplications for each row: tens of factorisations are then no more than the most substeps.
constexpr double kSunkOfRow = 80.0;
// Multiplications of all factorisations of a solve; at most, a second.
constexpr double kMostWork = 4e7, kMostWorkAtRest = 4e9;
// Factorisations after which what moves is solved well enough to move on. With joints, what comes
// to rest slowly is met in each step.
constexpr int kManyWithJoints = 10;

// Of the reciprocal of an island's mass: what a point gives way, per impulse. Soft enough for few
// Newton steps; the corrections take it out again, and make it harder where they get on slowly.
// Softer where a factorisation costs far more than a step: then points that carry next to nothing
// do not open and close with every rounding, and one factorisation serves them all.
constexpr double kCompliance = 1.0, kSoftCompliance = 1000.0;

void set_bodies(std::span<const SolverBody> bodies, bool is_costly, ConvexContacts& out) {
  double mass = 0.0;
  out.bodies.reserve(bodies.size());
  for (const SolverBody& body : bodies) {
    if (body.inverse_mass == 0.0) {
      out.bodies.push_back({1.0, Mat3::Identity(), true});
      continue;
    }
    out.bodies.push_back({1.0 / body.inverse_mass, inverse_of_symmetric(body.inverse_inertia)});
    mass += out.bodies.back().mass_kg;
  }
  out.compliance_1_kg = (is_costly ? kSoftCompliance : kCompliance) / mass;
}

// Of the arm only what a frictionless impulse can see, unless friction's own arms are at hand.
ConvexPoint frictionless_point(const ContactProblem& problem, std::size_t i) {
  const NormalRow& row = problem.normals[i];
  ConvexPoint p;
  p.a = row.a;
  p.b = row.b;
  p.normal = row.normal;
  p.target_m_s = row.normal * row.target_m_s;
  p.arm_a = row.normal.cross(row.arm_a);
  p.arm_b = row.normal.cross(row.arm_b);
  return p;
}

void add_friction(const ContactProblem& problem, const FrictionRow& row, ConvexPoint& p) {
  p.friction = row.friction;
  p.arm_a = row.arm_a;
  p.arm_b = row.arm_b;
  p.start_newton_s +=
      row.tangent[0] * row.impulse_newton_s[0] + row.tangent[1] * row.impulse_newton_s[1];
  if (row.b == p.b) return;
  const Vec3& surface = problem.bodies[row.b].linear;
  p.target_m_s -= surface - p.normal * surface.dot(p.normal);
}

ConvexPoint convex_point(const ContactProblem& problem, std::size_t i) {
  ConvexPoint p = frictionless_point(problem, i);
  p.start_newton_s = p.normal * problem.normals[i].impulse_newton_s;
  const std::int32_t friction = problem.contacts[i].friction_row;
  if (friction >= 0) add_friction(problem, problem.frictions[friction], p);
  return p;
}

ConvexTurning convex_turning(const RollingRow& row, const ContactProblem& problem) {
  ConvexTurning out;
  out.a = row.a;
  out.b = row.b;
  out.first_point = row.first_normal;
  out.points = row.points;
  out.normal = row.axis[2];
  out.gyration_m = row.gyration_m;
  out.rolling = row.rolling_m / row.gyration_m;
  out.torsional = row.torsional_m / row.gyration_m;
  out.pressing_newton_s = pressing(row, problem);
  return out;
}

void apply(const TurningResponse& response, const ConvexTurning& turning, RollingRow& row,
           ContactProblem& problem) {
  const Vec3 torque = response.impulse_newton_s * turning.gyration_m;
  const Vec3 along(torque.dot(row.axis[0]), torque.dot(row.axis[1]), torque.dot(row.axis[2]));
  row.impulse_newton_m_s = along;
  apply_rolling_impulse(row, along, problem);
}

// Joints answer alike in each step of Newton's method, so they can be stiff: the part of the
// response of its heavier body that a row gives way, before the corrections take that out.
constexpr double kJointCompliance = 1e-3;

ConvexRow convex_row(const JointRow& row, std::span<const SolverBody> bodies) {
  const SolverBody &a = bodies[row.a], &b = bodies[row.b];
  ConvexRow out{row.a, row.b, row.linear, row.angular_a, row.angular_b};
  const double squared = row.linear.squaredNorm();
  const double of_a =
      a.inverse_mass * squared + row.angular_a.dot(times(a.inverse_inertia, row.angular_a));
  const double of_b =
      b.inverse_mass * squared + row.angular_b.dot(times(b.inverse_inertia, row.angular_b));
  const double least = of_b > 0.0 ? std::min(of_a, of_b) : of_a;
  out.soft = row.softness_1_kg > 0.0;
  out.target_m_s = row.target_m_s;
  out.stiffness_kg = 1.0 / (out.soft ? row.softness_1_kg : kJointCompliance * least);
  if (!(least > 0.0)) out.stiffness_kg = 1.0;  // a spring that is left out
  if (row.linear == Vec3::Zero() && of_a + of_b > 0.0)
    out.speed = std::sqrt((a.inverse_mass + b.inverse_mass) / (of_a + of_b));
  out.start_newton_s = out.soft ? 0.0 : row.impulse_newton_s;
  const bool bounded = is_bounded(row);
  out.least_newton_s = bounded ? row.least_newton_s : -1e300;
  out.most_newton_s = bounded ? row.most_newton_s : 1e300;
  return out;
}

// What a row has to change: nothing where only an impulse beyond its bounds could (a stop that is
// far away).
double missing_m_s(const ConvexRow& row, double velocity_m_s) {
  const double missing = row.target_m_s - velocity_m_s;
  const bool excluded = missing < 0.0 ? row.least_newton_s >= 0.0 : row.most_newton_s <= 0.0;
  return excluded ? 0.0 : missing;
}

void apply(const PointResponse& response, const ConvexPoint& p, std::size_t i,
           ContactProblem& problem) {
  const Vec3& impulse = response.impulse_newton_s;
  NormalRow& row = problem.normals[i];
  row.impulse_newton_s = std::max(0.0, impulse.dot(row.normal));
  Vec3 total = row.normal * row.impulse_newton_s;
  if (problem.contacts[i].friction_row >= 0) {
    FrictionRow& f = problem.frictions[problem.contacts[i].friction_row];
    for (int t = 0; t < 2; ++t) {
      f.impulse_newton_s[t] = impulse.dot(f.tangent[t]);
      total += f.tangent[t] * f.impulse_newton_s[t];
    }
  }
  SolverBody& a = problem.bodies[row.a];
  SolverBody& b = problem.bodies[row.b];
  a.linear -= total * a.inverse_mass;
  a.angular -= times(a.inverse_inertia, p.arm_a.cross(total));
  b.linear += total * b.inverse_mass;
  b.angular += times(b.inverse_inertia, p.arm_b.cross(total));
}

// What is all but out of balance (a stack that overhangs, a thin arch) takes many. Substeps would
// let it fall, and whatever moves is not quasi-static any more: so what is cheap to factorise may
// go on. What joints hold, or bodies of uneven masses, is solved directly while it moves, too: what
// is left open there costs more in the steps that follow.
int most_factorisations(const Elimination& plan) {
  constexpr double kMost = 200.0, kLeast = 80.0;
  const double least = std::min(kLeast, kMostWorkAtRest / plan.multiplications);
  return static_cast<int>(std::clamp(kMostWork / plan.multiplications, least, kMost));
}

// Of the points of one manifold, squared; `b` null for a static.
double squared_speed(const SceneDescription& scene, const ContactManifold& m, const BodyState& a,
                     const BodyState* b) {
  const Vec3 surface =
      b == nullptr ? scene.statics[static_index_of(m.b)].surface_velocity_m_s : Vec3(Vec3::Zero());
  double squared = 0.0;
  for (std::uint32_t i = 0; i < m.count; ++i) {
    const Vec3& point = m.points[i].position_m;
    const Vec3 other = b == nullptr ? surface : velocity_at(*b, point);
    squared = std::max(squared, (other - velocity_at(a, point)).squaredNorm());
  }
  return squared;
}

// Whether contacts move by no more than that share of the speed that fields give in a step.
bool are_slower(double share, const SceneDescription& scene, double dt_s,
                std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                std::span<const BodyState> states) {
  const double most_m_s = share * strongest_field_m_s2(scene, ids) * dt_s;
  return std::ranges::all_of(manifolds, [&](const ContactManifold& m) {
    if (is_joint(m)) return true;
    const BodyState* const b = is_static(m.b) ? nullptr : &states[place_of(ids, m.b)];
    return squared_speed(scene, m, states[place_of(ids, m.a)], b) <= most_m_s * most_m_s;
  });
}

bool has_sunk(const SceneDescription& scene, std::span<const ContactManifold> manifolds) {
  constexpr std::size_t kOneOf = 4;  // what is deep by itself has been thrown there
  const auto sunk = std::ranges::count_if(manifolds, [&](const ContactManifold& m) {
    return least_separation_m(m) < -kSunk * size_of(scene, m);
  });
  return static_cast<std::size_t>(sunk) * kOneOf > manifolds.size();
}

// What lies on a turntable goes in a circle within the step: substeps follow it.
bool any_turns_others(const SceneDescription& scene, std::span<const BodyId> ids,
                      std::span<const BodyState> states) {
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (is_kinematic(scene, ids[i]) && states[i].angular_velocity_rad_s != Vec3::Zero())
      return true;
  return false;
}

// Pairs of places, each once.
std::vector<std::array<std::uint32_t, 2>> edges_of(std::span<const BodyId> ids,
                                                   std::span<const ContactManifold> manifolds) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(manifolds.size());
  for (const ContactManifold& m : manifolds) {
    const std::array<std::uint32_t, 2> edge{place_of(ids, m.a), place_of(ids, m.b)};
    if (!is_static(m.b) && (edges.empty() || edges.back() != edge)) edges.push_back(edge);
  }
  return edges;
}

// Iterations converge: one body, or two of like masses where a trace may be left.
bool is_easy(bool accurate, std::size_t bodies, double ratio) {
  return bodies == 1 || (!accurate && bodies == 2 && ratio <= kMuchHeavier);
}

}  // namespace

double mass_ratio(const SceneDescription& scene, std::span<const BodyId> ids) {
  double lightest = 1e300, heaviest = 0.0;
  for (const BodyId id : ids) {
    if (is_kinematic(scene, id)) continue;
    const double mass = scene.bodies[index_of(id)].mass_kg;
    lightest = std::min(lightest, mass);
    heaviest = std::max(heaviest, mass);
  }
  return heaviest / lightest;
}

bool is_quasi_static(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds,
                     std::span<const BodyState> states) {
  return are_slower(kQuasiStatic, scene, dt_s, ids, manifolds, states);
}

std::optional<Elimination> plan_direct_solve(const SceneDescription& scene, double dt_s,
                                             bool accurate, std::span<const BodyId> ids,
                                             std::span<const ContactManifold> manifolds,
                                             std::span<const BodyState> states) {
  if (!scene.solver.direct) return std::nullopt;
  const double ratio = mass_ratio(scene, ids);
  const bool jointed = !scene.joints.empty() && std::ranges::any_of(manifolds, is_joint);
  const auto moved = static_cast<std::size_t>(
      std::ranges::count_if(ids, [&](BodyId id) { return falls(scene, id); }));
  if (!jointed && is_easy(accurate, moved, ratio)) return std::nullopt;
  const bool is_uneven = jointed || ratio > kMuchHeavier;
  const bool quasi_static =
      !any_turns_others(scene, ids, states) && is_quasi_static(scene, dt_s, ids, manifolds, states);
  const bool sunk = !jointed && has_sunk(scene, manifolds);
  if (!quasi_static && !is_uneven && !accurate && !sunk) return std::nullopt;
  const bool at_rest =
      !jointed && quasi_static && are_slower(0.0, scene, dt_s, ids, manifolds, states);
  return plan_elimination(static_cast<std::uint32_t>(ids.size()), edges_of(ids, manifolds),
                          at_rest                    ? kMostAtRest
                          : quasi_static || accurate ? kMostMultiplications
                          : jointed                  ? kSmallWithJoints
                          : sunk                     ? kSunkOfRow * 3.0 * points_of(manifolds)
                                                     : kSmall);
}

std::optional<Elimination> plan_impact_solve(const SceneDescription& scene,
                                             std::span<const BodyId> ids,
                                             std::span<const ContactManifold> manifolds) {
  if (!scene.solver.direct) return std::nullopt;
  if (is_easy(false, ids.size(), mass_ratio(scene, ids))) return std::nullopt;
  return plan_elimination(static_cast<std::uint32_t>(ids.size()), edges_of(ids, manifolds),
                          kSmallImpact);
}

NewtonOutcome solve_directly(const DirectAim& aim, std::span<const SolverBody> free,
                             const Elimination& plan, ContactProblem& problem,
                             JointSystem* joints) {
  ConvexContacts convex;
  set_bodies(free, is_costly(plan, problem.normals.size()), convex);
  convex.free.reserve(free.size());
  convex.points.reserve(problem.normals.size());
  std::vector<Twist> twists;
  twists.reserve(free.size());
  for (std::size_t i = 0; i < free.size(); ++i) {
    convex.free.push_back({free[i].linear, free[i].angular});
    twists.push_back({problem.bodies[i].linear, problem.bodies[i].angular});
  }
  double squared = 0.0;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    convex.points.push_back(convex_point(problem, i));
    squared = std::max(squared, relative_velocity(convex.points[i], convex.free).squaredNorm());
  }
  for (const RollingRow& row : problem.rollings)
    convex.turnings.push_back(convex_turning(row, problem));
  if (joints != nullptr)
    for (const JointRow& row : joints->rows) {
      const ConvexRow& added = convex.rows.emplace_back(convex_row(row, problem.bodies));
      const double speed = added.speed * missing_m_s(added, relative_velocity(added, convex.free));
      squared = std::max(squared, speed * speed);
    }
  const double scale = std::sqrt(squared);
  const int most = aim.factorisations > 0 ? aim.factorisations : most_factorisations(plan);
  const NewtonLimits limits{
      .scale_m_s = scale,
      .wanted_m_s = aim.wanted * scale,
      .rounding_m_s = aim.rounding * scale,
      .accepted_m_s = aim.accepted * scale,
      .factorisations = most,
      .corrections = 40,
      .further = aim.further,
      .stalled_m_s = aim.stalled * scale,
      .of_motion = aim.of_motion,
      .many = joints != nullptr
                  ? kManyWithJoints
                  : static_cast<int>(std::min(kMostWork / plan.multiplications, 1e9))};
  Responses responses;
  const NewtonOutcome outcome = solve_by_newton(limits, plan, convex, twists, responses);
  if (!outcome.converged) return outcome;
  // By the impulses, not by the velocities found: pairs are pushed by opposite impulses exactly.
  std::copy(free.begin(), free.end(), problem.bodies.begin());
  for (std::size_t i = 0; i < responses.points.size(); ++i) {
    apply(responses.points[i], convex.points[i], i, problem);
  }
  for (std::size_t i = 0; i < responses.turnings.size(); ++i)
    apply(responses.turnings[i], convex.turnings[i], problem.rollings[i], problem);
  for (std::size_t i = 0; i < responses.rows.size(); ++i) {
    JointRow& row = joints->rows[i];
    row.impulse_newton_s = responses.rows[i].impulse_newton_s;
    apply_joint_impulse(row, row.impulse_newton_s, problem.bodies);
  }
  return outcome;
}

NewtonOutcome correct_positions_directly(double dt_s, const Elimination& plan,
                                         const ContactProblem& problem,
                                         std::vector<PositionCorrection>& push,
                                         const JointSystem* joints) {
  constexpr double kWanted = 1e-2, kAccepted = 0.1;  // of the fastest; the next step corrects again
  const std::size_t bodies = plan.count();
  ConvexContacts convex;
  const std::span<const SolverBody> moving = std::span(problem.bodies).first(bodies);
  set_bodies(moving, is_costly(plan, problem.normals.size()), convex);
  convex.free.resize(bodies);
  double fastest = 0.0;
  convex.points.reserve(problem.normals.size());
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    ConvexPoint p = frictionless_point(problem, i);
    const double target = correction_target_m_s(problem.contacts[i], dt_s);
    p.target_m_s = p.normal * target;
    fastest = std::max(fastest, target);
    convex.points.push_back(p);
  }
  if (joints != nullptr)
    for (const JointRow& row : joints->rows) {
      if (row.kind == JointRowKind::kSpring || row.kind == JointRowKind::kMotor) continue;
      ConvexRow& added = convex.rows.emplace_back(convex_row(row, problem.bodies));
      added.start_newton_s = 0.0;
      added.target_m_s = row.kind == JointRowKind::kLimit ? -std::max(row.error, 0.0) / dt_s : 0.0;
    }
  const NewtonLimits limits{
      fastest, kWanted * fastest, kWanted * fastest, kAccepted * fastest, most_factorisations(plan),
      20};
  std::vector<Twist> twists(bodies);
  Responses responses;
  const NewtonOutcome outcome = solve_by_newton(limits, plan, convex, twists, responses);
  if (!outcome.converged) return outcome;
  push.resize(problem.bodies.size());
  for (std::size_t i = 0; i < bodies; ++i) push[i] = {twists[i].linear, twists[i].angular};
  return outcome;
}

}  // namespace soda::physics
