#include "models/user_input/user_input.hpp"

#include <algorithm>

#include "models/messages/codec.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::models {

using physics::BodyId;
using physics::BodyState;

namespace {

// Of a push or new velocities.
void act_on(const UserInput& input, const physics::BodyParams& params, BodyState& state) {
  if (input.kind == InputKind::kPush)
    physics::push(params, input.impulse_newton_s, input.point_local_m, state);
  if (input.kind != InputKind::kSetVelocity) return;
  if (input.sets_linear) state.linear_velocity_m_s = input.state.linear_velocity_m_s;
  if (input.sets_angular) state.angular_velocity_rad_s = input.state.angular_velocity_rad_s;
}

}  // namespace

const char* name_of(InputKind kind) {
  constexpr const char* kNames[] = {"add",          "remove",          "push",
                                    "set-velocity", "change-material", "set-motor"};
  return kNames[static_cast<std::size_t>(kind)];
}

bool Presence::has(BodyId body) const {
  return !std::binary_search(absent_.begin(), absent_.end(), body);
}

bool Presence::note(const UserInput& input) {
  const auto place = std::lower_bound(absent_.begin(), absent_.end(), input.body);
  const bool is_absent = place != absent_.end() && *place == input.body;
  switch (input.kind) {
    case InputKind::kAdd:
      if (is_absent) absent_.erase(place);
      return is_absent;
    case InputKind::kRemove:
      if (!is_absent) absent_.insert(place, input.body);
      return !is_absent;
    case InputKind::kPush:
    case InputKind::kSetVelocity:
      return !is_absent;
    case InputKind::kChangeMaterial:
    case InputKind::kSetMotor:
      return true;
  }
  return false;
}

physics::JointMotor motor_after(const UserInput& input, const physics::JointMotor& motor) {
  physics::JointMotor after = motor;
  if (input.motor_speed) after.speed = *input.motor_speed;
  if (input.motor_push) after.most_push = *input.motor_push;
  if (input.motor_target) after.target = input.motor_target;
  return after;
}

bool act_on_bodies(const UserInput& input, const physics::SceneDescription& scene,
                   std::vector<BodyId>& ids, std::vector<BodyState>& states) {
  const auto place = std::lower_bound(ids.begin(), ids.end(), input.body);
  const bool is_here = place != ids.end() && *place == input.body;
  const auto state = states.begin() + (place - ids.begin());
  if (is_here == (input.kind == InputKind::kAdd)) return false;
  if (input.kind == InputKind::kAdd) {
    states.insert(state, input.state);
    ids.insert(place, input.body);
  } else if (input.kind == InputKind::kRemove) {
    states.erase(state);
    ids.erase(place);
  } else {
    act_on(input, scene.bodies[physics::index_of(input.body)], *state);
  }
  return true;
}

void act_on_scene(const UserInput& input, physics::SceneDescription& scene,
                  std::vector<BodyId>& ids, std::vector<BodyState>& states) {
  if (input.kind == InputKind::kChangeMaterial) {
    scene.bodies[physics::index_of(input.body)].material = input.material;
  } else if (input.kind == InputKind::kSetMotor) {
    std::optional<physics::JointMotor>& motor = scene.joints[input.joint].motor;
    motor = motor_after(input, *motor);
  } else {
    act_on_bodies(input, scene, ids, states);
  }
}

kernel::Payload encode_input(const UserInput& input) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(input.id);
  writer.number(input.step);
  writer.number(static_cast<std::uint32_t>(input.kind));
  writer.id(input.body);
  writer.state(input.state);
  writer.number(static_cast<std::uint8_t>(input.sets_linear));
  writer.number(static_cast<std::uint8_t>(input.sets_angular));
  writer.vector(input.impulse_newton_s);
  writer.vector(input.point_local_m);
  writer.number(input.material.friction);
  writer.number(input.material.restitution);
  writer.number(input.material.rolling_friction_m);
  writer.number(input.material.torsional_friction_m);
  writer.number(input.joint);
  for (const auto& value : {input.motor_speed, input.motor_push, input.motor_target}) {
    writer.number(static_cast<std::uint8_t>(value.has_value()));
    writer.number(value.value_or(0.0));
  }
  return kernel::Payload(std::move(bytes));
}

UserInput decode_input(std::span<const std::byte> payload) {
  Reader reader(payload);
  UserInput input;
  input.id = reader.number<std::uint32_t>();
  input.step = reader.number<std::int64_t>();
  input.kind = static_cast<InputKind>(reader.number<std::uint32_t>());
  input.body = reader.id();
  input.state = reader.state();
  input.sets_linear = reader.number<std::uint8_t>() != 0;
  input.sets_angular = reader.number<std::uint8_t>() != 0;
  input.impulse_newton_s = reader.vector();
  input.point_local_m = reader.vector();
  input.material.friction = reader.number<double>();
  input.material.restitution = reader.number<double>();
  input.material.rolling_friction_m = reader.number<double>();
  input.material.torsional_friction_m = reader.number<double>();
  input.joint = reader.number<std::uint32_t>();
  for (auto* const value : {&input.motor_speed, &input.motor_push, &input.motor_target}) {
    const bool given = reader.number<std::uint8_t>() != 0;
    const double number = reader.number<double>();
    if (given) *value = number;
  }
  return input;
}

}  // namespace soda::models
