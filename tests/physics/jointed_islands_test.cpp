// Islands of joints and contacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/physics/joints.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::World;

double largest_gap_m(const World& world) {
  double largest = 0.0;
  for (const Joint& joint : world.scene.joints) {
    const auto anchor = [&world](BodyId id, const Vec3& local) {
      if (is_static(id)) return local;
      const BodyState& state = world.states[index_of(id)];
      return Vec3(state.position_m + state.orientation * local);
    };
    largest = std::max(
        largest, (anchor(joint.b, joint.anchor_b_m) - anchor(joint.a, joint.anchor_a_m)).norm());
  }
  return largest;
}

World lying_chain(int links) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t link = world.add_shape(Box{{0.4, 0.1, 0.1}});
  for (int i = 0; i < links; ++i) world.add_body(link, Vec3(i, 0, 0.1));
  for (int i = 1; i < links; ++i)
    add(world, joint_at(JointKind::kBall, world, static_cast<std::uint32_t>(i - 1),
                        static_cast<std::uint32_t>(i), Vec3(i - 0.5, 0, 0.1)));
  return world;
}

TEST(JointedIslands, AChainThatLiesComesToRestAndCostsNothing) {
  for (const int links : {2, 16, 100}) {
    World world = lying_chain(links);
    world.run(10);
    const std::vector<BodyState> before = world.states;
    const std::uint64_t solved = world.counters.islands_solved;
    world.run(50);
    EXPECT_EQ(world.counters.islands_solved, solved) << links;
    for (std::size_t i = 0; i < before.size(); ++i)
      EXPECT_TRUE(identical(before[i], world.states[i])) << links << ", body " << i;
  }
}

// Hinged planks of 1 kg between two walls, and a ball that falls on them.
TEST(JointedIslands, ASlackBridgeCarriesAHeavyBall) {
  constexpr int kPlanks = 8;
  constexpr double kSpan_m = 4.0, kSag_m = 0.4;
  for (const auto& [ratio, rate] : {std::pair(10.0, 60), {50.0, 60}, {200.0, 240}}) {
    World world = test::under_gravity();
    world.scene.dt_s = 1.0 / rate;
    const auto place = [](int i) {
      const double x = 2.0 * i / kPlanks - 1.0;
      return Vec3(0.5 * kSpan_m * x, 0, -kSag_m * (1.0 - x * x));
    };
    for (int i = 0; i < kPlanks; ++i) {
      const Vec3 along = place(i + 1) - place(i);
      const double length = along.norm();
      const std::uint32_t plank = world.add_shape(Box{{0.48 * length, 0.5, 0.05}});
      world.add_body(plank, 0.5 * (place(i) + place(i + 1)), 1.0 / (0.96 * length * 0.1))
          .orientation = Quat::FromTwoVectors(Vec3::UnitX(), along);
    }
    const double volume = 4.0 / 3.0 * 3.14159265358979 * 0.027;
    world.add_body(world.add_shape(Sphere{0.3}), Vec3(0.02, 0, 0.36 - kSag_m), ratio / volume);
    for (std::uint32_t i = 0; i <= kPlanks; ++i) {
      const bool end = i == 0 || i == kPlanks;
      const std::uint32_t a = i == 0 ? 0 : i - 1;
      add(world, joint_at(JointKind::kHinge, world, a, end ? std::nullopt : std::optional(i),
                          place(static_cast<int>(i)), Vec3::UnitY()));
    }
    world.run(3 * rate);
    EXPECT_GT(world.states[kPlanks].position_m.z(), -0.5 * kSpan_m) << ratio;
    double overlap_m = 0.0;
    for (const IslandReport& island : world.report.islands)
      overlap_m = std::max(overlap_m, island.max_penetration_m);
    EXPECT_LT(overlap_m, 0.01) << ratio;
    EXPECT_LT(largest_gap_m(world), 1e-9) << ratio;
  }
}

}  // namespace
}  // namespace soda::physics
