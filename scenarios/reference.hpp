// The format reference in README, made from the reader's own tables.
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

// Markdown: one section an object, one line a key.
std::string scenario_reference_markdown();

// Markdown: the table of synonyms.
std::string synonyms_markdown();

}  // namespace soda::scenarios
