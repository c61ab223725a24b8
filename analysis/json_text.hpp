// JSON as text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace soda::analysis {

using Json = nlohmann::ordered_json;

// Indented by two, with a final line break. Text from a file may hold anything: bytes that are not
// UTF-8 are replaced, not thrown upon.
inline std::string dumped(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace soda::analysis
