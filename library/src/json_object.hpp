// A JSON object in the making: what of a scene is built is written down and read as a file is, so
// that it is checked by the same rules and faults are told in the same words.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>

#include "soda/values.hpp"

namespace soda {

std::string json_text(double value);  // reads back as the same bits; not JSON if not finite
std::string json_text(const Vec3& value);
std::string json_text(const Quat& value);
std::string json_text(const std::string& value);
std::string json_text(bool value);
template <class T>
requires std::is_integral_v<T> std::string json_text(T value) { return std::to_string(value); }

// `[a, b]` of items that are text already.
template <class Items, class Text>
std::string json_list(const Items& items, const Text& text, const char* between = ", ") {
  std::string list;
  for (const auto& item : items) list += (list.empty() ? "" : between) + text(item);
  return "[" + list + "]";
}

class JsonObject {
 public:
  JsonObject& raw(const char* key, const std::string& json);  // what is JSON already
  template <class T>
  JsonObject& set(const char* key, const T& value) {
    return raw(key, json_text(value));
  }
  // Left out if it is not given.
  template <class T>
  JsonObject& set(const char* key, const std::optional<T>& value) {
    return value ? set(key, *value) : *this;
  }
  // Left out if it is the default.
  template <class T>
  JsonObject& set_unless(const char* key, const T& value, const T& usual) {
    return value == usual ? *this : set(key, value);
  }
  std::string text() const { return "{" + fields_ + "}"; }

 private:
  std::string fields_;
};

}  // namespace soda
