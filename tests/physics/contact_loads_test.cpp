// What contacts bear: against the weight that they carry.
#include "physics/step/contact_loads.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::under_gravity;
using test::World;

std::vector<ContactLoad> loads_of(const World& world) {
  return contact_loads(world.scene, Geometry(world.scene), world.ids, world.states);
}

Vec3 force_newton(const ContactLoad& load) {
  return load.normal * load.normal_newton + load.friction_newton;
}

TEST(ContactLoads, OfAStackAreTheWeightAboveAtAnyStep) {
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
    World world = under_gravity();
    world.scene.dt_s = dt;
    world.add_floor();
    const std::uint32_t box = world.add_shape(Box{{0.5, 0.5, 0.5}});
    for (int i = 0; i < 6; ++i) world.add_body(box, Vec3(0, 0, 0.5 + i));
    world.run(static_cast<int>(1.0 / dt));
    // Pair i holds what is above: the floor under body 0, then body i under i + 1.
    std::array<double, 6> up{};
    for (const ContactLoad& load : loads_of(world)) {
      ASSERT_TRUE(load.point.has_value());
      const std::size_t lower = is_static(load.b) ? 0 : index_of(load.b);
      up[lower] += std::abs(force_newton(load).z());
      EXPECT_GE(load.normal_newton, 0.0);
    }
    for (std::size_t i = 0; i < up.size(); ++i)
      EXPECT_NEAR(up[i], 1000.0 * kGravity * (6.0 - i), 1e-5 * 6000.0 * kGravity) << i;
  }
}

TEST(ContactLoads, OnASlopeAreNormalAndFrictionOfTheWeight) {
  const double slope = 0.3;
  World world = under_gravity();
  Material rough;
  rough.friction = 0.8;
  world.add_static(world.add_shape(HalfSpace{}), Vec3::Zero(),
                   Quat(Eigen::AngleAxisd(slope, Vec3::UnitY())), rough);
  const Quat turned(Eigen::AngleAxisd(slope, Vec3::UnitY()));
  BodyState& state = world.add_body(world.add_shape(Box{{0.5, 0.4, 0.2}}), turned * Vec3(0, 0, 0.2),
                                    1000.0, rough);
  state.orientation = turned;
  world.run(60);
  Vec3 sum = Vec3::Zero();
  double normal = 0.0;
  for (const ContactLoad& load : loads_of(world)) {
    sum += force_newton(load);
    normal += load.normal_newton;
  }
  const double weight = world.scene.bodies[0].mass_kg * kGravity;
  // On the static.
  EXPECT_LT((sum - Vec3(0, 0, -weight)).norm(), 1e-6 * weight);
  EXPECT_NEAR(normal, weight * std::cos(slope), 1e-6 * weight);
}

TEST(ContactLoads, OfAHeapOnAFloorAddUpToItsWeight) {
  World world = under_gravity();
  world.add_floor();
  const std::uint32_t ball = world.add_shape(Sphere{0.3}),
                      box = world.add_shape(Box{{0.3, 0.2, 0.25}});
  double mass = 0.0;
  for (int i = 0; i < 40; ++i)
    world.add_body(i % 2 ? ball : box, Vec3(0.31 * (i % 3), 0.29 * (i % 4), 0.4 + 0.35 * i));
  for (const BodyParams& body : world.scene.bodies) mass += body.mass_kg;
  world.run(1200);
  Vec3 on_floor = Vec3::Zero();
  for (const ContactLoad& load : loads_of(world))
    if (is_static(load.b)) on_floor += force_newton(load);
  EXPECT_NEAR(-on_floor.z(), mass * kGravity, 1e-3 * mass * kGravity);
}

TEST(ContactLoads, AreNoneOfWhatFlies) {
  World world = under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Sphere{0.5}), Vec3(0, 0, 50));
  world.run(10);
  EXPECT_TRUE(loads_of(world).empty());
}

}  // namespace
}  // namespace soda::physics
