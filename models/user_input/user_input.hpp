// What a user does to bodies while a scene runs: the inputs, their effect, their encoding.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernel/api/payload.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::models {

// The order is that of the event log: append only.
enum class InputKind : std::uint32_t {
  kAdd,
  kRemove,
  kPush,
  kSetVelocity,
  kChangeMaterial,
  kSetMotor
};
inline constexpr std::uint32_t kInputKinds = 6;

// As in the scenario format, e.g. "set-velocity".
const char* name_of(InputKind kind);

// One input. It acts at the beginning of its step, before anything else of that step; inputs of one
// step in the order of their ids. Which members count depends on the kind.
struct UserInput {
  std::uint32_t id = 0;   // given by the user, unique over a run
  std::int64_t step = 0;  // >= 0
  InputKind kind{};
  physics::BodyId body{};  // kSetMotor: the lower one of the joint
  // kAdd: pose and velocities, without impulses. kSetVelocity: the velocities.
  physics::BodyState state;
  bool sets_linear = false, sets_angular = false;          // kSetVelocity
  physics::Vec3 impulse_newton_s = physics::Vec3::Zero();  // kPush
  physics::Vec3 point_local_m = physics::Vec3::Zero();     // kPush: where, from the centre of mass
  physics::Material material;                              // kChangeMaterial: the new one
  std::uint32_t joint = 0;  // kSetMotor: index into SceneDescription::joints; it has a motor
  std::optional<double> motor_speed, motor_push, motor_target;  // kSetMotor: what is new of it
};

constexpr bool acts_before(const UserInput& a, const UserInput& b) {
  return a.step != b.step ? a.step < b.step : a.id < b.id;
}

// What an input turned out to be.
struct CommittedInput {
  UserInput input;              // with the step at which it acted
  std::int64_t asked_step = 0;  // what the user wanted: earlier if it came late; -1: at once
  // An add of a body that was there, or anything else to one that was not, has no effect. A new
  // material and a motor's new task always have one.
  bool had_effect = false;
};

// Which bodies take part is known to everybody from the inputs alone: bodies come and go by them
// only. So whether an input has an effect is a function of the inputs before it.
class Presence {
 public:
  // `absent`: the bodies that do not take part at the beginning; ascending.
  explicit Presence(std::vector<physics::BodyId> absent) : absent_(std::move(absent)) {}

  bool has(physics::BodyId body) const;
  // Takes note of the next input, in the order of acting; whether it has an effect.
  bool note(const UserInput& input);
  const std::vector<physics::BodyId>& absent() const { return absent_; }

  friend bool operator==(const Presence&, const Presence&) = default;

 private:
  std::vector<physics::BodyId> absent_;  // ascending
};

// As the motor is after kSetMotor.
physics::JointMotor motor_after(const UserInput& input, const physics::JointMotor& motor);

// Effect of an input on the bodies that are here: `ids` ascending, `states[i]` of ids[i]. It is of
// a kind that note_change() of scene_versions.hpp does not take. Whether it has any effect: not if
// it adds a body that is here, or if its body is not.
bool act_on_bodies(const UserInput& input, const physics::SceneDescription& scene,
                   std::vector<physics::BodyId>& ids, std::vector<physics::BodyState>& states);

// Effect of an input that has one on a scene that is not divided, and on its description.
void act_on_scene(const UserInput& input, physics::SceneDescription& scene,
                  std::vector<physics::BodyId>& ids, std::vector<physics::BodyState>& states);

kernel::Payload encode_input(const UserInput& input);
UserInput decode_input(std::span<const std::byte> payload);

// Which bodies take part, what is done to them, and how it comes to the worlds.
class LiveInputs;
struct InputOptions {
  std::vector<physics::BodyId> absent;  // at the first step; ascending
  std::vector<UserInput> script;        // known from the start; in any order
  // Of steps before the first one, in the order of acting: their effect is in what the run begins
  // with. Only for those who write down how it came to be.
  std::vector<CommittedInput> acted;
  LiveInputs* live = nullptr;  // what comes while the run goes on; outlives it
  // Sends each input when GVT stands at its step, so that worlds that ran ahead roll back. For
  // tests: committed states are the same.
  bool at_the_last_moment = false;

  bool any() const { return !script.empty() || live != nullptr; }
};

}  // namespace soda::models
