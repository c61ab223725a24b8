// Words of other programs for what has another name in this format.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "scenarios/json_tree.hpp"

namespace soda::scenarios {

// A row: who writes one of `words` means the first of `names` that may stand where he wrote it.
struct Synonym {
  std::string_view words;  // apart by a space, in small letters without signs: halfextents
  std::string_view names;  // apart by a space; empty: there is nothing like it, `note` says why
  std::string_view note;   // what differs besides the name; may be empty
};

// In no order that matters; no word stands twice.
std::span<const Synonym> synonyms();

// What to write instead of `word` where `known` names may stand: by the table, else the nearest of
// them, else "". Capitals, hyphens and underscores of the word do not count, nor does the unit at
// its end. `elsewhere`: names that the format knows, but not there; `elsewhere_hint` says so.
std::string name_hint(std::string_view word, std::span<const std::string_view> known,
                      std::span<const std::string_view> elsewhere = {},
                      std::string_view elsewhere_hint = {});

// What was probably meant by a value that the key does not take, or "".
std::string value_hint(std::string_view key, const JsonValue& value);

}  // namespace soda::scenarios
