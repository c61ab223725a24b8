// How far two solids are apart.
#include "physics/narrowphase/separation.hpp"

#include <gtest/gtest.h>

#include <random>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

double between(double low, double high, std::mt19937_64& engine) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}
Vec3 random_vector(double low, double high, std::mt19937_64& engine) {
  const double x = between(low, high, engine), y = between(low, high, engine);
  return {x, y, between(low, high, engine)};
}

Shape hull_of(const Vec3& half) {
  std::vector<Vec3> corners;
  for (const double x : {-half.x(), half.x()})
    for (const double y : {-half.y(), half.y()})
      for (const double z : {-half.z(), half.z()}) corners.emplace_back(x, y, z);
  return std::get<ConvexHull>(make_convex_hull(corners));
}

PlacedShape placed(const World& world, const Geometry& geometry, int i, const Vec3& origin) {
  const BodyState& s = world.states[static_cast<std::size_t>(i)];
  return {geometry.impl().shapes[world.scene.bodies[static_cast<std::size_t>(i)].shape].shape,
          {s.orientation.toRotationMatrix(), s.position_m - origin}};
}

// Two solids at random, of which `seed` tells all.
World random_pair(const Shape& a, const Shape& b, std::mt19937_64& engine) {
  World world;
  for (const Shape& shape : {a, b}) {
    BodyState& state = world.add_body(world.add_shape(shape), random_vector(-0.8, 0.8, engine));
    const Vec3 v = random_vector(-1.0, 1.0, engine);
    state.orientation = Quat(between(-1.0, 1.0, engine), v.x(), v.y(), v.z()).normalized();
  }
  return world;
}

Separation separation_in(const World& world, const Geometry& geometry) {
  return separation_of(
      {world.scene, geometry, 0.0, BodyId{0}, world.states[0], BodyId{1}, &world.states[1]});
}

TEST(Separation, OfSolidsThatAreApartIsTheLargestGapThatAnyDirectionShows) {
  std::mt19937_64 engine(5);
  const Shape shapes[] = {Capsule{0.2, 0.3}, Cylinder{0.3, 0.2}, hull_of(Vec3(0.3, 0.2, 0.1)),
                          Box{Vec3(0.1, 0.2, 0.4)}};
  int apart = 0;
  for (int i = 0; i < 4000; ++i) {
    const int first = i % 3, second = (i / 3) % 4;
    const World world = random_pair(shapes[first], shapes[second], engine);
    const Geometry geometry(world.scene);
    const Separation found = separation_in(world, geometry);
    if (found.distance_m < 1e-3) continue;
    ++apart;
    const Vec3& origin = world.states[0].position_m;
    const PlacedShape a = placed(world, geometry, 0, origin),
                      b = placed(world, geometry, 1, origin);
    EXPECT_NEAR(separation_along(a, b, found.normal), found.distance_m, 1e-12);
    for (const double size : {1.0, 0.1, 1e-2, 1e-3})
      for (int j = 0; j < 20; ++j) {
        const Vec3 normal = (found.normal + size * random_vector(-1.0, 1.0, engine)).normalized();
        EXPECT_LE(separation_along(a, b, normal), found.distance_m * (1.0 + 2e-10))
            << "pair " << i << ", shapes " << first << " and " << second;
      }
  }
  EXPECT_GT(apart, 1000);
}

TEST(Separation, OfBoxesIsPositiveWhereTheyAreApartAndNowhereElse) {
  std::mt19937_64 engine(6);
  const Vec3 half_a(0.4, 0.05, 0.05), half_b(0.1, 0.3, 0.5);
  int apart = 0, together = 0;
  for (int i = 0; i < 4000; ++i) {
    World boxes = random_pair(Box{half_a}, Box{half_b}, engine);
    World hulls;
    for (const Vec3& half : {half_a, half_b})
      hulls.add_body(hulls.add_shape(hull_of(half)), Vec3::Zero());
    hulls.states = boxes.states;
    const Geometry of_boxes(boxes.scene), of_hulls(hulls.scene);
    const double found = separation_in(boxes, of_boxes).distance_m;
    const double distance = separation_in(hulls, of_hulls).distance_m;
    if (std::abs(distance) < 1e-8) continue;
    EXPECT_EQ(found > 0.0, distance > 0.0) << found << " and " << distance;
    EXPECT_LE(std::max(found, 0.0), std::max(distance, 0.0) * (1.0 + 2e-10));
    ++(distance > 0.0 ? apart : together);
  }
  EXPECT_GT(apart, 500);
  EXPECT_GT(together, 300);
}

// Two solids that turn fast, hardly apart.
World turning_pair(const Shape& a, const Shape& b, double restitution, std::mt19937_64& engine) {
  World world = random_pair(a, b, engine);
  for (BodyParams& body : world.scene.bodies) body.material.restitution = restitution;
  for (BodyState& state : world.states) {
    state.angular_velocity_rad_s = random_vector(-20.0, 20.0, engine);
    state.linear_velocity_m_s = random_vector(-3.0, 3.0, engine);
    state.position_m = Vec3::Zero();
  }
  const Geometry geometry(world.scene);
  const Vec3 direction = random_vector(-1.0, 1.0, engine).normalized();
  double near = 0.0, far = 3.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (near + far);
    world.states[1].position_m = direction * middle;
    (separation_in(world, geometry).distance_m > 0.005 ? far : near) = middle;
  }
  world.states[1].position_m = direction * far;
  return world;
}

// Contacts of boxes are looked for far ahead where these move fast. Faces are preferred, by a
// twentieth of the depth.
TEST(Separation, BoxesThatAreApartDoNotSeemToOverlap) {
  std::mt19937_64 engine(8);
  const Vec3 halves[] = {Vec3(0.4, 0.05, 0.05), Vec3(0.1, 0.3, 0.5), Vec3(0.2, 0.2, 0.2)};
  int found = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 &half_a = halves[i % 3], &half_b = halves[i / 3 % 3];
    World world = random_pair(Box{half_a}, Box{half_b}, engine);
    for (BodyState& state : world.states) {
      state.angular_velocity_rad_s = random_vector(-20.0, 20.0, engine);
      state.linear_velocity_m_s = random_vector(-5.0, 5.0, engine);
    }
    const double width_m = 2.0 * std::min(half_a.minCoeff(), half_b.minCoeff());
    const double apart_m = separation_in(world, Geometry(world.scene)).distance_m;
    for (const ContactManifold& m : contacts_of(world, BodyId{0}, BodyId{1})) {
      ++found;
      const double least_m = apart_m > 0.0 ? -0.01 * width_m : 1.06 * apart_m - 0.06 * width_m;
      EXPECT_GE(least_separation_m(m), least_m) << "pair " << i << ": " << apart_m;
    }
  }
  EXPECT_GT(found, 2000);
}

// What is nearest goes, and other features come round.
TEST(Separation, WhatComesRoundInAStepIsMet) {
  std::mt19937_64 engine(7);
  const Shape shapes[] = {Capsule{0.3, 0.4}, Cylinder{0.5, 1.0}, hull_of(Vec3(0.5, 0.5, 0.5)),
                          Box{}};
  double deepest_m = 0.0;
  int met = 0;
  for (int i = 0; i < 4000; ++i) {
    World world = turning_pair(shapes[i % 4], shapes[i / 4 % 4], 0.4, engine);
    for (const ContactManifold& m : contacts_of(world, BodyId{0}, BodyId{1})) {
      ++met;
      if (m.points[0].feature == kDistanceToImpact) {
        EXPECT_GE(m.points[0].separation_m, 0.0) << "pair " << i << ", which is apart";
      }
    }
    const Geometry geometry(world.scene);
    world.run(1, geometry);
    deepest_m = std::max(deepest_m, -separation_in(world, geometry).distance_m);
  }
  EXPECT_GT(met, 2000);
  EXPECT_LT(deepest_m, 0.01);
}

// Without rebounds, the contacts of the step's end are solved instead of every hit. Some turn by a
// third of a right angle in the step.
TEST(Separation, WhatComesRoundAndDoesNotBounceSinksInByLittle) {
  std::mt19937_64 engine(7);
  const Shape shapes[] = {Capsule{0.3, 0.4}, Cylinder{0.5, 1.0}, hull_of(Vec3(0.5, 0.5, 0.5)),
                          Box{}};
  std::vector<double> depths_m;
  for (int i = 0; i < 4000; ++i) {
    World world = turning_pair(shapes[i % 4], shapes[i / 4 % 4], 0.0, engine);
    const Geometry geometry(world.scene);
    world.run(1, geometry);
    depths_m.push_back(std::max(0.0, -separation_in(world, geometry).distance_m));
  }
  std::ranges::sort(depths_m);
  EXPECT_LT(depths_m[3600], 0.004);
  EXPECT_LT(depths_m[3960], 0.03);
  EXPECT_LT(depths_m.back(), 0.12);
}

}  // namespace
}  // namespace soda::physics
