#include "physics/approach.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/rigid_motion.hpp"

// Along any direction n the gap between two convex solids is bounded from below by that between
// their supporting planes. For a short time ahead every point of a body moves by v t + w x r t, up
// to half an acceleration that is bounded by |w|^2 |r|; the lowest such point along n is what the
// support function finds in the direction n + t (n x w). So one direction tells how long nothing
// can touch, to second order in that time, and a few of them lead to the impact.
namespace soda::physics {
namespace {

// The largest square of the spin that a free body comes to. Energy and angular momentum stay, and
// both are linear in the squares of the spin about its principal axes, so it is reached where one
// of the three vanishes.
double most_squared_spin(const BodyParams& params, const Vec3& spin_local) {
  const Mat3& inertia = params.inertia_local_kg_m2;
  const Vec3 momentum = times(inertia, spin_local);
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

Vec3 to_local(const Mat3& rotation, const Vec3& v) {
  return {rotation.col(0).dot(v), rotation.col(1).dot(v), rotation.col(2).dot(v)};
}

Flyer flyer(const SceneDescription& scene, const Geometry& geometry, BodyId id,
            const BodyState& state) {
  const BodyParams& params = scene.bodies[index_of(id)];
  const ShapeGeometry& shape = geometry.impl().shapes[params.shape];
  Flyer f{{shape, {shape.shape, {state.orientation.toRotationMatrix(), Vec3::Zero()}}}};
  const Vec3& spin = state.angular_velocity_rad_s;
  if (shape.shape.kind == ShapeKind::kSphere || spin == Vec3::Zero()) return f;
  f.params = &params;
  f.turning.orientation = state.orientation;
  f.turning.angular_velocity_rad_s = spin;
  // A point at r from the centre feels |w|^2 |r| and |dw/dt| |r|.
  const Mat3& inertia = params.inertia_local_kg_m2;
  const Vec3 spin_local = to_local(f.solid.placed.pose.rotation, spin);
  double squared = spin.squaredNorm();
  if (is_isotropic(inertia)) {
    f.most_pull_1_s2 = squared;
  } else if (symmetry_axis(inertia) >= 0) {
    // I dw/dt = (I w) x w, whose size stays.
    const Vec3 moment = times(inertia, spin_local).cross(spin_local);
    f.most_change_rad_s2 = times(params.inverse_inertia_local, moment).norm();
    f.most_pull_1_s2 = squared + f.most_change_rad_s2;
  } else {
    // As no moment is larger than the sum of the others, |dw/dt| is at most |w|^2 / sqrt(3).
    squared = most_squared_spin(params, spin_local);
    f.most_pull_1_s2 = 1.6 * squared;
    f.most_change_rad_s2 = 0.6 * squared;
  }
  f.most_spin_rad_s = std::sqrt(squared);
  return f;
}

Flyer fixed(const Geometry& geometry, const StaticGeometry& body) {
  const ShapeGeometry& shape = geometry.impl().shapes[body.shape];
  return {{shape, {shape.shape, {body.pose.rotation, Vec3::Zero()}}}, nullptr, {}, 0.0};
}

void turn(double time_s, Flyer& f) {
  if (!f.turns()) return;
  rotate_freely(*f.params, time_s, f.turning);
  f.solid.placed.pose.rotation = f.turning.orientation.toRotationMatrix();
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

struct Value {
  double height = 0.0, slope = 0.0;
};

// By how much a body that turns comes farther in a direction, as far as velocities tell.
struct TurningReach {
  const CompiledShape& shape;
  Vec3 now, change;  // the direction in the body's frame: now + t change
  double height_now = 0.0;

  // r . (n + t (n x w)) = n . (r + t (w x r))
  TurningReach(const Flyer& f, const Vec3& direction, const Vec3& spin)
      : shape(f.solid.placed.shape),
        now(to_local(f.solid.placed.pose.rotation, direction)),
        change(to_local(f.solid.placed.pose.rotation, direction.cross(spin))) {
    height_now = now.dot(support(shape, now));
  }
  Value after(double t_s) const {
    const Vec3 direction = now + change * t_s;
    const Vec3 farthest = support(shape, direction);
    return {direction.dot(farthest) - height_now, change.dot(farthest)};
  }
};

// Lower bound of the gap above a floor, concave in time.
struct GapCurve {
  double now_m, speed_m_s, pull_m_s2;
  const TurningReach *a, *b;  // null: does not turn

  Value after(double t_s) const {
    Value value{now_m + speed_m_s * t_s + 0.5 * pull_m_s2 * t_s * t_s, speed_m_s + pull_m_s2 * t_s};
    for (const TurningReach* reach : {a, b}) {
      if (reach == nullptr) continue;
      const Value part = reach->after(t_s);
      value.height -= part.height;
      value.slope -= part.slope;
    }
    return value;
  }
};

// By how much points of a body are accelerated along n at most, at any time up to time_s from now.
// The part of w x (w x r) along n is ((n w) w - w^2 n) r: little where the body is thin along n, or
// turns about it. It changes by no more than |w|^3 |r| a second, and by what changes the spin.
double pull_along(const Flyer& f, const Vec3& n, double time_s) {
  if (!f.turns()) return 0.0;
  const Vec3& w = f.turning.angular_velocity_rad_s;
  const double spin = f.most_spin_rad_s, change = f.most_change_rad_s2;
  const Vec3 along = w * n.dot(w) - n * w.squaredNorm();
  const Vec3 local = to_local(f.solid.placed.pose.rotation, along);
  const double now = local.dot(support(f.solid.placed.shape, local));
  const double later = spin * (spin * spin + 3.0 * change) * f.radius_m();
  return std::min(now + change * f.radius_m() + later * time_s, f.most_pull_1_s2 * f.radius_m());
}

// How long the curve stays above 0. Once a point of it is below, so is all that its tangent (bent
// by `pull`) has below 0 before it: that leads from above to where it sinks. What lies on the chord
// between a point above and one below 0 is safe.
double safe_time(const GapCurve& curve, double most_s) {
  constexpr int kMostTrials = 50;
  constexpr double kEnough = 1e-4;  // of the time itself: bodies are looked at again there
  const double left = curve.now_m;
  double unsafe = most_s;
  for (int i = 0; i < kMostTrials; ++i) {
    const Value value = curve.after(unsafe);
    if (value.height >= 0.0) return unsafe;
    const double chord = left > 0.0 ? unsafe * (left / (left - value.height)) : 0.0;
    if (unsafe - chord <= kEnough * chord) return chord;
    // value + slope (-d) + pull d^2 / 2 = 0
    const double discriminant = value.slope * value.slope - 2.0 * curve.pull_m_s2 * value.height;
    if (!(value.slope < 0.0) || !(discriminant >= 0.0)) return chord;
    const double next = unsafe + 2.0 * value.height / (std::sqrt(discriminant) - value.slope);
    if (!(next > chord)) return chord;
    unsafe = next;
  }
  return left > 0.0 ? unsafe * (left / (left - curve.after(unsafe).height)) : 0.0;
}

}  // namespace

FlyingSolids::FlyingSolids(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                           const BodyState& state_a, BodyId b, const BodyState* state_b)
    : fixed_(state_b ? nullptr : &geometry.impl().statics[static_index_of(b)]),
      a_(flyer(scene, geometry, a, state_a)),
      b_(state_b ? flyer(scene, geometry, b, *state_b) : fixed(geometry, *fixed_)),
      start_m_(state_a.position_m),
      start_velocity_(state_a.linear_velocity_m_s),
      pull_(scene.gravity_m_s2) {
  centre_ = (state_b ? state_b->position_m : fixed_->pose.position) - start_m_;
  velocity_ = -start_velocity_;
  if (state_b) velocity_ += state_b->linear_velocity_m_s;
  gravity_ = state_b ? Vec3(Vec3::Zero()) : Vec3(-pull_);
  b_.solid.placed.pose.position = centre_;
}

void FlyingSolids::go_to(double time_s) {
  if (time_s == time_s_) return;
  turn(time_s - time_s_, a_);
  turn(time_s - time_s_, b_);
  time_s_ = time_s;
  b_.solid.placed.pose.position = centre_ + velocity_ * time_s + gravity_ * (0.5 * time_s * time_s);
}

Vec3 FlyingSolids::centre_of_a_m() const {
  return start_m_ + start_velocity_ * time_s_ + pull_ * (0.5 * time_s_ * time_s_);
}

double FlyingSolids::spheres_apart_s(double most_s) const {
  const double radius = a_.solid.placed.shape.bounding_radius_m;
  if (fixed_ == nullptr) {
    const double reach = radius + b_.solid.placed.shape.bounding_radius_m;
    const double apart = centre_.squaredNorm() - reach * reach;
    if (!(apart > 0.0)) return 0.0;
    const double v = centre_.dot(velocity_);
    const double discriminant = v * v - velocity_.squaredNorm() * apart;
    if (!(v < 0.0) || !(discriminant >= 0.0)) return most_s;
    return std::min(apart / (std::sqrt(discriminant) - v), most_s);
  }
  double longest = 0.0;
  const auto consider = [&](const Vec3& up, double height) {
    const double apart = height - radius;
    if (apart > 0.0)
      longest =
          std::max(longest, first_root(apart, up.dot(start_velocity_), up.dot(pull_), most_s));
  };
  if (fixed_->is_half_space) {
    consider(fixed_->plane.normal, fixed_->plane.normal.dot(start_m_) - fixed_->plane.offset_m);
    return longest;
  }
  const bool box = b_.solid.placed.shape.kind == ShapeKind::kBox;
  const Vec3 centre = box ? fixed_->pose.position : 0.5 * (fixed_->box.min + fixed_->box.max);
  const Vec3 half =
      box ? b_.solid.placed.shape.half_extents_m : Vec3(0.5 * (fixed_->box.max - fixed_->box.min));
  for (int i = 0; i < 3; ++i) {
    const Vec3 up = box ? Vec3(fixed_->pose.rotation.col(i)) : Vec3(Vec3::Unit(i));
    const double along = up.dot(start_m_ - centre);
    consider(along >= 0.0 ? up : Vec3(-up), std::abs(along) - half[i]);
  }
  return longest;
}

FlyingSolids::Wait FlyingSolids::apart_s(const Separation& now, double floor_m,
                                         double most_s) const {
  const double speed = now.normal.dot(velocity()), pull = now.normal.dot(gravity_);
  const double left = now.distance_m - floor_m;
  if (!turns()) return {left > 0.0 ? first_root(left, speed, pull, most_s) : 0.0, nullptr};
  // Gravity that opens the gap is left out: the curve would not be concave.
  const Vec3 to_a = -now.normal;
  // As long as directions hardly change, points are bent by much less than ever.
  constexpr double kTurn_rad = 0.25;
  const double window =
      std::min(most_s, kTurn_rad / std::max(a_.most_spin_rad_s, b_.most_spin_rad_s));
  GapCurve curve{
      left, speed,
      std::min(pull, 0.0) - pull_along(a_, now.normal, window) - pull_along(b_, to_a, window),
      nullptr, nullptr};
  std::optional<TurningReach> of_a, of_b;
  if (a_.turns()) curve.a = &of_a.emplace(a_, now.normal, a_.turning.angular_velocity_rad_s);
  if (b_.turns()) curve.b = &of_b.emplace(b_, to_a, b_.turning.angular_velocity_rad_s);
  Wait longest{safe_time(curve, window), nullptr};
  if (longest.time_s >= window && window < most_s) {
    curve.pull_m_s2 =
        std::min(pull, 0.0) - a_.most_pull_1_s2 * a_.radius_m() - b_.most_pull_1_s2 * b_.radius_m();
    longest.time_s = std::max(longest.time_s, safe_time(curve, most_s));
  }
  // A plane has no end: no part of it stays within reach along a direction that turns.
  if (fixed_ && fixed_->is_half_space) return longest;
  for (const Flyer* with : {&a_, &b_}) {
    if (!with->turns() || !(longest.time_s < most_s) || !(left > 0.0)) continue;
    const double safe = apart_turning_s(now, with == &a_, left, longest.time_s, most_s);
    if (safe > longest.time_s) longest = {safe, with};
  }
  return longest;
}

// Along a normal that turns with a body nothing of it comes nearer, where ends of a face or an edge
// do along one that stays: that would lead to impacts on these a share of the way at a time. In the
// frame of that body, at r from its centre, a point of the other has the velocity v - w x r; how
// fast that changes is bounded by all that turns the normal, times what it turns.
double FlyingSolids::apart_turning_s(const Separation& now, bool with_a, double left_m,
                                     double least_s, double most_s) const {
  const Flyer &owner = with_a ? a_ : b_, &other = with_a ? b_ : a_;
  // Towards the other, as the owner sees it.
  const double sign = with_a ? 1.0 : -1.0;
  const Vec3 outward = sign * now.normal, velocity = sign * this->velocity();
  const Vec3 centre = sign * b_.solid.placed.pose.position;
  const Vec3 spin = owner.turning.angular_velocity_rad_s;
  const double pull_m_s2 = gravity_.norm(), speed = velocity.norm() + pull_m_s2 * most_s;
  const double farthest = centre.norm() + speed * most_s + other.radius_m();
  const double fastest = speed + other.most_spin_rad_s * other.radius_m();
  const double bend = pull_m_s2 + other.most_pull_1_s2 * other.radius_m() +
                      2.0 * owner.most_spin_rad_s * fastest + owner.most_pull_1_s2 * farthest;
  // It is of use shortly before an impact, and hardly ever promises more than the bend leaves.
  if (0.5 * bend * least_s * least_s > left_m) return 0.0;
  const Vec3 other_spin = other.turns() ? other.turning.angular_velocity_rad_s : Vec3(Vec3::Zero());
  const TurningReach reach(other, -outward, other_spin - spin);
  return safe_time({left_m, outward.dot(velocity - spin.cross(centre)), -bend, &reach, nullptr},
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
    return TurningReach(f, direction, f.turning.angular_velocity_rad_s).after(t_s).slope;
  };
  if (a_.turns()) nearer += turning(a_, normal);
  if (b_.turns()) nearer += turning(b_, -normal);
  return nearer;
}

}  // namespace soda::physics
