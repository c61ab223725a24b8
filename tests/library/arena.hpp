// A small scene with something of everything, built through the library.
#pragma once

#include "soda/scene.hpp"

namespace soda::library_test {

inline constexpr std::uint32_t kBall = 1, kWaiting = 2, kDoor = 3, kWagon = 4, kLift = 5,
                               kFirstBox = 10, kHinge = 1, kSlider = 2;

// On a floor: a ball, a pile of boxes, a door on a hinge with a motor, a wagon on a slider, a lift
// that is moved, and a ball that waits to be added.
inline SceneParts arena_parts() {
  SceneParts parts;
  parts.name = "arena";
  parts.time_step_s = 1.0 / 120.0;
  parts.steps = 120;
  parts.materials = {{.name = "wood", .friction = 0.5}, {.name = "rubber", .restitution = 0.5}};
  parts.statics = {{.name = "floor", .shape = HalfSpace{}, .material = "wood"}};
  parts.bodies = {{.id = kBall,
                   .shape = Sphere{0.3},
                   .material = "rubber",
                   .mass_kg = 1.0,
                   .position_m = {-2.0, 0.0, 1.5}},
                  {.id = kWaiting,
                   .shape = Sphere{0.2},
                   .material = "rubber",
                   .mass_kg = 1.0,
                   .position_m = {0.0, 0.0, 4.0},
                   .present = false},
                  {.id = kDoor,
                   .shape = Box{{1.0, 0.1, 1.0}},
                   .material = "wood",
                   .mass_kg = 3.0,
                   .position_m = {3.0, 0.0, 1.0}},
                  {.id = kWagon,
                   .shape = Box{{0.5, 0.5, 0.5}},
                   .material = "wood",
                   .mass_kg = 2.0,
                   .position_m = {5.0, 0.0, 2.0}},
                  {.id = kLift,
                   .shape = Box{{1.0, 1.0, 0.2}},
                   .material = "wood",
                   .position_m = {-5.0, 0.0, 1.0},
                   .velocity_m_s = {0.0, 0.0, 0.5},
                   .kinematic = true}};
  for (std::uint32_t i = 0; i < 5; ++i)
    parts.bodies.push_back({.id = kFirstBox + i,
                            .shape = Box{{0.5, 0.5, 0.5}},
                            .material = "wood",
                            .density_kg_m3 = 500.0,
                            .position_m = {0.02 * (i % 2), 0.0, 0.25 + 0.5 * i}});
  parts.joints = {{.id = kHinge,
                   .kind = JointKind::kHinge,
                   .body = kDoor,
                   .anchor_m = {2.5, 0.0, 1.0},
                   .motor = Motor{.speed = 0.5, .most_push = 10.0}},
                  {.id = kSlider,
                   .kind = JointKind::kSlider,
                   .body = kWagon,
                   .anchor_m = {5.0, 0.0, 2.0},
                   .axis = {1.0, 0.0, 0.0},
                   .motor = Motor{.speed = 0.2, .most_push = 100.0}}};
  parts.territory = {
      .origin_m = {-6.0, -4.0, 0.0}, .cell_size_m = 2.0, .cells = {6, 4, 2}, .worlds = 4};
  return parts;
}

inline Scene arena() { return Scene::build(arena_parts()); }

}  // namespace soda::library_test
