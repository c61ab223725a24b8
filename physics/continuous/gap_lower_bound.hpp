// A lower bound of the gap between two solids along a direction, for a time ahead.
#pragma once

#include "physics/shapes/compiled_shape.hpp"

namespace soda::physics {

// A vector in the frame of a body.
inline Vec3 to_local(const Mat3& rotation, const Vec3& v) {
  return {rotation.col(0).dot(v), rotation.col(1).dot(v), rotation.col(2).dot(v)};
}

struct CurvePoint {
  double height = 0.0, slope = 0.0;
};

// By how much a solid comes farther along a direction that changes with time, counted from now.
struct TurningReach {
  const CompiledShape& shape;
  Vec3 now, change;  // the direction in the solid's frame: now + t change
  Vec3 arm;          // there, from the centre about which it turns to its own
  double height_now;

  TurningReach(const CompiledShape& shape_, const Mat3& rotation, const Vec3& direction,
               const Vec3& change_1_s, const Vec3& arm_ = Vec3::Zero())
      : shape(shape_),
        now(to_local(rotation, direction)),
        change(to_local(rotation, change_1_s)),
        arm(arm_),
        height_now(now.dot(support(shape_, now) + arm_)) {}

  CurvePoint after(double t_s) const {
    const Vec3 direction = now + change * t_s;
    const Vec3 farthest = support(shape, direction) + arm;
    return {direction.dot(farthest) - height_now, change.dot(farthest)};
  }
};

// The gap above a floor, less what the solids take of it: concave in time, for pull_m_s2 <= 0.
struct GapLowerBound {
  double now_m, speed_m_s, pull_m_s2;
  const TurningReach *a, *b;  // null: reaches no farther

  CurvePoint after(double t_s) const {
    CurvePoint point{now_m + speed_m_s * t_s + 0.5 * pull_m_s2 * t_s * t_s,
                     speed_m_s + pull_m_s2 * t_s};
    for (const TurningReach* reach : {a, b}) {
      if (reach == nullptr) continue;
      const CurvePoint taken = reach->after(t_s);
      point.height -= taken.height;
      point.slope -= taken.slope;
    }
    return point;
  }
};

// How long the curve stays above 0, from below and to 1e-4 of that time; at most `most_s`.
double safe_time(const GapLowerBound& curve, double most_s);

}  // namespace soda::physics
