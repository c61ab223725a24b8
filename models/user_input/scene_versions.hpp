// A scene whose constants user input changes: one description for each version, shared by all
// worlds.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "models/user_input/user_input.hpp"
#include "physics/model/scene.hpp"

namespace soda::models {

// A body whose material is not that of the scene any more.
struct MaterialChange {
  physics::BodyId body{};
  double friction = 0.0, restitution = 0.0;
  double rolling_friction_m = 0.0, torsional_friction_m = 0.0;

  friend auto operator<=>(const MaterialChange&, const MaterialChange&) = default;
};

// A joint whose motor has another task than that of the scene.
struct MotorChange {
  std::uint32_t joint = 0;  // index into SceneDescription::joints
  double speed = 0.0, most_push = 0.0;
  std::optional<double> target;

  friend auto operator<=>(const MotorChange&, const MotorChange&) = default;
};

// Each ascending by body or joint, each of these once.
struct SceneChanges {
  std::vector<MaterialChange> materials;
  std::vector<MotorChange> motors;

  bool empty() const { return materials.empty() && motors.empty(); }
  friend auto operator<=>(const SceneChanges&, const SceneChanges&) = default;
};

// Sets or replaces the change of one body, or of one joint.
void set_material(physics::BodyId body, const physics::Material& material, SceneChanges& changes);
void set_motor(std::uint32_t joint, const physics::JointMotor& motor, SceneChanges& changes);

// The motor of a joint that has one, in any version of the scene, as the changes leave it.
physics::JointMotor motor_with(const physics::SceneDescription& scene, const SceneChanges& changes,
                               std::uint32_t joint);

// Notes what an input changes of the description. Whether it is of such a kind.
bool note_change(const UserInput& input, const physics::SceneDescription& scene,
                 SceneChanges& changes);

// The memory of a pure function: equal changes, same description, for as long as somebody holds it.
// A new version costs a copy of the scene, once in a process. From all worker threads.
class SceneVersions {
 public:
  // `scene` must outlive all that hold it.
  explicit SceneVersions(const physics::SceneDescription& scene)
      : unchanged_(std::shared_ptr<const void>(), &scene) {}

  std::shared_ptr<const physics::SceneDescription> with(const SceneChanges& changes);

 private:
  const std::shared_ptr<const physics::SceneDescription> unchanged_;
  std::mutex mutex_;
  std::map<SceneChanges, std::weak_ptr<const physics::SceneDescription>> versions_;
};

}  // namespace soda::models
