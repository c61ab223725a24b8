// Bodies of one kind, or of all, that are poured into a box of five halfspaces.
#pragma once

#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics::test {

enum class Poured { kSpheres, kBoxes, kCapsules, kCylinders, kHulls, kMixed };

struct Pour {
  Poured kind = Poured::kMixed;
  int bodies = 40;
  double restitution = 0.3, friction = 0.3;
  double dt_s = 1.0 / 60.0;
  std::uint64_t seed = 1;
};

inline constexpr double kPourWall_m = 0.5;

// About .2 m wide, of half a kilogram or more.
inline Shape poured_shape(Poured kind) {
  switch (kind) {
    case Poured::kSpheres:
      return Sphere{0.09};
    case Poured::kBoxes:
      return Box{Vec3(0.1, 0.075, 0.05)};
    case Poured::kCapsules:
      return Capsule{0.05, 0.12};
    case Poured::kCylinders:
      return Cylinder{0.07, 0.14};
    default: {
      const std::vector<Vec3> corners{Vec3(0.09, 0, -0.05), Vec3(-0.07, 0.08, -0.05),
                                      Vec3(-0.06, -0.09, -0.04), Vec3(0.02, 0.01, 0.1),
                                      Vec3(0.08, 0.05, 0.04)};
      return std::get<ConvexHull>(make_convex_hull(corners));
    }
  }
}

inline World poured(const Pour& pour) {
  std::mt19937_64 random(pour.seed);
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
  World world = under_gravity();
  world.scene.dt_s = pour.dt_s;
  const Material material{.friction = pour.friction, .restitution = pour.restitution};
  world.add_floor(material);
  for (const Vec3& normal : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)})
    world.add_static(world.add_shape(HalfSpace{normal, -kPourWall_m}), Vec3::Zero(),
                     Quat::Identity(), material);
  std::vector<std::uint32_t> shapes;
  if (pour.kind == Poured::kMixed)
    for (int kind = 0; kind < static_cast<int>(Poured::kMixed); ++kind)
      shapes.push_back(world.add_shape(poured_shape(static_cast<Poured>(kind))));
  else
    shapes.push_back(world.add_shape(poured_shape(pour.kind)));
  constexpr int kRow = 4;
  constexpr double kApart_m = 0.24;
  for (int i = 0; i < pour.bodies; ++i) {
    const Vec3 cell(i % kRow - 0.5 * (kRow - 1), i / kRow % kRow - 0.5 * (kRow - 1),
                    1.25 + i / (kRow * kRow));
    BodyState& body =
        world.add_body(shapes[static_cast<std::size_t>(i) % shapes.size()],
                       kApart_m * cell + 0.01 * Vec3(unit(), unit(), unit()), 200.0, material);
    body.orientation = Quat(unit(), unit(), unit(), unit()).normalized();
  }
  return world;
}

}  // namespace soda::physics::test
