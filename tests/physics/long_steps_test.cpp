// Steps in which a body would fall farther than its own size.
#include <gtest/gtest.h>

#include "tests/physics/scenes.hpp"

namespace soda::physics::test {
namespace {

constexpr double kSize = 1e-3, kStep = 1.0 / 60.0;  // g dt^2 is 2.7 sizes

// Rests on a floor for a second, turned as said; returns how far its centre went.
double way_of(const Shape& shape, double height, const Quat& orientation) {
  World world = under_gravity();
  world.scene.dt_s = kStep;
  world.add_floor();
  const Vec3 start(0.0, 0.0, height);
  world.add_body(world.add_shape(shape), start).orientation = orientation;
  double way = 0.0;
  for (int i = 0; i < 60; ++i) {
    world.run(1);
    way = std::max(way, (world.states[0].position_m - start).norm());
  }
  return way;
}

TEST(LongSteps, ABoxRestsOnAnyOfItsFaces) {
  constexpr double kRight = 1.5707963267948966;
  const Box box{Vec3::Constant(0.5 * kSize)};
  for (const double angle : {0.0, kRight, 2.0 * kRight, 3.0 * kRight})
    for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY())})
      EXPECT_LT(way_of(box, 0.5 * kSize, about(axis, angle)), 1e-6 * kSize)
          << angle << " about " << axis.transpose();
}

TEST(LongSteps, ACylinderRestsOnEitherEndAndLying) {
  constexpr double kRight = 1.5707963267948966;
  const Cylinder cylinder{0.5 * kSize, kSize};
  for (const double angle : {0.0, kRight, 2.0 * kRight, 3.0 * kRight})
    EXPECT_LT(way_of(cylinder, 0.5 * kSize, about(Vec3::UnitX(), angle)), 1e-3 * kSize) << angle;
}

TEST(LongSteps, AContactIsWithWhatIsLow) {
  World world = under_gravity();
  world.scene.dt_s = kStep;
  world.add_floor();
  world.add_body(world.add_shape(Box{Vec3::Constant(0.5 * kSize)}), Vec3(0, 0, 0.5 * kSize));
  const auto manifolds = contacts_of(world, BodyId{0}, static_id(0));
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 4u);
  for (const ContactPoint& p : manifolds[0].points) EXPECT_LT(p.separation_m, 1e-9);
}

}  // namespace
}  // namespace soda::physics::test
