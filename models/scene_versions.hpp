// A scene whose bodies' materials change: one description for each version, shared by all worlds.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "physics/model/scene.hpp"

namespace soda::models {

// A body whose material is not that of the scene any more.
struct MaterialChange {
  physics::BodyId body{};
  double friction = 0.0, restitution = 0.0;

  friend auto operator<=>(const MaterialChange&, const MaterialChange&) = default;
};
using MaterialChanges = std::vector<MaterialChange>;  // ascending by body, each once

// Sets or replaces the change of one body.
void set_material(physics::BodyId body, const physics::Material& material,
                  MaterialChanges& changes);

// The memory of a pure function: equal changes, same description, for as long as somebody holds it.
// A new version costs a copy of the scene, once in a process. From all worker threads.
class SceneVersions {
 public:
  // `scene` must outlive all that hold it.
  explicit SceneVersions(const physics::SceneDescription& scene)
      : unchanged_(std::shared_ptr<const void>(), &scene) {}

  std::shared_ptr<const physics::SceneDescription> with(const MaterialChanges& changes);

 private:
  const std::shared_ptr<const physics::SceneDescription> unchanged_;
  std::mutex mutex_;
  std::map<MaterialChanges, std::weak_ptr<const physics::SceneDescription>> versions_;
};

}  // namespace soda::models
