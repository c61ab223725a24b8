#include "physics/constraints/contact_rows.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/carried_rows.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {

double size_of(const Shape& shape) {
  if (const auto* s = std::get_if<Sphere>(&shape)) return 2.0 * s->radius_m;
  if (const auto* s = std::get_if<Box>(&shape)) return 2.0 * s->half_extents_m.minCoeff();
  if (const auto* s = std::get_if<Capsule>(&shape)) return 2.0 * s->radius_m;
  if (const auto* s = std::get_if<Cylinder>(&shape))
    return std::min(2.0 * s->radius_m, s->length_m);
  if (const auto* s = std::get_if<ConvexHull>(&shape)) {
    double squared = 1e300;
    for (const Vec3& v : s->vertices_m) squared = std::min(squared, v.squaredNorm());
    return 2.0 * std::sqrt(squared);
  }
  return 1e300;
}

double size_of(const SceneDescription& scene, std::uint32_t shape) {
  const auto* compound = std::get_if<Compound>(&scene.shapes[shape]);
  if (compound == nullptr) return size_of(scene.shapes[shape]);
  double least = 1e300;
  for (const CompoundPart& part : compound->parts)
    least = std::min(least, size_of(scene.shapes[part.shape]));
  return least;
}

double size_of(const SceneDescription& scene, const ContactManifold& m) {
  const double of_a = size_of(scene, scene.bodies[index_of(m.a)].shape);
  return is_static(m.b) ? of_a : std::min(of_a, size_of(scene, scene.bodies[index_of(m.b)].shape));
}

namespace {

// What the points of one manifold have in common.
struct PairContext {
  const ContactManifold* manifold = nullptr;
  std::uint32_t index = 0;  // of the manifold
  std::uint32_t a = 0, b = 0;
  std::uint32_t rubs_b = 0;  // what friction meets: b, or the moving surface
  const BodyState* state_a = nullptr;
  const BodyState* state_b = nullptr;  // null for statics
  const Sphere* sphere_a = nullptr;
  const Sphere* sphere_b = nullptr;
  double friction = 0.0, restitution = 0.0;
  RollingFriction rolling;
  double size_m = 0.0;
  double relative_field_m_s2 = 0.0;  // acceleration of b against a along the normal
  Tangents tangents;                 // where there is friction
};

// The solver's body that stands for a moving surface. An island touches few of them.
std::uint32_t surface_body(std::uint32_t static_index, const Vec3& velocity_m_s,
                           ContactProblem& problem) {
  std::vector<std::uint32_t>& known = problem.moving_surfaces;
  const auto at = std::find(known.begin(), known.end(), static_index);
  const auto place = static_cast<std::size_t>(at - known.begin());
  if (at == known.end()) {
    known.push_back(static_index);
    problem.bodies.emplace_back().linear = velocity_m_s;
  }
  return static_cast<std::uint32_t>(problem.bodies.size() - known.size() + place);
}

PairContext context_of(const SceneDescription& scene, std::span<const BodyId> ids,
                       const IndexedSpan<BodyState>& states, const ContactManifold& m,
                       std::uint32_t index, ContactProblem& problem) {
  PairContext c;
  c.manifold = &m;
  c.index = index;
  c.a = place_of(ids, m.a);
  c.b = place_of(ids, m.b);
  const BodyParams& pa = scene.bodies[index_of(m.a)];
  const Shape& shape_a = scene.shapes[pa.shape];
  c.state_a = &states[c.a];
  c.sphere_a = std::get_if<Sphere>(&shape_a);
  c.size_m = size_of(scene, m);
  const Material* material = nullptr;
  const Vec3* surface_velocity = nullptr;
  if (is_static(m.b)) {
    const StaticBody& fixed = scene.statics[static_index_of(m.b)];
    material = &fixed.material;
    surface_velocity = &fixed.surface_velocity_m_s;
  } else {
    const BodyParams& pb = scene.bodies[index_of(m.b)];
    material = &pb.material;
    c.state_b = &states[c.b];
    c.sphere_b = std::get_if<Sphere>(&scene.shapes[pb.shape]);
  }
  c.relative_field_m_s2 = relative_field(scene, m.a, m.b).dot(m.normal);
  c.friction = std::sqrt(pa.material.friction * material->friction);
  c.restitution = std::max(pa.material.restitution, material->restitution);
  c.rolling = rolling_friction(pa.material, *material);
  c.rubs_b = c.b;
  if (c.friction > 0.0) c.tangents = tangents_of(m.normal);
  if (surface_velocity && *surface_velocity != Vec3::Zero() && c.friction > 0.0) {
    c.rubs_b = surface_body(static_index_of(m.b), *surface_velocity, problem);
  }
  return c;
}

struct Arms {
  Vec3 a, b;  // b: nothing if it is a static
};

// A sphere's arm lies along the normal exactly: no rotation from rounding, nor from the distance
// that is still to go before an impact. Both bodies are pushed at the same point when they overlap,
// which keeps angular momentum.
Arms arms_of(const PairContext& c, const ContactPoint& p) {
  const Vec3& n = c.manifold->normal;
  const double overlap = std::min(p.separation_m, 0.0);
  Vec3 at = p.position_m;
  if (c.state_b == nullptr && p.separation_m > 0.0) at -= n * (0.5 * p.separation_m);
  Arms arms{at - c.state_a->position_m, Vec3::Zero()};
  if (c.sphere_a) arms.a = n * (c.sphere_a->radius_m + 0.5 * overlap);
  if (c.state_b) {
    arms.b = p.position_m - c.state_b->position_m;
    if (c.sphere_b) arms.b = n * -(c.sphere_b->radius_m + 0.5 * overlap);
  }
  return arms;
}

NormalRow normal_row(const PairContext& c, const Arms& arms, const ContactProblem& problem) {
  const SolverBody& a = problem.bodies[c.a];
  const SolverBody& b = problem.bodies[c.b];
  NormalRow row;
  row.a = c.a;
  row.b = c.b;
  row.normal = c.manifold->normal;
  row.arm_a = arms.a.cross(row.normal);
  row.response_a = times(a.inverse_inertia, row.arm_a);
  double inverse_mass = a.inverse_mass + row.arm_a.dot(row.response_a);
  if (c.state_b) {
    row.arm_b = arms.b.cross(row.normal);
    row.response_b = times(b.inverse_inertia, row.arm_b);
    inverse_mass += b.inverse_mass + row.arm_b.dot(row.response_b);
  }
  row.mass_kg = 1.0 / inverse_mass;
  return row;
}

FrictionRow friction_row(const PairContext& c, const Arms& arms, const ContactProblem& problem) {
  const SolverBody& a = problem.bodies[c.a];
  const SolverBody& b = problem.bodies[c.b];
  const Tangents& t = c.tangents;
  FrictionRow row;
  row.a = c.a;
  row.b = c.rubs_b;
  row.normal_row = static_cast<std::uint32_t>(problem.normals.size());
  row.friction = c.friction;
  row.arm_a = arms.a;
  row.arm_b = arms.b;
  row.tangent[0] = t.first;
  row.tangent[1] = t.second;
  const Vec3 a0 = arms.a.cross(t.first), a1 = arms.a.cross(t.second);
  const Vec3 response_a0 = times(a.inverse_inertia, a0), response_a1 = times(a.inverse_inertia, a1);
  double k11 = a.inverse_mass + a0.dot(response_a0), k12 = a1.dot(response_a0);
  double k22 = a.inverse_mass + a1.dot(response_a1);
  if (c.state_b) {
    const Vec3 b0 = arms.b.cross(t.first), b1 = arms.b.cross(t.second);
    const Vec3 response_b0 = times(b.inverse_inertia, b0),
               response_b1 = times(b.inverse_inertia, b1);
    k11 += b.inverse_mass + b0.dot(response_b0);
    k12 += b1.dot(response_b0);
    k22 += b.inverse_mass + b1.dot(response_b1);
  }
  const double determinant = k11 * k22 - k12 * k12;
  row.inverse[0] = k22 / determinant;
  row.inverse[1] = -k12 / determinant;
  row.inverse[2] = k11 / determinant;
  const double difference = 0.5 * (k11 - k22);
  row.slide_mass_kg = 1.0 / (0.5 * (k11 + k22) + std::sqrt(difference * difference + k12 * k12));
  return row;
}

// Velocity of b against a along the normal before the step's forces.
double approach_velocity(const PairContext& c, const Arms& arms) {
  Vec3 relative =
      -(c.state_a->linear_velocity_m_s + c.state_a->angular_velocity_rad_s.cross(arms.a));
  if (c.state_b) {
    relative += c.state_b->linear_velocity_m_s + c.state_b->angular_velocity_rad_s.cross(arms.b);
  }
  return relative.dot(c.manifold->normal);
}

// Where the surfaces meet within the step, under their fields alone, and what a bounce there leaves
// at the step's end. Without a bounce the target lets the gap close, but not more.
double aim(const SceneDescription& scene, double dt_s, const PairContext& c, const Arms& arms,
           RowContact& contact) {
  const double g = c.relative_field_m_s2, gap = std::max(contact.separation_m, 0.0);
  const double closed = gap > 0.0 ? -gap / dt_s : 0.0;
  if (!(c.restitution > 0.0)) return closed;
  const double v = approach_velocity(c, arms);
  const double squared = v * v - 2.0 * g * gap;  // of the speed at the impact
  if (squared < 0.0 || (gap == 0.0 && v >= 0.0)) return closed;
  const double impact = std::sqrt(squared);
  if (!(impact > scene.solver.restitution_threshold_m_s)) return closed;
  const double time = gap > 0.0 ? 2.0 * gap / (impact - v) : 0.0;
  // Not reached yet: only what ballistic flight cannot do is forbidden.
  if (!(time >= 0.0) || time > dt_s) return closed + std::min(0.0, 0.5 * g * dt_s);
  const double rest = dt_s - time, rebound = c.restitution * impact;
  if (rebound + 0.5 * g * rest <= 0.0 && rest > 0.0) return closed;  // would land again
  contact.bounces = true;
  contact.impact_time_s = time;
  contact.rebound_m_s = rebound + g * rest;
  return closed;
}

void apply_start(const NormalRow& row, SolverBody& a, SolverBody& b) {
  const double j = row.impulse_newton_s;
  a.linear -= row.normal * (a.inverse_mass * j);
  a.angular -= row.response_a * j;
  if (b.inverse_mass == 0.0) return;
  b.linear += row.normal * (b.inverse_mass * j);
  b.angular += row.response_b * j;
}

void apply_start(const FrictionRow& row, SolverBody& a, SolverBody& b) {
  const Vec3 j =
      row.tangent[0] * row.impulse_newton_s[0] + row.tangent[1] * row.impulse_newton_s[1];
  a.linear -= j * a.inverse_mass;
  a.angular -= times(a.inverse_inertia, row.arm_a.cross(j));
  if (b.inverse_mass == 0.0) return;
  b.linear += j * b.inverse_mass;
  b.angular += times(b.inverse_inertia, row.arm_b.cross(j));
}

std::array<std::uint32_t, 3> key_of(const ContactImpulse& i) {
  return {index_of(i.other), i.part, i.feature};
}

// Stored impulses and contact points are both sorted, so that one walk meets all equal keys.
const ContactImpulse* next_stored(const std::vector<ContactImpulse>& stored,
                                  const ContactManifold& m, std::uint32_t feature,
                                  std::size_t& cursor) {
  const std::array<std::uint32_t, 3> key{index_of(m.b), m.part, feature};
  while (cursor < stored.size() && key_of(stored[cursor]) < key) ++cursor;
  if (cursor < stored.size() && key_of(stored[cursor]) == key) return &stored[cursor++];
  return nullptr;
}

void warm_start(const ContactImpulse& stored, ContactProblem& problem, StageCounters& counters) {
  NormalRow& normal = problem.normals.back();
  normal.impulse_newton_s = stored.normal_newton_s;
  apply_start(normal, problem.bodies[normal.a], problem.bodies[normal.b]);
  ++counters.warm_started_rows;
  if (problem.contacts.back().friction_row < 0) return;
  FrictionRow& friction = problem.frictions.back();
  for (int t = 0; t < 2; ++t) {
    friction.impulse_newton_s[t] = stored.friction_newton_s.dot(friction.tangent[t]);
  }
  apply_start(friction, problem.bodies[friction.a], problem.bodies[friction.b]);
}

void add_point(const SceneDescription& scene, double dt_s, const PairContext& c,
               std::uint32_t point, ContactProblem& problem) {
  const ContactPoint& p = c.manifold->points[point];
  const Arms arms = arms_of(c, p);
  RowContact contact;
  contact.manifold = c.index;
  contact.point = point;
  contact.separation_m = p.separation_m;
  contact.slop_m = kSlop * c.size_m;
  contact.size_m = c.size_m;
  contact.fastest_correction_m_s = scene.solver.push_out_1_s * c.size_m;
  contact.arm_a = arms.a;
  NormalRow normal = normal_row(c, arms, problem);
  normal.target_m_s = aim(scene, dt_s, c, arms, contact);
  if (contact.bounces) ++problem.restitution_rows;
  if (c.friction > 0.0) {
    contact.friction_row = static_cast<std::int32_t>(problem.frictions.size());
    problem.frictions.push_back(friction_row(c, arms, problem));
    if (c.rubs_b != c.b) ++problem.conveyor_rows;
  }
  problem.normals.push_back(normal);
  problem.contacts.push_back(contact);
}

}  // namespace

Need friction_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  const auto rough = [](const auto& body) { return body.material.friction > 0.0; };
  return need_of(can_meet(bodies_that(scene, rough), statics_that(scene, rough)),
                 "two materials in contact can have friction > 0",
                 "no pair of materials has friction > 0");
}

Need rolling_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  const auto turns_back = [](const auto& body) { return turns_back_rolling(body.material); };
  return need_of(bodies_that(scene, turns_back) + statics_that(scene, turns_back) > 0,
                 "a material has rolling or torsional friction > 0",
                 "no material has rolling or torsional friction > 0");
}

Need conveyors_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  const auto rough = [](const auto& body) { return body.material.friction > 0.0; };
  const auto moves = [](const StaticBody& fixed) {
    return fixed.surface_velocity_m_s != Vec3::Zero();
  };
  if (statics_that(scene, moves) == 0) return {false, "no surface of a static moves"};
  const std::size_t belts =
      statics_that(scene, [&](const StaticBody& fixed) { return moves(fixed) && rough(fixed); });
  return need_of(belts > 0 && bodies_that(scene, rough) > 0,
                 "a static's surface moves and has friction",
                 "surfaces move, but without friction");
}

Need restitution_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  const auto springy = [](const auto& body) { return body.material.restitution > 0.0; };
  return need_of(bodies_that(scene, springy) + statics_that(scene, springy) > 0,
                 "a material has restitution > 0", "no material has restitution > 0");
}

Need warm_starts_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  return need_of(scene.solver.warm_starting, "contacts last over steps",
                 "switched off in the solver settings");
}

void ContactProblem::clear() {
  bodies.clear();
  moving_surfaces.clear();
  normals.clear();
  frictions.clear();
  rollings.clear();
  carried.clear();
  contacts.clear();
  restitution_rows = conveyor_rows = 0;
}

void build_rows(const SolveStep& step, const IndexedSpan<ContactManifold>& manifolds,
                ContactProblem& problem, StageCounters& counters) {
  const auto& [scene, dt_s, ids, states] = step;
  std::size_t points = 0;
  for (std::size_t i = 0; i < manifolds.size(); ++i) points += manifolds[i].count;
  problem.normals.reserve(points);
  problem.contacts.reserve(points);
  std::size_t cursor = 0;
  for (std::uint32_t i = 0; i < manifolds.size(); ++i) {
    const ContactManifold& m = manifolds[i];
    if (i == 0 || m.a != manifolds[i - 1].a) cursor = 0;
    if (is_joint(m)) continue;
    const PairContext context = context_of(scene, ids, states, m, i, problem);
    if (context.friction > 0.0 && problem.frictions.empty()) problem.frictions.reserve(points);
    if (context.rolling)
      problem.rollings.push_back(rolling_row(context.rolling, context.a, context.b, m, problem));
    keep_carried(scene, m, context.a, context.b, states, problem);
    for (std::uint32_t point = 0; point < m.count; ++point) {
      add_point(scene, dt_s, context, point, problem);
      if (!scene.solver.warm_starting) continue;
      const ContactImpulse* stored =
          next_stored(context.state_a->impulses, m, m.points[point].feature, cursor);
      if (stored) warm_start(*stored, problem, counters);
    }
  }
  carry(0.0, dt_s, problem);
  counters.normal_rows += problem.normals.size();
  counters.friction_rows += problem.frictions.size();
  counters.rolling_rows += problem.rollings.size();
  counters.conveyor_rows += static_cast<std::uint64_t>(problem.conveyor_rows);
  counters.restitution_rows += static_cast<std::uint64_t>(problem.restitution_rows);
}

void forget_impulses(ContactProblem& problem) {
  for (NormalRow& row : problem.normals) row.impulse_newton_s = 0.0;
  for (FrictionRow& row : problem.frictions)
    row.impulse_newton_s[0] = row.impulse_newton_s[1] = 0.0;
  for (RollingRow& row : problem.rollings) row.impulse_newton_m_s = Vec3::Zero();
}

}  // namespace soda::physics
