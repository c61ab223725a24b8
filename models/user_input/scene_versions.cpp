#include "models/user_input/scene_versions.hpp"

#include <algorithm>

namespace soda::models {
namespace {

template <class Change, class Key>
void set_change(const Change& change, Key Change::*key, std::vector<Change>& changes) {
  const auto place = std::ranges::lower_bound(changes, change.*key, {}, key);
  if (place != changes.end() && (*place).*key == change.*key)
    *place = change;
  else
    changes.insert(place, change);
}

}  // namespace

void set_material(physics::BodyId body, const physics::Material& material, SceneChanges& changes) {
  set_change({body, material.friction, material.restitution, material.rolling_friction_m,
              material.torsional_friction_m},
             &MaterialChange::body, changes.materials);
}

void set_motor(std::uint32_t joint, const physics::JointMotor& motor, SceneChanges& changes) {
  set_change({joint, motor.speed, motor.most_push, motor.target}, &MotorChange::joint,
             changes.motors);
}

physics::JointMotor motor_with(const physics::SceneDescription& scene, const SceneChanges& changes,
                               std::uint32_t joint) {
  physics::JointMotor motor = *scene.joints[joint].motor;
  const auto place = std::ranges::lower_bound(changes.motors, joint, {}, &MotorChange::joint);
  if (place == changes.motors.end() || place->joint != joint) return motor;
  motor.speed = place->speed;
  motor.most_push = place->most_push;
  motor.target = place->target;
  return motor;
}

bool note_change(const UserInput& input, const physics::SceneDescription& scene,
                 SceneChanges& changes) {
  const bool is_material = input.kind == InputKind::kChangeMaterial;
  if (!is_material && input.kind != InputKind::kSetMotor) return false;
  if (is_material)
    set_material(input.body, input.material, changes);
  else
    set_motor(input.joint, motor_after(input, motor_with(scene, changes, input.joint)), changes);
  return true;
}

std::shared_ptr<const physics::SceneDescription> SceneVersions::with(const SceneChanges& changes) {
  if (changes.empty()) return unchanged_;
  const std::lock_guard lock(mutex_);
  std::weak_ptr<const physics::SceneDescription>& known = versions_[changes];
  if (std::shared_ptr<const physics::SceneDescription> version = known.lock()) return version;
  auto version = std::make_shared<physics::SceneDescription>(*unchanged_);
  for (const MaterialChange& change : changes.materials)
    version->bodies[physics::index_of(change.body)].material = {change.friction, change.restitution,
                                                                change.rolling_friction_m,
                                                                change.torsional_friction_m};
  for (const MotorChange& change : changes.motors)
    version->joints[change.joint].motor = motor_with(*unchanged_, changes, change.joint);
  std::erase_if(versions_, [](const auto& old) { return old.second.expired(); });
  versions_[changes] = version;
  return version;
}

}  // namespace soda::models
