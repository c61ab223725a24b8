// Text to JsonTree: the only part that knows the JSON library.
#pragma once

#include <string_view>

#include "scenarios/faults.hpp"
#include "scenarios/json_tree.hpp"

namespace soda::scenarios {

inline constexpr std::size_t kMaxDepth = 64;          // of nested arrays and objects
inline constexpr std::size_t kMaxValues = 4'000'000;  // in one file

// Parses RFC 8259 JSON (a byte order mark is skipped). Duplicate keys are faults that do not stop
// the reading. Anything that does stop it (syntax, a number that is no finite double, depth, size)
// is one fault, and the tree comes back empty. `text` must outlive the tree.
JsonTree parse_json(std::string_view text, FaultList& faults);

}  // namespace soda::scenarios
