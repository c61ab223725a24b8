#include "analysis/text/json_text.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/text/text_table.hpp"
#include "scenarios/json_tree.hpp"

namespace soda::analysis {

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

JsonObject& JsonObject::set(const std::string& key, std::string value) {
  for (auto& [name, old] : fields)
    if (name == key) {
      old = std::move(value);
      return *this;
    }
  fields.emplace_back(key, std::move(value));
  return *this;
}

const std::string* JsonObject::find(const std::string& key) const {
  const auto found = std::ranges::find(fields, key, &std::pair<std::string, std::string>::first);
  return found == fields.end() ? nullptr : &found->second;
}

void JsonObject::drop(const std::string& key) {
  std::erase_if(fields, [&](const auto& field) { return field.first == key; });
}

std::string JsonObject::text() const {
  std::string text;
  for (const auto& [key, value] : fields)
    text += (text.empty() ? "{" : ", ") + quoted(key) + ": " + value;
  return text + "}";
}

}  // namespace soda::analysis
