// A scenario file in parts that can be left out: what a search draws, and makes small again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/text/json_text.hpp"

namespace soda::analysis {

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
  JsonObject head;  // all keys but those of the lists
  std::array<std::vector<JsonObject>, kSceneParts> lists;
  std::vector<SceneMesh> meshes;
  std::uint32_t cells = 1;  // of the territory

  std::vector<JsonObject>& operator[](ScenePart part) {
    return lists[static_cast<std::size_t>(part)];
  }
  const std::vector<JsonObject>& operator[](ScenePart part) const {
    return lists[static_cast<std::size_t>(part)];
  }
};

// Takes out objects that name a body, drive or material that is not there any more. What a
// generator makes counts as there.
void drop_dangling(WholeScene& scene);

std::string scene_text(const WholeScene& scene);

}  // namespace soda::analysis
