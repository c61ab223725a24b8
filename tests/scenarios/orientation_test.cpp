#include "scenarios/orientation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "scenarios/random.hpp"

namespace soda::scenarios {
namespace {

TEST(SineCosine, AgreesWithTheLibraryInHigherPrecision) {
  RandomStream stream = make_stream(1, 1);
  double worst = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const double angle_deg = uniform(stream, -400.0, 400.0);
    const long double radians = angle_deg * 3.14159265358979323846264338327950288L / 180.0L;
    const SineCosine result = sine_cosine_of_degrees(angle_deg);
    worst = std::max(worst, std::abs(static_cast<double>(result.sine - std::sin(radians))));
    worst = std::max(worst, std::abs(static_cast<double>(result.cosine - std::cos(radians))));
  }
  EXPECT_LT(worst, 2e-16);
}

TEST(SineCosine, IsExactAtRightAnglesWithoutNegativeZero) {
  const double sines[] = {0.0, 1.0, 0.0, -1.0};
  for (int quarter = -8; quarter <= 8; ++quarter) {
    const SineCosine result = sine_cosine_of_degrees(90.0 * quarter);
    EXPECT_EQ(result.sine, sines[(quarter + 8) % 4]);
    EXPECT_EQ(result.cosine, sines[(quarter + 9) % 4]);
    EXPECT_FALSE(std::signbit(result.sine) && result.sine == 0.0);
    EXPECT_FALSE(std::signbit(result.cosine) && result.cosine == 0.0);
  }
}

TEST(SineCosine, WholeTurnsChangeNoBit) {
  for (const double angle_deg : {30.0, -77.5, 91.25, -179.0})
    for (const double turns : {1.0, 2.0, 17.0, 2777.0}) {
      const SineCosine turned =
          sine_cosine_of_degrees(angle_deg + std::copysign(360.0 * turns, angle_deg));
      const SineCosine once = sine_cosine_of_degrees(angle_deg);
      EXPECT_EQ(turned.sine, once.sine) << angle_deg << " and " << turns;
      EXPECT_EQ(turned.cosine, once.cosine) << angle_deg << " and " << turns;
    }
}

TEST(Orientation, FromAxisAndAngleTurnsRightHanded) {
  const JsonValue place;
  AxisAngleSpec spec;
  spec.json = &place;
  spec.sound = true;
  spec.axis = Vec3(0.0, 0.0, 5.0);
  spec.angle_deg = 90.0;
  FaultList faults;
  const physics::Quat q = orientation_of(spec, faults);
  const Vec3 turned = q._transformVector(Vec3(1.0, 0.0, 0.0));
  EXPECT_NEAR(turned.x(), 0.0, 1e-15);
  EXPECT_NEAR(turned.y(), 1.0, 1e-15);
  EXPECT_NEAR(q.norm(), 1.0, 1e-15);
  EXPECT_TRUE(faults.empty());
}

TEST(Orientation, OfAQuaternionIsNormalised) {
  const JsonValue place;
  QuaternionSpec spec;
  spec.json = &place;
  spec.sound = true;
  spec.w = 0.6004;
  spec.z = 0.8;
  FaultList faults;
  const physics::Quat q = orientation_of(spec, faults);
  EXPECT_NEAR(q.norm(), 1.0, 1e-15);
  EXPECT_NEAR(q.w() / q.z(), 0.6004 / 0.8, 1e-15);
  EXPECT_TRUE(faults.empty());
}

}  // namespace
}  // namespace soda::scenarios
