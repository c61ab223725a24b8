#include "physics/continuous/first_touch.hpp"

#include <algorithm>
#include <cmath>

#include "physics/narrowphase/seams.hpp"

namespace soda::physics {
namespace {

// Whether the direction in which two solids are nearest is known at any gap; else it is lost in
// rounding shortly before they touch.
bool is_known_to_the_end(ShapeKind a, ShapeKind b) {
  const auto simple = [](ShapeKind k) {
    return k == ShapeKind::kSphere || k == ShapeKind::kCapsule;
  };
  const bool boxes = a == ShapeKind::kBox && b == ShapeKind::kBox;
  const bool round = (simple(a) || simple(b)) && a != ShapeKind::kHull && b != ShapeKind::kHull;
  return boxes || round || b == ShapeKind::kHalfSpace;
}

// Past the seam of a floor, say, at a moment when they touch. A flight has sunk by what their
// support will bear.
bool pass_a_seam(const FlyingSolids& solids, const Vec3& normal, double time_s, double left_s) {
  const Flyer &a = solids.a(), &b = solids.b();
  const Vec3 pulled = solids.relative_field_m_s2() * time_s;
  PairMotion motion;
  motion.velocity_b = solids.velocity() - pulled;
  motion.angular_velocity_a = a.turning.angular_velocity_rad_s;
  motion.angular_velocity_b = b.turning.angular_velocity_rad_s;
  motion.center_b = b.solid.placed.pose.position - b.arm;
  motion.dt_s = left_s;
  const bool of_b = b.solid.placed.shape.radius_m > 0.0;  // what is round touches there
  const Vec3 point =
      of_b ? support_point(b.solid.placed, -normal) : support_point(a.solid.placed, normal);
  return slides_past(a.solid.placed, b.solid.placed, normal, point, motion,
                     pulled * (0.5 * time_s));
}

}  // namespace

Vec3 first_guess(const Solid& a, const Solid& b) {
  const Vec3 between = b.placed.pose.position - a.placed.pose.position;
  return between == Vec3::Zero() ? Vec3(Vec3::UnitZ()) : between;
}

std::optional<Touch> first_touch(const TouchSearch& search, FlyingSolids& solids) {
  const double touching_m = search.touching_m, most_s = search.most_s;
  double time = search.begin_s;
  constexpr int kMostAdvances = 200;
  constexpr double kStalled = 1e-9;  // of the whole time
  // Of the smaller body's width: how far bodies that turn while they touch, and that nothing
  // presses on each other, may sink in before they are looked at again.
  constexpr double kSinking = 1e-6;
  // Or of the overlap that there is.
  constexpr double kSinkingMore = 0.01;
  constexpr double kShortOfTouching = 0.1, kMostOfIt = 0.5;
  const Solid &a = solids.a().solid, &b = solids.b().solid;
  const double halt =
      is_known_to_the_end(a.placed.shape.kind, b.placed.shape.kind) ? 0.0 : kShortOfTouching;
  solids.bound_turning();
  // Most pairs that do not meet are seen to from where they are, along the line of their centres.
  Separation now{first_guess(a, b).normalized(), 0.0};
  if (b.placed.shape.kind != ShapeKind::kHalfSpace)
    now.distance_m = gap_along(a.placed, b.placed, now.normal);
  if (now.distance_m > touching_m) {
    time = std::max(time, solids.apart_s(now, halt * touching_m, most_s).time_s);
    if (time >= most_s) return std::nullopt;
  }
  double full_m = 0.0;
  const Pose* turns_with = nullptr;
  Vec3 normal_local = Vec3::Zero();
  for (int i = 0; i < kMostAdvances; ++i) {
    solids.go_to(time);
    if (turns_with) now.normal = turns_with->rotation * normal_local;
    // Most of a gap that is left along the direction it was found in is good enough.
    now.distance_m = full_m > touching_m ? gap_along(a.placed, b.placed, now.normal) : 0.0;
    if (!(now.distance_m > kMostOfIt * full_m)) {
      now = separation_between(a, b, now.normal);
      full_m = now.distance_m;
    }
    const bool touches = now.distance_m <= touching_m;
    const double rounding = 1e-14 * solids.velocity().norm(), left_s = most_s - time;
    const double approach = touches ? solids.approach_m_s(now.normal, touching_m) : 0.0;
    if (approach > rounding && is_approach(approach * left_s, search.width_m)) {
      if (pass_a_seam(solids, now.normal, time, left_s)) return std::nullopt;
      return Touch{{time, false}, now.normal};
    }
    const double presses = -now.normal.dot(solids.relative_field_m_s2());
    const bool pressed = is_approach(0.5 * presses * left_s * left_s, search.width_m);
    const double deeper =
        pressed ? touching_m : std::max(kSinking * search.width_m, -kSinkingMore * now.distance_m);
    const double floor = touches ? std::min(now.distance_m, 0.0) - deeper : halt * touching_m;
    const FlyingSolids::Wait safe = solids.apart_s(now, floor, left_s);
    if (safe.time_s >= left_s) return std::nullopt;
    if (safe.time_s <= kStalled * most_s && touches) return Touch{{time, true}, now.normal};
    time += safe.time_s;
    turns_with = safe.with ? &safe.with->solid.placed.pose : nullptr;
    if (turns_with) normal_local = turns_with->direction_to_local(now.normal);
    now.normal = (now.normal + safe.time_s * safe.drift_1_s).normalized();
  }
  return Touch{{time, true}, now.normal};
}

}  // namespace soda::physics
