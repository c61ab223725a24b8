#include "models/scene_versions.hpp"

#include <algorithm>

namespace soda::models {

void set_material(physics::BodyId body, const physics::Material& material,
                  MaterialChanges& changes) {
  const auto place = std::lower_bound(
      changes.begin(), changes.end(), body,
      [](const MaterialChange& change, physics::BodyId wanted) { return change.body < wanted; });
  const MaterialChange change{body, material.friction, material.restitution};
  if (place != changes.end() && place->body == body)
    *place = change;
  else
    changes.insert(place, change);
}

std::shared_ptr<const physics::SceneDescription> SceneVersions::with(
    const MaterialChanges& changes) {
  if (changes.empty()) return unchanged_;
  const std::lock_guard lock(mutex_);
  std::weak_ptr<const physics::SceneDescription>& known = versions_[changes];
  if (std::shared_ptr<const physics::SceneDescription> version = known.lock()) return version;
  auto version = std::make_shared<physics::SceneDescription>(*unchanged_);
  for (const MaterialChange& change : changes)
    version->bodies[physics::index_of(change.body)].material = {change.friction,
                                                                change.restitution};
  std::erase_if(versions_, [](const auto& old) { return old.second.expired(); });
  versions_[changes] = version;
  return version;
}

}  // namespace soda::models
