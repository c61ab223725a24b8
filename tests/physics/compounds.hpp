// Bodies of several parts for tests of the physics layer.
#pragma once

#include "tests/physics/scenes.hpp"

namespace soda::physics::test {

inline Compound box_in_eight(World& world, const Vec3& half) {
  const std::uint32_t part = world.add_shape(Box{0.5 * half});
  Compound compound;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    compound.parts.push_back({part, 0.5 * half.cwiseProduct(sign), Quat::Identity()});
  }
  return compound;
}

// Two balls at +-d on the z axis, without a rod.
inline Compound dumbbell(World& world, double radius_m, double d_m) {
  const std::uint32_t ball = world.add_shape(Sphere{radius_m});
  return {{{ball, Vec3(0, 0, -d_m), Quat::Identity()}, {ball, Vec3(0, 0, d_m), Quat::Identity()}}};
}

// Of a square plate and four legs, about its centre of mass.
inline Compound table(World& world, double size_m) {
  const double s = size_m;
  const std::uint32_t plate = world.add_shape(Box{s * Vec3(0.5, 0.5, 0.04)}),
                      leg = world.add_shape(Box{s * Vec3(0.04, 0.04, 0.3)});
  Compound compound{{{plate, s * Vec3(0, 0, 0.34), Quat::Identity()}}};
  for (int i = 0; i < 4; ++i)
    compound.parts.push_back(
        {leg, s * Vec3(i & 1 ? 0.44 : -0.44, i & 2 ? 0.44 : -0.44, 0), Quat::Identity()});
  const Vec3 centre = mass_properties(compound, world.scene.shapes).center_local_m;
  for (CompoundPart& part : compound.parts) part.position_m -= centre;
  return compound;
}

}  // namespace soda::physics::test
