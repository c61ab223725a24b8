#include "physics/continuous/conservative_advancement.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/continuous/gap_lower_bound.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/shapes/geometry.hpp"

// Along any direction n the gap between two convex solids is bounded from below by that between
// their supporting planes. For a short time ahead every point of a body moves by v t + w x r t, up
// to half an acceleration bounded by |w|^2 |r|; the lowest such point along n is what the support
// function finds in the direction n + t (n x w). So one direction tells how long nothing can touch.
namespace soda::physics {
namespace {

// As long as directions hardly change, points are bent by much less than ever.
constexpr double kRotation_rad = 0.25;

// Of a body whose centre is where `whole` says.
Flyer flyer_of(const Geometry& geometry, const Solid& whole, std::uint32_t part) {
  Flyer f{part_of(geometry.impl(), whole, part), whole.placed.shape};
  if (f.whole.parts.empty()) return f;
  f.part = &f.whole.parts[part];
  f.arm = f.solid.placed.pose.position - whole.placed.pose.position;
  return f;
}

Flyer flyer(const SceneDescription& scene, const Geometry& geometry, BodyId id,
            const BodyState& state, std::uint32_t part) {
  const BodyParams& params = scene.bodies[index_of(id)];
  const ShapeGeometry& shape = geometry.impl().shapes[params.shape];
  const Solid whole{shape, {shape.shape, {state.orientation.toRotationMatrix(), Vec3::Zero()}}};
  Flyer f = flyer_of(geometry, whole, part);
  const Vec3& angular_velocity = state.angular_velocity_rad_s;
  const bool ball = f.solid.placed.shape.kind == ShapeKind::kSphere && f.arm == Vec3::Zero();
  if (ball || angular_velocity == Vec3::Zero()) return f;
  f.params = &params;
  f.turning.orientation = state.orientation;
  f.turning.angular_velocity_rad_s = angular_velocity;
  return f;
}

Flyer fixed(const Geometry& geometry, const StaticGeometry& body, std::uint32_t part) {
  const ShapeGeometry& shape = geometry.impl().shapes[body.shape];
  return flyer_of(geometry, {shape, {shape.shape, {body.pose.rotation, Vec3::Zero()}}}, part);
}

void rotate_solid(double time_s, Flyer& f) {
  if (!f.turns()) return;
  rotate_freely(*f.params, time_s, f.turning);
  f.solid.placed.pose.rotation = f.turning.orientation.toRotationMatrix();
  if (f.part == nullptr) return;
  f.arm = f.solid.placed.pose.rotation * f.part->pose.position;
  f.solid.placed.pose.rotation = f.solid.placed.pose.rotation * f.part->pose.rotation;
}

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

// By a constant angular velocity: r . (n + t (n x w)) = n . (r + t (w x r)).
TurningReach turning_reach(const Flyer& f, const Vec3& direction, const Vec3& w) {
  return {f.solid.placed.shape, f.solid.placed.pose.rotation, direction, direction.cross(w),
          f.local_arm()};
}

// By how much points of a body are accelerated along n at most, at any time up to time_s from now.
// The part of w x (w x r) along n is ((n w) w - w^2 n) r: little where the body is thin along n, or
// turns about it. It changes by w x (w x (w x r)) a second, and by the change of w.
double pull_along(const Flyer& f, const Vec3& n, double time_s) {
  if (!f.turns()) return 0.0;
  const Vec3& w = f.turning.angular_velocity_rad_s;
  const double most_w = f.most.angular_speed_rad_s;
  const Vec3 along = w * n.dot(w) - n * w.squaredNorm();
  const Vec3 local = to_local(f.solid.placed.pose.rotation, along);
  const double now = local.dot(support(f.solid.placed.shape, local)) + along.dot(f.arm);
  const double later =
      (most_w * most_w + f.most.change_rad_s2) * f.most.speed_m_s + most_w * f.most.change_m_s2;
  return std::min(now + f.most.change_m_s2 + later * time_s, f.most.pull_m_s2);
}

// A body with an axis of symmetry turns about it while the axis goes round the angular momentum. So
// the cylinder that it covers about the axis turns steadily, and slowly if w is mostly along it.
struct FastRotation {
  CompiledShape swept;
  Mat3 rotation;
  Vec3 w_swept;
  double pull_m_s2 = 0.0;

  explicit FastRotation(const Flyer& f) {
    const int axis = f.most.fast_axis;
    const Mat3& inertia = f.params->inertia_local_kg_m2;
    const CompiledShape& shape = f.whole;
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const Mat3 body = f.rotation();
    rotation << body.col(i), body.col(j), body.col(axis);
    const Vec3& w = f.turning.angular_velocity_rad_s;
    const double share = 1.0 - inertia(axis, axis) / inertia(i, i);
    w_swept = w - rotation.col(2) * (share * rotation.col(2).dot(w));
    swept.kind = ShapeKind::kCylinder;
    swept.half_length_m = shape.reach_m[axis];
    swept.radius_m =
        std::sqrt(shape.reach_m[i] * shape.reach_m[i] + shape.reach_m[j] * shape.reach_m[j]);
    pull_m_s2 = w_swept.squaredNorm() * std::sqrt(swept.half_length_m * swept.half_length_m +
                                                  swept.radius_m * swept.radius_m);
  }
};

Vec3 angular_velocity_of(const Flyer& f) {
  return f.turns() ? f.turning.angular_velocity_rad_s : Vec3(Vec3::Zero());
}

// The edge of a body, or a line on it, that is most nearly square to a direction.
std::optional<Vec3> edge_square_to(const Flyer& f, const Vec3& n) {
  const Mat3& rotation = f.solid.placed.pose.rotation;
  const ShapeKind kind = f.solid.placed.shape.kind;
  if (kind == ShapeKind::kCapsule || kind == ShapeKind::kCylinder) return Vec3(rotation.col(2));
  if (kind != ShapeKind::kBox) return std::nullopt;
  int edge = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(n.dot(rotation.col(i))) < std::abs(n.dot(rotation.col(edge)))) edge = i;
  return Vec3(rotation.col(edge));
}

// What a body takes from a gap along a direction as time goes on.
struct Taken {
  double now_m = 0.0, pull_m_s2 = 0.0;
  std::optional<FastRotation> fast;
  std::optional<TurningReach> reach;

  Taken(const Flyer& f, const Vec3& direction) {
    if (!f.turns()) return;
    if (f.most.fast_axis < 0) {
      pull_m_s2 = f.most.pull_m_s2;
      reach.emplace(turning_reach(f, direction, f.turning.angular_velocity_rad_s));
      return;
    }
    fast.emplace(f);
    const Vec3 farthest =
        f.solid.placed.pose.rotation *
            support(f.solid.placed.shape, to_local(f.solid.placed.pose.rotation, direction)) +
        f.arm;
    reach.emplace(fast->swept, fast->rotation, direction, direction.cross(fast->w_swept));
    now_m = reach->height_now - direction.dot(farthest);
    pull_m_s2 = fast->pull_m_s2;
  }
};

double sphere_apart_s(const Vec3& field_m_s2, double radius_m, const BodyState& state,
                      const CompiledShape& shape, const StaticGeometry& fixed, double most_s) {
  double longest = 0.0;
  const auto consider = [&](const Vec3& up, double height) {
    const double apart = height - radius_m;
    if (apart > 0.0)
      longest = std::max(longest, first_root(apart, up.dot(state.linear_velocity_m_s),
                                             up.dot(field_m_s2), most_s));
  };
  if (fixed.is_half_space) {
    consider(fixed.plane.normal, fixed.plane.normal.dot(state.position_m) - fixed.plane.offset_m);
    return longest;
  }
  const bool box = shape.kind == ShapeKind::kBox;
  const Vec3 centre = box ? fixed.pose.position : 0.5 * (fixed.box.min + fixed.box.max);
  const Vec3 half = box ? shape.half_extents_m : Vec3(0.5 * (fixed.box.max - fixed.box.min));
  for (int i = 0; i < 3; ++i) {
    const Vec3 up = box ? Vec3(fixed.pose.rotation.col(i)) : Vec3(Vec3::Unit(i));
    const double along = up.dot(state.position_m - centre);
    consider(along >= 0.0 ? up : Vec3(-up), std::abs(along) - half[i]);
  }
  return longest;
}

}  // namespace

double spheres_apart_s(const PairStep& pair) {
  const auto& [scene, geometry, most_s, a, state_a, b, state_b] = pair;
  const double radius = shape_of_a(pair).bounding_radius_m;
  if (state_b == nullptr) {
    return sphere_apart_s(field_of(scene, a), radius, state_a, shape_of_b(pair),
                          geometry.impl().statics[static_index_of(b)], most_s);
  }
  const double reach = radius + shape_of_b(pair).bounding_radius_m;
  const Vec3 centre = state_b->position_m - state_a.position_m;
  const Vec3 velocity = state_b->linear_velocity_m_s - state_a.linear_velocity_m_s;
  const Vec3 pull = relative_field(scene, a, b);
  if (pull != Vec3::Zero()) {  // along the line of the centres as they are
    const double distance = centre.norm();
    if (!(distance > reach)) return 0.0;
    const Vec3 along = centre / distance;
    return first_root(distance - reach, along.dot(velocity), along.dot(pull), most_s);
  }
  const double apart = centre.squaredNorm() - reach * reach;
  if (!(apart > 0.0)) return 0.0;
  const double v = centre.dot(velocity);
  const double discriminant = v * v - velocity.squaredNorm() * apart;
  if (!(v < 0.0) || !(discriminant >= 0.0)) return most_s;
  return std::min(apart / (std::sqrt(discriminant) - v), most_s);
}

FlyingSolids::FlyingSolids(const PairStep& pair, PartPair parts)
    : is_fixed_(pair.state_b == nullptr),
      is_plane_(shape_of_b(pair).kind == ShapeKind::kHalfSpace),
      a_(flyer(pair.scene, pair.geometry, pair.a, pair.state_a, parts.a)),
      b_(pair.state_b ? flyer(pair.scene, pair.geometry, pair.b, *pair.state_b, parts.b)
                      : fixed(pair.geometry, pair.geometry.impl().statics[static_index_of(pair.b)],
                              parts.b)),
      start_m_(pair.state_a.position_m),
      start_velocity_(pair.state_a.linear_velocity_m_s),
      pull_(field_of(pair.scene, pair.a)) {
  const BodyState* const state_b = pair.state_b;
  centre_ = state_b
                ? state_b->position_m - start_m_
                : pair.geometry.impl().statics[static_index_of(pair.b)].pose.position - start_m_;
  velocity_ = -start_velocity_;
  if (state_b) velocity_ += state_b->linear_velocity_m_s;
  field_ = relative_field(pair.scene, pair.a, pair.b);
  between_ = centre_;
  b_.solid.placed.pose.position = centre_ + b_.arm;
}

FlyingSolids::FlyingSolids(const PairStep& pair, const Solid& fixed, std::uint32_t part_a)
    : is_fixed_(true),
      is_plane_(false),
      a_(flyer(pair.scene, pair.geometry, pair.a, pair.state_a, part_a)),
      b_{fixed, fixed.placed.shape},
      centre_(fixed.placed.pose.position - pair.state_a.position_m),
      velocity_(-pair.state_a.linear_velocity_m_s),
      field_(-field_of(pair.scene, pair.a)),
      start_m_(pair.state_a.position_m),
      start_velocity_(pair.state_a.linear_velocity_m_s),
      pull_(field_of(pair.scene, pair.a)) {
  between_ = centre_;
  b_.solid.placed.pose.position = centre_ + b_.arm;
}

void FlyingSolids::bound_turning() {
  for (Flyer* f : {&a_, &b_})
    if (f->turns())
      f->most = angular_velocity_bounds(*f->params, f->whole, f->rotation(),
                                        f->turning.angular_velocity_rad_s);
}

void FlyingSolids::go_to(double time_s) {
  if (time_s == time_s_) return;
  rotate_solid(time_s - time_s_, a_);
  rotate_solid(time_s - time_s_, b_);
  time_s_ = time_s;
  between_ = centre_ + velocity_ * time_s + field_ * (0.5 * time_s * time_s);
  a_.solid.placed.pose.position = a_.arm;
  b_.solid.placed.pose.position = between_ + b_.arm;
}

Vec3 FlyingSolids::centre_of_a_m() const {
  return start_m_ + start_velocity_ * time_s_ + pull_ * (0.5 * time_s_ * time_s_);
}

FlyingSolids::Wait FlyingSolids::apart_s(const Separation& now, double floor_m,
                                         double most_s) const {
  const double speed = now.normal.dot(velocity()), pull = now.normal.dot(field_);
  const double left = now.distance_m - floor_m;
  if (!turns())
    return {left > 0.0 ? first_root(left, speed, pull, most_s) : 0.0, nullptr, Vec3::Zero()};
  // A field that opens the gap is left out: the curve would not be concave.
  const Vec3 to_a = -now.normal;
  const double window = std::min(
      most_s, kRotation_rad / std::max(a_.most.angular_speed_rad_s, b_.most.angular_speed_rad_s));
  GapLowerBound curve{
      left, speed,
      std::min(pull, 0.0) - pull_along(a_, now.normal, window) - pull_along(b_, to_a, window),
      nullptr, nullptr};
  std::optional<TurningReach> of_a, of_b;
  if (a_.turns())
    curve.a = &of_a.emplace(turning_reach(a_, now.normal, a_.turning.angular_velocity_rad_s));
  if (b_.turns())
    curve.b = &of_b.emplace(turning_reach(b_, to_a, b_.turning.angular_velocity_rad_s));
  Wait longest{safe_time(curve, window), nullptr, Vec3::Zero()};
  if (longest.time_s >= window && window < most_s) {
    curve.pull_m_s2 = std::min(pull, 0.0) - a_.most.pull_m_s2 - b_.most.pull_m_s2;
    longest.time_s = std::max(longest.time_s, safe_time(curve, most_s));
  }
  if (longest.time_s < most_s)
    longest.time_s = std::max(longest.time_s, apart_rotating_s(now, left, most_s));
  // A plane has no end: no part of it stays within reach along a direction that turns.
  if (is_plane_) return longest;
  for (const Flyer* with : {&a_, &b_}) {
    if (!with->turns() || !(longest.time_s < most_s) || !(left > 0.0)) continue;
    const double safe = apart_turning_s(now, with == &a_, left, longest.time_s, most_s);
    if (safe > longest.time_s) longest = {safe, with, Vec3::Zero()};
  }
  if (longest.time_s < most_s && left > 0.0) {
    const Wait edges = apart_edges_s(now, floor_m, longest.time_s, most_s);
    if (edges.time_s > longest.time_s) longest = edges;
  }
  return longest;
}

// Of two edges that cross, the ends come nearer along a direction that stays, and those of one
// along a direction that turns with the other. Along n + t n', with n' such that it stays square to
// both, only the edges as a whole do: n' e = -n (w x e). A point of a at r from its centre comes
// farther by (n' + n x w) r t, and by what bends that.
FlyingSolids::Wait FlyingSolids::apart_edges_s(const Separation& now, double floor_m,
                                               double least_s, double most_s) const {
  constexpr double kParallel = 1e-3;  // squared sine
  const std::optional<Vec3> of_a = edge_square_to(a_, now.normal),
                            of_b = edge_square_to(b_, now.normal);
  if (!of_a || !of_b) return {};
  const double along = of_a->dot(*of_b), crossing = 1.0 - along * along;
  if (!(crossing > kParallel)) return {};
  const Vec3 w_a = angular_velocity_of(a_), w_b = angular_velocity_of(b_), &n = now.normal;
  const double rate_a = -n.dot(w_a.cross(*of_a)), rate_b = -n.dot(w_b.cross(*of_b));
  Vec3 drift = (*of_a * (rate_a - along * rate_b) + *of_b * (rate_b - along * rate_a)) / crossing;
  drift -= n * n.dot(drift);
  const double turning = drift.norm();
  const double window = std::min(most_s, kRotation_rad / std::max(turning, 1e-300));
  const double longer = std::sqrt(1.0 + turning * turning * window * window);
  const double speed = velocity().norm() + a_.most.speed_m_s + b_.most.speed_m_s;
  const double bend =
      2.0 * turning * speed + longer * (field_.norm() + a_.most.pull_m_s2 + b_.most.pull_m_s2);
  const double left = now.distance_m - std::max(floor_m, 0.0) * longer - std::min(floor_m, 0.0);
  if (0.5 * bend * least_s * least_s > left) return {};
  const auto reach = [&](const Flyer& f, const Vec3& direction, const Vec3& change) {
    return TurningReach(f.solid.placed.shape, f.solid.placed.pose.rotation, direction, change,
                        f.local_arm());
  };
  const TurningReach by_a = reach(a_, n, drift + n.cross(w_a));
  const TurningReach by_b = reach(b_, -n, -drift - n.cross(w_b));
  const double opening = n.dot(velocity()) + drift.dot(between_);
  return {safe_time({left, opening, -bend, &by_a, &by_b}, window), nullptr, drift};
}

double FlyingSolids::apart_rotating_s(const Separation& now, double left_m, double most_s) const {
  if (a_.most.fast_axis < 0 && b_.most.fast_axis < 0) return 0.0;
  const Taken by_a(a_, now.normal), by_b(b_, -now.normal);
  if (!(left_m > by_a.now_m + by_b.now_m)) return 0.0;
  const double pull = std::min(now.normal.dot(field_), 0.0) - by_a.pull_m_s2 - by_b.pull_m_s2;
  return safe_time({left_m - by_a.now_m - by_b.now_m, now.normal.dot(velocity()), pull,
                    by_a.reach ? &*by_a.reach : nullptr, by_b.reach ? &*by_b.reach : nullptr},
                   most_s);
}

// Along a normal that turns with a body nothing of it comes nearer, where ends of a face or an edge
// do along one that stays: that would lead to impacts on these a share of the distance at a time.
// In the frame of that body, at r from its centre, a point of the other has the velocity v - w x r;
// how fast that changes is bounded by all that turns the normal, times what it turns.
double FlyingSolids::apart_turning_s(const Separation& now, bool with_a, double left_m,
                                     double least_s, double most_s) const {
  const Flyer &owner = with_a ? a_ : b_, &other = with_a ? b_ : a_;
  // Towards the other, as the owner sees it.
  const double sign = with_a ? 1.0 : -1.0;
  const Vec3 outward = sign * now.normal, velocity = sign * this->velocity();
  const Vec3 centre = sign * between_;
  const Vec3 w = owner.turning.angular_velocity_rad_s;
  const double pull_m_s2 = field_.norm(), speed = velocity.norm() + pull_m_s2 * most_s;
  const double farthest = centre.norm() + speed * most_s + other.radius_m();
  const double fastest = speed + other.most.speed_m_s;
  const double bend = pull_m_s2 + other.most.pull_m_s2 +
                      2.0 * owner.most.angular_speed_rad_s * fastest +
                      owner.most.pull_1_s2 * farthest;
  // It is of use shortly before an impact, and hardly ever promises more than the bend leaves.
  if (0.5 * bend * least_s * least_s > left_m) return 0.0;
  const TurningReach reach = turning_reach(other, -outward, angular_velocity_of(other) - w);
  return safe_time({left_m, outward.dot(velocity - w.cross(centre)), -bend, &reach, nullptr},
                   most_s);
}

double FlyingSolids::approach_m_s(const Vec3& normal, double touching_m) const {
  const double along = normal.dot(velocity());
  if (!turns()) return -along;
  const auto fastest_turning = [](const Flyer& f) {
    if (!f.turns()) return 0.0;
    return f.turning.angular_velocity_rad_s.norm() * f.radius_m();
  };
  const double speed = velocity().norm() + fastest_turning(a_) + fastest_turning(b_);
  if (!(speed > 0.0)) return 0.0;
  // A little time ahead, the lowest point is one of those that are meant.
  const double t_s = touching_m / speed;
  double nearer = -along;
  const auto turning = [t_s](const Flyer& f, const Vec3& direction) {
    return turning_reach(f, direction, f.turning.angular_velocity_rad_s).after(t_s).slope;
  };
  if (a_.turns()) nearer += turning(a_, normal);
  if (b_.turns()) nearer += turning(b_, -normal);
  return nearer;
}

}  // namespace soda::physics
