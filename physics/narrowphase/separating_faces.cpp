#include "physics/narrowphase/separating_faces.hpp"

#include <cmath>

namespace soda::physics {

bool face_separates(const Pose& a, const Vec3& half_a, const Pose& b, const Vec3& half_b) {
  constexpr double kRounding = 1e-9;  // much more than that of any sum below
  const Mat3 &ra = a.rotation, &rb = b.rotation;
  const Vec3 between = b.position - a.position;
  const double slack =
      kRounding * (between.cwiseAbs().sum() + half_a.cwiseAbs().sum() + half_b.cwiseAbs().sum());
  double reach_b[3] = {half_b[0] + slack, half_b[1] + slack, half_b[2] + slack};
  for (int i = 0; i < 3; ++i) {
    double reach = half_a[i] + slack;
    for (int j = 0; j < 3; ++j) {
      const double cosine =
          std::abs(ra(0, i) * rb(0, j) + ra(1, i) * rb(1, j) + ra(2, i) * rb(2, j));
      reach += cosine * half_b[j];
      reach_b[j] += cosine * half_a[i];
    }
    const double distance =
        std::abs(ra(0, i) * between[0] + ra(1, i) * between[1] + ra(2, i) * between[2]);
    if (distance > reach) return true;
  }
  for (int j = 0; j < 3; ++j) {
    const double distance =
        std::abs(rb(0, j) * between[0] + rb(1, j) * between[1] + rb(2, j) * between[2]);
    if (distance > reach_b[j]) return true;
  }
  return false;
}

}  // namespace soda::physics
