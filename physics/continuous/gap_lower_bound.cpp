#include "physics/continuous/gap_lower_bound.hpp"

#include <cmath>

namespace soda::physics {

// Once a point of it is below, so is all that its tangent (bent by `pull`) has below 0 before it:
// that leads from above to where it sinks. What lies on the chord between a point above and one
// below 0 is safe.
double safe_time(const GapLowerBound& curve, double most_s) {
  constexpr int kMostTrials = 50;
  constexpr double kEnough = 1e-4;  // of the time itself: bodies are looked at again there
  const double left = curve.now_m;
  double unsafe = most_s;
  for (int i = 0; i < kMostTrials; ++i) {
    const CurvePoint value = curve.after(unsafe);
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

}  // namespace soda::physics
