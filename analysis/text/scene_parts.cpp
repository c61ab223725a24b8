#include "analysis/text/scene_parts.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/text/text_table.hpp"
#include "scenarios/json_tree.hpp"

namespace soda::analysis {
namespace {

using Names = std::set<std::string>;

Names values_of(const std::vector<SceneObject>& objects, const std::string& key) {
  Names names;
  for (const SceneObject& object : objects)
    if (const std::string* const value = object.find(key)) names.insert(*value);
  return names;
}

bool names_one_of(const SceneObject& object, const std::string& key, const Names& known) {
  const std::string* const value = object.find(key);
  return value == nullptr || known.contains(*value);
}

}  // namespace

std::string json_of(double value) { return format_exact(value); }
std::string json_of(const physics::Vec3& v) {
  return "[" + json_of(v.x()) + ", " + json_of(v.y()) + ", " + json_of(v.z()) + "]";
}
std::string json_of(const physics::Quat& q) {
  return "{\"w\": " + json_of(q.w()) + ", \"x\": " + json_of(q.x()) + ", \"y\": " + json_of(q.y()) +
         ", \"z\": " + json_of(q.z()) + "}";
}
std::string json_of(bool value) { return value ? "true" : "false"; }
std::string finite_or_null(double value) { return std::isfinite(value) ? json_of(value) : "null"; }
std::string quoted(const std::string& text) { return scenarios::json_quoted(text); }

SceneObject& SceneObject::set(const std::string& key, std::string value) {
  for (auto& [name, old] : fields)
    if (name == key) {
      old = std::move(value);
      return *this;
    }
  fields.emplace_back(key, std::move(value));
  return *this;
}

const std::string* SceneObject::find(const std::string& key) const {
  const auto found = std::ranges::find(fields, key, &std::pair<std::string, std::string>::first);
  return found == fields.end() ? nullptr : &found->second;
}

void SceneObject::drop(const std::string& key) {
  std::erase_if(fields, [&](const auto& field) { return field.first == key; });
}

std::string SceneObject::text() const {
  std::string text;
  for (const auto& [key, value] : fields)
    text += (text.empty() ? "{" : ", ") + quoted(key) + ": " + value;
  return text + "}";
}

const char* key_of(ScenePart part) {
  constexpr const char* kKeys[] = {"materials",  "drives", "bodies", "statics",
                                   "generators", "joints", "inputs"};
  return kKeys[static_cast<std::size_t>(part)];
}

void drop_dangling(WholeScene& scene) {
  const Names materials = values_of(scene[ScenePart::kMaterials], "name");
  const Names drives = values_of(scene[ScenePart::kDrives], "name");
  for (const ScenePart part : {ScenePart::kBodies, ScenePart::kGenerators, ScenePart::kStatics})
    std::erase_if(scene[part], [&](const SceneObject& object) {
      return !names_one_of(object, "material", materials);
    });
  for (const ScenePart part : {ScenePart::kBodies, ScenePart::kGenerators})
    for (SceneObject& object : scene[part])
      if (!names_one_of(object, "drive", drives)) object.drop("drive");
  if (!scene[ScenePart::kGenerators].empty()) return;
  const Names bodies = values_of(scene[ScenePart::kBodies], "id");
  for (const ScenePart part : {ScenePart::kJoints, ScenePart::kInputs})
    std::erase_if(scene[part], [&](const SceneObject& object) {
      return !names_one_of(object, "body", bodies) || !names_one_of(object, "other_body", bodies);
    });
  const Names joints = values_of(scene[ScenePart::kJoints], "id");
  std::erase_if(scene[ScenePart::kInputs],
                [&](const SceneObject& object) { return !names_one_of(object, "joint", joints); });
}

std::string scene_text(const WholeScene& scene) {
  std::string text = "{\n";
  for (const auto& [key, value] : scene.head.fields)
    text += "  " + quoted(key) + ": " + value + ",\n";
  for (std::size_t part = 0; part < kSceneParts; ++part) {
    const std::vector<SceneObject>& objects = scene.lists[part];
    if (objects.empty()) continue;
    text += "  " + quoted(key_of(static_cast<ScenePart>(part))) + ": [\n";
    for (const SceneObject& object : objects)
      text += "    " + object.text() + (&object == &objects.back() ? "\n" : ",\n");
    text += "  ],\n";
  }
  text.resize(text.size() - 2);
  return text + "\n}\n";
}

}  // namespace soda::analysis
