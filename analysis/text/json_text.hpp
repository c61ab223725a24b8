// JSON put together as text: of reports, and of scenario files.
#pragma once

#include <string>
#include <type_traits>
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

// Its keys in order, each with its value as JSON text.
struct JsonObject {
  std::vector<std::pair<std::string, std::string>> fields = {};

  JsonObject& set(const std::string& key, std::string value);  // adds it, or replaces its value
  const std::string* find(const std::string& key) const;       // null: not there
  void drop(const std::string& key);
  std::string text() const;
};

}  // namespace soda::analysis
