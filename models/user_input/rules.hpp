// What all worlds know alike of a step.
#pragma once

#include <algorithm>
#include <memory>

#include "models/territory/territory.hpp"
#include "models/user_input/scene_versions.hpp"
#include "models/user_input/user_input.hpp"
#include "physics/model/scene.hpp"

namespace soda::models {

// What user input has done so far that lasts.
struct InputAccount {
  Presence presence;
  SceneChanges changes;

  friend bool operator==(const InputAccount&, const InputAccount&) = default;
};

// Who owns which cell, and the constants of the bodies, during one step. Never null. What is
// pointed to is immutable and shared between entries, worlds and threads: a change is a new object.
struct Rules {
  std::shared_ptr<const TerritoryMap> map;
  std::shared_ptr<const physics::SceneDescription> scene;  // by its address: one for each version
  std::shared_ptr<const InputAccount> inputs;

  friend bool operator==(const Rules& a, const Rules& b) {
    const bool same_map = a.map == b.map || std::ranges::equal(a.map->owners(), b.map->owners());
    return same_map && a.scene == b.scene && (a.inputs == b.inputs || *a.inputs == *b.inputs);
  }
};

}  // namespace soda::models
