// Joints of a test's world.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/math/rigid_motion.hpp"
#include "physics/model/joint.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics::test {

// World coordinates; `b` none: the world. `b` moves against `a`, about or along `axis`.
inline Joint joint_at(JointKind kind, const World& world, std::uint32_t a,
                      std::optional<std::uint32_t> b, const Vec3& anchor,
                      const Vec3& axis = Vec3::UnitZ()) {
  Joint joint;
  joint.label = static_cast<std::uint32_t>(world.scene.joints.size());
  joint.kind = kind;
  joint.a = BodyId{a};
  const Quat frame = turn_between(Vec3::UnitZ(), axis);
  const auto local = [&](std::uint32_t body, Vec3& place, Quat& turned) {
    const Quat back = world.states[body].orientation.conjugate();
    place = back * (anchor - world.states[body].position_m);
    turned = back * frame;
  };
  local(a, joint.anchor_a_m, joint.frame_a);
  joint.anchor_b_m = anchor;
  joint.frame_b = frame;
  if (b) {
    joint.b = BodyId{*b};
    local(*b, joint.anchor_b_m, joint.frame_b);
  }
  joint.reach_m = 10.0;
  return joint;
}

// Where it lies then; valid until the next one is added.
inline Joint& add(World& world, const Joint& joint) {
  world.scene.joints.push_back(joint);
  order_joints(world.scene);
  return *std::ranges::find(world.scene.joints, joint.label, &Joint::label);
}

// From the anchor of a to that of b, where the bodies are now.
inline Vec3 between_anchors(const World& world, const Joint& joint) {
  const auto anchor = [&world](BodyId id, const Vec3& local) {
    if (is_static(id)) return local;
    const BodyState& state = world.states[index_of(id)];
    return Vec3(state.position_m + state.orientation * local);
  };
  return anchor(joint.b, joint.anchor_b_m) - anchor(joint.a, joint.anchor_a_m);
}
// How far distances are off at most, if all joints hold one.
inline double largest_misfit_m(const World& world) {
  double largest = 0.0;
  for (const Joint& joint : world.scene.joints)
    largest = std::max(largest, std::abs(between_anchors(world, joint).norm() - joint.length_m));
  return largest;
}
// The largest gap of joints that hold points together.
inline double largest_gap_m(const World& world) {
  double largest = 0.0;
  for (const Joint& joint : world.scene.joints)
    largest = std::max(largest, between_anchors(world, joint).norm());
  return largest;
}

inline constexpr double kSpacing_m = 0.25;

// Balls that ball joints hold, n by n, hanging from the upper rim; the first is `heavier` than the
// others.
inline World hanging_grid(std::uint32_t n, double heavier = 1.0) {
  World world = under_gravity();
  const std::uint32_t ball = world.add_shape(Sphere{0.4 * kSpacing_m});
  const auto place = [](double x, double z) { return Vec3(kSpacing_m * x, 0, -kSpacing_m * z); };
  for (std::uint32_t i = 0; i < n * n; ++i)
    world.add_body(ball, place(i % n, i / n), i == 0 ? 1000.0 * heavier : 1000.0);
  for (std::uint32_t i = 0; i < n * n; ++i) {
    const double x = i % n, z = i / n;
    if (i % n > 0) add(world, joint_at(JointKind::kBall, world, i - 1, i, place(x - 0.5, z)));
    if (i < n)
      add(world, joint_at(JointKind::kBall, world, i, std::nullopt, place(x, -0.5)));
    else
      add(world, joint_at(JointKind::kBall, world, i - n, i, place(x, z - 0.5)));
  }
  return world;
}

}  // namespace soda::physics::test
