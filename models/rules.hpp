// What all worlds know alike of a step.
#pragma once

#include <memory>

#include "models/territory.hpp"
#include "physics/scene.hpp"

namespace soda::models {

// Who owns which cell, and the constants of the bodies, during one step. Never null. What is
// pointed to is immutable and shared between entries, worlds and threads: a change is a new object.
struct Rules {
  std::shared_ptr<const TerritoryMap> map;
  std::shared_ptr<const physics::SceneDescription> scene;

  // The same objects: equal contents in others count as different.
  friend bool operator==(const Rules&, const Rules&) = default;
};

}  // namespace soda::models
