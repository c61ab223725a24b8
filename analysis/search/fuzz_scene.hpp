// Random scenes, and their text as a scenario file: what is tested is what `soda run` reads.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::analysis {

enum class FuzzShapeKind { kSphere, kBox, kCapsule, kCylinder, kHull, kHalfSpace, kMesh };

struct FuzzShape {
  FuzzShapeKind kind = FuzzShapeKind::kBox;
  // Edges of a box; of a sphere, capsule and cylinder x is the diameter, z the length.
  physics::Vec3 size_m = physics::Vec3::Ones();
  std::vector<physics::Vec3> points_m;                  // of a hull or a mesh
  std::vector<std::array<std::uint32_t, 3>> triangles;  // of a mesh
};

// An immovable one, or what a body has besides its motion.
struct FuzzStatic {
  FuzzShape shape;
  double friction = 0.0, restitution = 0.0;
  physics::Vec3 position_m = physics::Vec3::Zero();
  physics::Quat orientation = physics::Quat::Identity();
};

struct FuzzBody : FuzzStatic {
  std::uint32_t id = 0;
  double mass_kg = 1.0;
  physics::Vec3 velocity_m_s = physics::Vec3::Zero(), spin_rad_s = physics::Vec3::Zero();
};

struct FuzzJoint {
  std::string type = "ball";  // as in scenario files
  std::uint32_t body = 0;
  std::optional<std::uint32_t> other_body;  // none: the world
  physics::Vec3 anchor_m = physics::Vec3::Zero(), axis = physics::Vec3::UnitX();
  physics::Vec3 other_anchor_m = physics::Vec3::Zero();  // of a distance or a spring
  bool can_collide = false;
  // Of a hinge (rad, N m) or a slider (m, N): least <= 0 and most >= 0; speed and largest push.
  std::optional<std::pair<double, double>> limits, motor;
  double length_m = 0.0, stiffness_newton_m = 0.0, damping_newton_s_m = 0.0;  // of a spring
};

// What holds bodies of a random scene: all kinds of joints but springs, or springs.
enum class FuzzJoints { kNone, kRigid, kSprings };

struct FuzzScene {
  std::uint64_t seed = 0;                               // that drew it
  double time_step_s = 1.0 / 60.0, gravity_m_s2 = 0.0;  // downwards, along z
  std::int64_t steps = 60;
  std::vector<FuzzBody> bodies;
  std::vector<FuzzStatic> statics;
  std::vector<FuzzJoint> joints;
};

// A function of its arguments: 1 to 12 bodies of any shapes, sizes 1e-3 to 1e3 m and masses 1e-9 to
// 1e9 kg (alike or wild), overlapping or not, any velocities and spins, friction 0 to 2,
// restitution 0 to 1, steps of 1e-4 to 0.1 s, with floors, obstacles and meshes; besides that,
// joints, limits and motors, in trees and loops, or springs that turn by 1e-2 to 30 rad in a step.
// A slider between two bodies has stops: from an endless one that turns, things are thrown off at
// any speed.
FuzzScene draw_scene(std::uint64_t seed, std::int64_t steps, FuzzJoints joints = FuzzJoints::kNone);

// As a scenario file; every number reads back as the same bits.
std::string scenario_text(const FuzzScene& scene, const std::string& description);

}  // namespace soda::analysis
