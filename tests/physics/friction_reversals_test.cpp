// Friction that turns round or ends within a step, wherever in it that is.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

constexpr double kStep_s = 1.0 / 60.0, kDuration_s = 1.0;

// Boxes on each other on a ramp, which is a floor under tilted gravity, thrown up it.
struct Ramp {
  double slope_rad, friction;
  World world;

  Ramp(double slope, double of_pair, double speed_m_s, int boxes = 1)
      : slope_rad(slope), friction(of_pair) {
    world.scene.gravity_m_s2 = Vec3(-std::sin(slope), 0, -std::cos(slope)) * kGravity;
    world.scene.dt_s = kStep_s;
    const Material material{friction, 0.0};
    world.add_floor(material);
    const std::uint32_t box = world.add_shape(Box{Vec3(0.2, 0.2, 0.1)});
    for (int i = 0; i < boxes; ++i)
      world.add_body(box, Vec3(0, 0, 0.1 + 0.2 * i), 1000.0, material).linear_velocity_m_s =
          Vec3(speed_m_s, 0, 0);
  }
  double place_m(double speed_m_s) const {
    const double pull = kGravity * std::sin(slope_rad),
                 rubs = friction * kGravity * std::cos(slope_rad);
    const double up_s = speed_m_s / (pull + rubs), down_s = kDuration_s - up_s;
    return 0.5 * speed_m_s * up_s - 0.5 * std::max(0.0, pull - rubs) * down_s * down_s;
  }
};

// A reversal is at another place of its step for each speed.
TEST(FrictionReversals, ABoxThatSlidesUpARampAndDownAgainIsWhereItsParabolasEnd) {
  for (const double slope : {0.35, 0.5})
    for (const double friction : {0.2, 0.3, 0.34})
      for (double speed = 2.0; speed < 3.0; speed += 0.083)
        for (const double tolerance : {0.0, 1e-3, 1e-6}) {
          Ramp ramp(slope, friction, speed);
          ramp.world.scene.tolerance = tolerance;
          ramp.world.run(60, Geometry(ramp.world.scene));
          // A tolerance of the width in each step, after which its error goes on.
          const double most_m = tolerance > 0.0 ? 60 * tolerance * 0.2 : 1e-10;
          EXPECT_NEAR(ramp.world.states[0].position_m.x(), ramp.place_m(speed), most_m)
              << slope << " " << friction << " " << speed << " to " << tolerance;
        }
}

// What the estimate says is what it is off by, also where several bodies turn.
TEST(FrictionReversals, TwoBoxesTurnTogetherToATolerance) {
  for (double speed = 2.0; speed < 3.0; speed += 0.17) {
    Ramp ramp(0.35, 0.2, speed, 2);
    ramp.world.scene.tolerance = 1e-7;
    ramp.world.run(60, Geometry(ramp.world.scene));
    for (const BodyState& state : ramp.world.states)
      EXPECT_NEAR(state.position_m.x(), ramp.place_m(speed), 60 * 1e-7 * 0.2) << speed;
  }
}

// Without one, too, where that is worth a part of its own.
TEST(FrictionReversals, TwoBoxesTurnTogetherUnasked) {
  for (double speed = 2.0; speed < 3.0; speed += 0.083) {
    Ramp ramp(0.35, 0.2, speed, 2);
    ramp.world.run(60, Geometry(ramp.world.scene));
    for (const BodyState& state : ramp.world.states)
      EXPECT_NEAR(state.position_m.x(), ramp.place_m(speed), 1e-4) << speed;
  }
}

// Steep enough to hold: it stops, and stays.
TEST(FrictionReversals, WhereFrictionHoldsABoxItStopsForGood) {
  for (double speed = 1.0; speed < 2.0; speed += 0.083) {
    Ramp ramp(0.35, 0.5, speed);
    ramp.world.run(60, Geometry(ramp.world.scene));
    EXPECT_NEAR(ramp.world.states[0].position_m.x(), ramp.place_m(speed), 1e-10) << speed;
    EXPECT_LT(ramp.world.states[0].linear_velocity_m_s.norm(), 1e-13) << speed;
  }
}

TEST(FrictionReversals, CostNothingWhereNothingTurns) {
  Ramp ramp(0.35, 0.2, -1.0);
  const Geometry geometry(ramp.world.scene);
  ramp.world.run(1, geometry);
  const std::uint64_t before = ramp.world.counters.refined_steps;
  ramp.world.run(10, geometry);
  EXPECT_EQ(ramp.world.counters.refined_steps - before, 20u) << "one and two steps each";
}

}  // namespace
}  // namespace soda::physics
