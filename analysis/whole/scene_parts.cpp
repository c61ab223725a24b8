#include "analysis/whole/scene_parts.hpp"

#include <algorithm>
#include <set>

namespace soda::analysis {
namespace {

using Names = std::set<std::string>;

Names values_of(const std::vector<JsonObject>& objects, const std::string& key) {
  Names names;
  for (const JsonObject& object : objects)
    if (const std::string* const value = object.find(key)) names.insert(*value);
  return names;
}

bool names_one_of(const JsonObject& object, const std::string& key, const Names& known) {
  const std::string* const value = object.find(key);
  return value == nullptr || known.contains(*value);
}

}  // namespace

const char* key_of(ScenePart part) {
  constexpr const char* kKeys[] = {"materials",  "drives", "bodies", "statics",
                                   "generators", "joints", "inputs"};
  return kKeys[static_cast<std::size_t>(part)];
}

void drop_dangling(WholeScene& scene) {
  const Names materials = values_of(scene[ScenePart::kMaterials], "name");
  const Names drives = values_of(scene[ScenePart::kDrives], "name");
  for (const ScenePart part : {ScenePart::kBodies, ScenePart::kGenerators, ScenePart::kStatics})
    std::erase_if(scene[part], [&](const JsonObject& object) {
      return !names_one_of(object, "material", materials);
    });
  for (const ScenePart part : {ScenePart::kBodies, ScenePart::kGenerators})
    for (JsonObject& object : scene[part])
      if (!names_one_of(object, "drive", drives)) object.drop("drive");
  if (!scene[ScenePart::kGenerators].empty()) return;
  const Names bodies = values_of(scene[ScenePart::kBodies], "id");
  for (const ScenePart part : {ScenePart::kJoints, ScenePart::kInputs})
    std::erase_if(scene[part], [&](const JsonObject& object) {
      return !names_one_of(object, "body", bodies) || !names_one_of(object, "other_body", bodies);
    });
  const Names joints = values_of(scene[ScenePart::kJoints], "id");
  std::erase_if(scene[ScenePart::kInputs],
                [&](const JsonObject& object) { return !names_one_of(object, "joint", joints); });
}

std::string scene_text(const WholeScene& scene) {
  std::string text = "{\n";
  for (const auto& [key, value] : scene.head.fields)
    text += "  " + quoted(key) + ": " + value + ",\n";
  for (std::size_t part = 0; part < kSceneParts; ++part) {
    const std::vector<JsonObject>& objects = scene.lists[part];
    if (objects.empty()) continue;
    text += "  " + quoted(key_of(static_cast<ScenePart>(part))) + ": [\n";
    for (const JsonObject& object : objects)
      text += "    " + object.text() + (&object == &objects.back() ? "\n" : ",\n");
    text += "  ],\n";
  }
  text.resize(text.size() - 2);
  return text + "\n}\n";
}

}  // namespace soda::analysis
