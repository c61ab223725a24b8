// The page docs/scenario-format.md, made from the reader's own tables.
#pragma once

#include <string>
#include <vector>

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

// A table and the tag by which a choice knows it (empty if it is in none).
struct TaggedTable {
  const ObjectTable* table = nullptr;
  std::string_view tag;
};

// Every object of the format once, the document first, in the order in which fields mention them.
std::vector<TaggedTable> all_tables();
// Every choice once, likewise.
std::vector<const ChoiceTable*> all_choices();

// The page as Markdown: a section an object and a choice, a line a key, and the synonyms.
std::string scenario_reference_markdown();

}  // namespace soda::scenarios
