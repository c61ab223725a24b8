// A scenario file in parts that can be left out: what a search draws, and makes small again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::analysis {

// Values as JSON text.
std::string json_of(double value);  // reads back as the same bits
std::string json_of(const physics::Vec3& v);
std::string json_of(const physics::Quat& q);
std::string json_of(bool value);
template <class T>
requires std::is_integral_v<T> std::string json_of(T value) { return std::to_string(value); }
std::string quoted(const std::string& text);
std::string finite_or_null(double value);
// An array with a line for each item.
template <class Items, class Text>
std::string list_of(const Items& items, Text text) {
  std::string all = "[";
  for (const auto& item : items) all += (all.size() > 1 ? ",\n    " : "\n    ") + text(item);
  return all + "]";
}

// An object of a file: its keys in order, each with its value as JSON text.
struct SceneObject {
  std::vector<std::pair<std::string, std::string>> fields = {};

  SceneObject& set(const std::string& key, std::string value);  // adds it, or replaces its value
  const std::string* find(const std::string& key) const;        // null: not there
  void drop(const std::string& key);
  std::string text() const;
};

enum class ScenePart {
  kMaterials,
  kDrives,
  kBodies,
  kStatics,
  kGenerators,
  kJoints,
  kInputs,
  kCount
};
inline constexpr std::size_t kSceneParts = static_cast<std::size_t>(ScenePart::kCount);
const char* key_of(ScenePart part);

// A file that stands beside the scenario.
struct SceneMesh {
  std::string name, text;
};

struct WholeScene {
  SceneObject head;  // all keys but those of the lists
  std::array<std::vector<SceneObject>, kSceneParts> lists;
  std::vector<SceneMesh> meshes;
  std::uint32_t cells = 1;  // of the territory

  std::vector<SceneObject>& operator[](ScenePart part) {
    return lists[static_cast<std::size_t>(part)];
  }
  const std::vector<SceneObject>& operator[](ScenePart part) const {
    return lists[static_cast<std::size_t>(part)];
  }
};

// Takes out objects that name a body, drive or material that is not there any more. What a
// generator makes counts as there.
void drop_dangling(WholeScene& scene);

std::string scene_text(const WholeScene& scene);

}  // namespace soda::analysis
