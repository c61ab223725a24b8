// Joints: what holds two bodies together, or a body to the world.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::physics {

struct BodyState;
struct ContactManifold;
struct SceneDescription;

enum class JointKind {
  kBall,      // the anchors coincide
  kHinge,     // and so do the axes
  kSlider,    // b moves along the axis of a, without turning
  kFixed,     // neither moves nor turns
  kDistance,  // the anchors keep their distance
  kSpring,    // a linear spring and damper between the anchors
};

// Where b would be for a joint with the world. Counts as static: it does not move, and joins no
// island.
inline constexpr BodyId kWorldBody{0xffffffffu};

// How far b may be turned (rad, within +-3) or moved (m) along the axis against a, from the frames
// of the joint on; stops do not bounce.
struct JointLimits {
  double least = 0.0, most = 0.0;  // least <= most
};

// Turns or moves b against a at this speed (rad/s or m/s), with at most this push (N m or N). With
// a target (rad, within +-3, or m, from the frames of the joint on) it is a servo: it goes there at
// no more than |speed|, and what is left falls to 1/e in each time constant.
struct JointMotor {
  double speed = 0.0, most_push = 0.0;  // most_push >= 0
  std::optional<double> target = std::nullopt;
  double time_constant_s = 0.1;  // > 0
};

struct Joint {
  std::uint32_t label = 0;  // the id by which the user knows it
  JointKind kind = JointKind::kBall;
  BodyId a{}, b = kWorldBody;  // a < b; a is dynamic, so is b if it is not the world
  // From the centres of mass, in the frames of the bodies; of the world: in the world frame.
  Vec3 anchor_a_m = Vec3::Zero(), anchor_b_m = Vec3::Zero();
  // The joint's frame, its axis being z, in the frames of the bodies.
  Quat frame_a = Quat::Identity(), frame_b = Quat::Identity();
  double length_m = 0.0;              // kDistance: > 0; kSpring: at rest, >= 0
  double stiffness_newton_m = 0.0;    // kSpring: > 0
  double damping_newton_s_m = 0.0;    // kSpring: >= 0
  std::optional<JointLimits> limits;  // kHinge, kSlider
  std::optional<JointMotor> motor;    // kHinge, kSlider
  double reach_m = 0.0;               // how far from its anchor each body looks for the other's
  bool collides = false;              // whether its two bodies can touch
  // Of what it bears over a step, on the mean: beyond, it is broken from the next step on.
  double most_force_newton = std::numeric_limits<double>::infinity();
  double most_torque_newton_m = std::numeric_limits<double>::infinity();
};
inline bool can_break(const Joint& joint) {
  return joint.most_force_newton < std::numeric_limits<double>::infinity() ||
         joint.most_torque_newton_m < std::numeric_limits<double>::infinity();
}

// `state` is that of any of its bodies.
bool is_broken(const Joint& joint, const BodyState& state);

// In a step a joint is found where the boxes of its bodies meet, like a contact, and travels as
// one: a manifold without points whose part says which joint it is.
inline constexpr std::uint32_t kFirstJointPart = 0x80000000u;
bool is_joint(const ContactManifold& manifold);
std::uint32_t joint_of(const ContactManifold& manifold);  // index into SceneDescription::joints

// Puts the joints into their order and counts those of each body.
void order_joints(SceneDescription& scene);

// Of two bodies, a < b, or of a body and the world: appends their joints. Of two bodies, or of a
// body and a static: whether neither a joint nor their groups keep them from touching. Broken ones
// do not count: `lower` is the state of a.
void append_joints(const SceneDescription& scene, BodyId a, const BodyState& lower, BodyId b,
                   std::vector<ContactManifold>& out);
bool may_touch(const SceneDescription& scene, BodyId a, const BodyState& lower, BodyId b);
// The same of two that no joint holds.
bool may_touch_unheld(const SceneDescription& scene, BodyId a, BodyId b);

// Appends the joints of these bodies with the world, and puts `manifolds` into canonical order.
// Does nothing for a scene that has none.
void append_world_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                         std::span<const BodyState> states,
                         std::vector<ContactManifold>& manifolds);

}  // namespace soda::physics
