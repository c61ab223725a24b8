#include "physics/time_of_impact.hpp"

#include <algorithm>
#include <cmath>

#include "physics/contact_features.hpp"
#include "physics/geometry_impl.hpp"
#include "physics/rigid_motion.hpp"

// Along any direction n the gap between two convex solids is bounded from below by that between
// their supporting planes. For a short time ahead every point of a body moves by v t + w x r t, up
// to half an acceleration that is bounded by |w|^2 |r|; the lowest such point along n is what the
// support function finds in the direction n + t (n x w). So one direction tells how long nothing
// can touch, to second order in that time, and a few of them lead to the impact.
namespace soda::physics {
namespace {

// One body of the pair, at the moment that is looked at.
struct Flyer {
  const CompiledShape& shape;
  Pose pose;  // relative to the centre of a
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
  double most_acceleration_m_s2 = 0.0;  // of its points against its centre
};

const CompiledShape& shape_of(const SceneDescription& scene, const Geometry& geometry, BodyId id) {
  const std::uint32_t shape = is_static(id) ? geometry.impl().statics[static_index_of(id)].shape
                                            : scene.bodies[index_of(id)].shape;
  return geometry.impl().shapes[shape].shape;
}

// Of the smaller body.
double width_of(const SceneDescription& scene, const Geometry& geometry, BodyId a, BodyId b) {
  const double width = shape_of(scene, geometry, a).min_extent_m;
  return is_static(b) ? width : std::min(width, shape_of(scene, geometry, b).min_extent_m);
}

// The largest square of the spin that a free body comes to. Energy and angular momentum stay, and
// both are linear in the squares of the spin about its principal axes, so it is reached where one
// of the three vanishes.
double most_squared_spin(const BodyParams& params, const Vec3& spin_local) {
  const Mat3& inertia = params.inertia_local_kg_m2;
  const Vec3 momentum = inertia * spin_local;
  const double energy = momentum.dot(spin_local);  // twice
  const bool principal = inertia(0, 1) == 0.0 && inertia(0, 2) == 0.0 && inertia(1, 2) == 0.0;
  if (!principal) return energy * params.inverse_inertia_local.norm();
  const double squared = momentum.squaredNorm();
  double most = spin_local.squaredNorm();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const double low = std::min(inertia(i, i), inertia(j, j));
    const double high = std::max(inertia(i, i), inertia(j, j));
    if (!(low < high)) continue;
    const double about_low = (energy * high - squared) / (low * (high - low));
    const double about_high = (squared - energy * low) / (high * (high - low));
    if (about_low >= 0.0 && about_high >= 0.0) most = std::max(most, about_low + about_high);
  }
  return 1.01 * most;
}

Flyer flyer(const SceneDescription& scene, const Geometry& geometry, BodyId id,
            const BodyState& state, const Vec3& origin) {
  const CompiledShape& shape = shape_of(scene, geometry, id);
  Flyer f{shape, {state.orientation.toRotationMatrix(), state.position_m - origin}, {}, {}, 0.0};
  f.velocity = state.linear_velocity_m_s;
  if (shape.kind == ShapeKind::kSphere) return f;
  f.spin = state.angular_velocity_rad_s;
  // A point at r from the centre feels |w|^2 |r| and |dw/dt| |r|. As no moment is larger than the
  // sum of the others, |dw/dt| is at most |w|^2 / sqrt(3).
  const BodyParams& params = scene.bodies[index_of(id)];
  const bool isotropic = is_isotropic(params.inertia_local_kg_m2);
  const double squared = isotropic ? f.spin.squaredNorm()
                                   : most_squared_spin(params, f.pose.direction_to_local(f.spin));
  f.most_acceleration_m_s2 = (isotropic ? 1.0 : 1.6) * squared * shape.bounding_radius_m;
  return f;
}

Flyer fixed(const SceneDescription& scene, const Geometry& geometry, BodyId id,
            const Vec3& origin) {
  const StaticGeometry& body = geometry.impl().statics[static_index_of(id)];
  return {shape_of(scene, geometry, id),
          {body.pose.rotation, body.pose.position - origin},
          Vec3::Zero(),
          Vec3::Zero(),
          0.0};
}

// Height along `normal` of the farthest point in its direction, once each point has moved on for
// t_s along its present velocity.
double reach_along(const Flyer& f, const Vec3& normal, double t_s) {
  const double centre = normal.dot(f.pose.position + f.velocity * t_s);
  if (f.shape.kind == ShapeKind::kHalfSpace) {
    const Vec3 up = f.pose.rotation * f.shape.half_space.normal;
    // Only its own normal is ever asked for.
    return centre + f.shape.half_space.offset_m * (up.dot(normal) > 0.0 ? 1.0 : -1.0);
  }
  if (f.shape.kind == ShapeKind::kSphere) return centre + f.shape.radius_m;
  // normal . (w x r) = r . (normal x w)
  const Vec3 local = f.pose.direction_to_local(normal + normal.cross(f.spin) * t_s);
  return centre + local.dot(support(f.shape, local));
}

struct Pair {
  Flyer a, b;
  Vec3 gravity = Vec3::Zero();  // of b against a

  // Lower bound of the gap along the normal.
  double gap_after(const Vec3& normal, double t_s) const {
    const double pull = normal.dot(gravity) - (a.most_acceleration_m_s2 + b.most_acceleration_m_s2);
    return -reach_along(b, -normal, t_s) - reach_along(a, normal, t_s) + 0.5 * pull * t_s * t_s;
  }
  bool turns() const { return a.spin != Vec3::Zero() || b.spin != Vec3::Zero(); }
};

// The first root of c + v t + g t^2 / 2 in (0, most], for c > 0; most if there is none. Without
// cancellation.
double first_root(double c, double v, double g, double most) {
  const double discriminant = v * v - 2.0 * g * c;
  if (!(discriminant >= 0.0)) return most;
  const double root = std::sqrt(discriminant);
  double t = most;
  if (v < 0.0) {
    t = 2.0 * c / (root - v);
  } else if (g < 0.0) {
    t = (v + root) / -g;
  }
  return std::min(t, most);
}

// How long the gap cannot fall below `floor`: gap_after is concave but for gravity, so the set of
// such times is an interval as soon as gravity closes the gap, and an interval is what is kept.
double safe_time(const Pair& pair, const Vec3& normal, double floor, double most) {
  constexpr int kMostTrials = 50;
  constexpr double kEnough = 1e-4;  // of the time itself: bodies are looked at again there
  if (!pair.turns()) {
    const double now = pair.gap_after(normal, 0.0) - floor;
    const double v = normal.dot(pair.b.velocity - pair.a.velocity);
    return now > 0.0 ? first_root(now, v, normal.dot(pair.gravity), most) : 0.0;
  }
  // With gravity opening the gap the bound may have two such intervals: it is left out then.
  Pair bound = pair;
  if (normal.dot(pair.gravity) > 0.0) bound.gravity = Vec3::Zero();
  double safe = 0.0, unsafe = most;
  double left = bound.gap_after(normal, safe) - floor,
         lacks = bound.gap_after(normal, most) - floor;
  if (lacks >= 0.0) return most;
  // A concave curve is above its chord, so where that ends is safe; halving keeps chords short, and
  // finds where a gap that is at its floor has opened.
  for (int i = 0; i < kMostTrials && unsafe - safe > kEnough * safe; ++i) {
    const double share = i % 2 == 0 && left > 0.0 ? left / (left - lacks) : 0.5;
    const double time = safe + (unsafe - safe) * share;
    const double gap = bound.gap_after(normal, time) - floor;
    (gap >= 0.0 ? safe : unsafe) = time;
    (gap >= 0.0 ? left : lacks) = gap;
  }
  return safe;
}

// Whether the points that touch approach each other, and by how much.
double approach_m_s(const Pair& pair, const Vec3& normal, double touching) {
  // The fastest of those within `touching` of the plane: a little time ahead, the lowest point is
  // one of them.
  const double speed = (pair.b.velocity - pair.a.velocity).norm() +
                       pair.a.spin.norm() * pair.a.shape.bounding_radius_m +
                       pair.b.spin.norm() * pair.b.shape.bounding_radius_m;
  if (!(speed > 0.0)) return 0.0;
  const double t_s = touching / speed;
  const double now = -reach_along(pair.b, -normal, 0.0) - reach_along(pair.a, normal, 0.0);
  const double then = -reach_along(pair.b, -normal, t_s) - reach_along(pair.a, normal, t_s);
  return pair.turns() ? (now - then) / t_s : -normal.dot(pair.b.velocity - pair.a.velocity);
}

}  // namespace

BodyState flown(const SceneDescription& scene, BodyId id, const BodyState& state, double t_s) {
  BodyState next;
  next.position_m =
      state.position_m + state.linear_velocity_m_s * t_s + scene.gravity_m_s2 * (0.5 * t_s * t_s);
  next.linear_velocity_m_s = state.linear_velocity_m_s + scene.gravity_m_s2 * t_s;
  next.orientation = state.orientation;
  next.angular_velocity_rad_s = state.angular_velocity_rad_s;
  rotate_freely(scene.bodies[index_of(id)], t_s, next);
  return next;
}

bool have_met(std::span<const ContactManifold> manifolds, BodyId a, BodyId b) {
  return std::any_of(manifolds.begin(), manifolds.end(), [&](const ContactManifold& m) {
    return m.a == a && m.b == b && !is_joint(m);
  });
}

bool is_mesh(const SceneDescription& scene, BodyId id) {
  return is_static(id) && std::holds_alternative<TriangleMesh>(
                              scene.shapes[scene.statics[static_index_of(id)].shape]);
}

double touching_gap_m(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                      const BodyState& state_a, BodyId b) {
  constexpr double kSpheres = 1e-14, kOthers = 1e-8, kRounding = 1e-15;
  const CompiledShape& sa = shape_of(scene, geometry, a);
  const CompiledShape& sb = shape_of(scene, geometry, b);
  const bool sphere = sa.kind == ShapeKind::kSphere || sb.kind == ShapeKind::kSphere;
  return (sphere ? kSpheres : kOthers) * width_of(scene, geometry, a, b) +
         kRounding * state_a.position_m.cwiseAbs().maxCoeff();
}

std::optional<Impact> time_of_impact(const SceneDescription& scene, const Geometry& geometry,
                                     BodyId a, const BodyState& state_a, BodyId b,
                                     const BodyState* state_b, double most_s) {
  constexpr int kMostAdvances = 200;
  constexpr double kStalled = 1e-9;  // of the whole time
  // Of the smaller body's width: how far bodies that turn while they touch, and that nothing
  // presses on each other, may sink in before they are looked at again.
  constexpr double kSinking = 1e-6;
  const double touching = touching_gap_m(scene, geometry, a, state_a, b);
  const double size = width_of(scene, geometry, a, b);
  double time = 0.0;
  for (int i = 0; i < kMostAdvances; ++i) {
    const BodyState now_a = flown(scene, a, state_a, time);
    const BodyState now_b = state_b ? flown(scene, b, *state_b, time) : BodyState{};
    const Vec3& origin = now_a.position_m;
    Pair pair{
        flyer(scene, geometry, a, now_a, origin),
        state_b ? flyer(scene, geometry, b, now_b, origin) : fixed(scene, geometry, b, origin),
        Vec3::Zero()};
    if (state_b == nullptr) pair.gravity = -scene.gravity_m_s2;
    const Separation now = separation_of(scene, geometry, a, now_a, b, state_b ? &now_b : nullptr);
    const bool touches = now.distance_m <= touching;
    const double rounding = 1e-14 * (pair.a.velocity - pair.b.velocity).norm();
    if (touches && approach_m_s(pair, now.normal, touching) > rounding) return Impact{time, false};
    const bool pressed = state_b == nullptr && now.normal.dot(scene.gravity_m_s2) > 0.0;
    const double deeper = pressed ? touching : kSinking * size;
    const double floor = touches ? std::min(now.distance_m, 0.0) - deeper : 0.0;
    const double safe = safe_time(pair, now.normal, floor, most_s - time);
    if (safe >= most_s - time) return std::nullopt;
    if (safe <= kStalled * most_s && touches) return Impact{time, true};
    time += safe;
  }
  return Impact{time, true};
}

void append_way_to_impact(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                          BodyId a, const BodyState& state_a, BodyId b, const BodyState* state_b,
                          std::vector<ContactManifold>& out) {
  const std::optional<Impact> impact =
      time_of_impact(scene, geometry, a, state_a, b, state_b, dt_s);
  if (!impact || impact->time_s == 0.0) return;
  const BodyState then_a = flown(scene, a, state_a, impact->time_s);
  const BodyState then_b = state_b ? flown(scene, b, *state_b, impact->time_s) : BodyState{};
  const Vec3 normal =
      separation_of(scene, geometry, a, then_a, b, state_b ? &then_b : nullptr).normal;
  const Vec3& origin = state_a.position_m;
  const Flyer now_a = flyer(scene, geometry, a, state_a, origin);
  const Flyer now_b =
      state_b ? flyer(scene, geometry, b, *state_b, origin) : fixed(scene, geometry, b, origin);
  const PlacedShape there{now_a.shape, {then_a.orientation.toRotationMatrix(), Vec3::Zero()}};
  ContactCandidates candidates;
  candidates.add(support_point(there, normal),
                 -reach_along(now_b, -normal, 0.0) - reach_along(now_a, normal, 0.0), kWayToImpact);
  emit_manifold(a, b, 0, normal, then_a.position_m, candidates, out);
}

}  // namespace soda::physics
