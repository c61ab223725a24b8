#include "library/src/json_object.hpp"

#include "scenarios/faults.hpp"
#include "scenarios/json_tree.hpp"

namespace soda {

std::string json_text(double value) { return scenarios::number_text(value); }
std::string json_text(const Vec3& v) {
  return "[" + json_text(v.x) + ", " + json_text(v.y) + ", " + json_text(v.z) + "]";
}
std::string json_text(const Quat& q) {
  return JsonObject().set("w", q.w).set("x", q.x).set("y", q.y).set("z", q.z).text();
}
std::string json_text(const std::string& value) { return scenarios::json_quoted(value); }
std::string json_text(bool value) { return value ? "true" : "false"; }

JsonObject& JsonObject::raw(const char* key, const std::string& json) {
  fields_ += (fields_.empty() ? "\"" : ", \"") + std::string(key) + "\": " + json;
  return *this;
}

}  // namespace soda
