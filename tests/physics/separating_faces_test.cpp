#include "physics/narrowphase/separating_faces.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

double between(double low, double high, std::mt19937_64& engine) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}
Vec3 random_vector(double low, double high, std::mt19937_64& engine) {
  const double x = between(low, high, engine), y = between(low, high, engine);
  return {x, y, between(low, high, engine)};
}
Pose random_pose(std::mt19937_64& engine) {
  const Vec3 v = random_vector(-1.0, 1.0, engine);
  const Quat rotation = Quat(between(-1.0, 1.0, engine), v.x(), v.y(), v.z()).normalized();
  return {rotation.toRotationMatrix(), random_vector(-2.0, 2.0, engine)};
}

// The gap between the boxes, seen along a normal from a to b.
double gap_along(const Vec3& normal, const Pose& a, const Vec3& half_a, const Pose& b,
                 const Vec3& half_b) {
  return normal.dot(b.position - a.position) -
         (a.rotation.transpose() * normal).cwiseAbs().dot(half_a) -
         (b.rotation.transpose() * normal).cwiseAbs().dot(half_b);
}

double largest_gap(const Pose& a, const Vec3& half_a, const Pose& b, const Vec3& half_b) {
  double largest = -1e300;
  for (const Mat3& axes : {a.rotation, b.rotation})
    for (int i = 0; i < 3; ++i)
      for (const double sign : {-1.0, 1.0})
        largest = std::max(largest, gap_along(sign * axes.col(i), a, half_a, b, half_b));
  return largest;
}

TEST(SeparatingFaces, AreFoundWhereAGapIsSeenAlongAFaceAndNowhereElse) {
  std::mt19937_64 engine(3);
  int apart = 0, together = 0;
  for (int i = 0; i < 20000; ++i) {
    const Pose a = random_pose(engine), b = random_pose(engine);
    const Vec3 half_a = random_vector(0.01, 1.0, engine), half_b = random_vector(0.01, 1.0, engine);
    const double gap = largest_gap(a, half_a, b, half_b);
    if (std::abs(gap) < 1e-7) continue;
    EXPECT_EQ(face_separates(a, half_a, b, half_b), gap > 0.0) << "gap " << gap;
    ++(gap > 0.0 ? apart : together);
  }
  EXPECT_GT(apart, 2000);
  EXPECT_GT(together, 2000);
}

TEST(SeparatingFaces, OfBoxesThatShareAFaceOrAreThinDoNotDependOnRounding) {
  const Pose a, b{Mat3::Identity(), Vec3(0.0, 0.0, 1.0)};
  EXPECT_FALSE(face_separates(a, Vec3::Constant(0.5), b, Vec3::Constant(0.5)));
  const Pose above{Mat3::Identity(), Vec3(0.0, 0.0, 1.0 + 1e-13)};
  EXPECT_FALSE(face_separates(a, Vec3::Constant(0.5), above, Vec3::Constant(0.5)));
  const Pose far{Mat3::Identity(), Vec3(0.0, 0.0, 1.0 + 1e-6)};
  EXPECT_TRUE(face_separates(a, Vec3::Constant(0.5), far, Vec3::Constant(0.5)));
}

}  // namespace
}  // namespace soda::physics
