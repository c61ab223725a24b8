#include "scenarios/reference.hpp"

#include <algorithm>

#include "scenarios/format.hpp"
#include "scenarios/synonyms.hpp"

namespace soda::scenarios {
namespace {

struct Walk {
  std::vector<TaggedTable> tables;
  std::vector<const ChoiceTable*> choices;

  void visit(const ObjectTable& table, std::string_view tag) {
    const auto known = [&](const TaggedTable& t) { return t.table == &table; };
    if (std::any_of(tables.begin(), tables.end(), known)) return;
    tables.push_back({&table, tag});
    for (const Field& field : table.fields) {
      if (field.object) visit(*field.object, "");
      if (field.choice) visit(*field.choice);
    }
  }

  void visit(const ChoiceTable& choice) {
    if (std::find(choices.begin(), choices.end(), &choice) != choices.end()) return;
    choices.push_back(&choice);
    for (const ChoiceEntry& entry : choice.entries) visit(*entry.table, choice.tag);
  }
};

Walk walk_format() {
  Walk walk;
  walk.visit(document_table(), "");
  return walk;
}

std::string code(std::string_view text) { return "`" + std::string(text) + "`"; }

// Of words apart by a space.
std::string codes(std::string_view words) {
  std::string text = "`";
  for (const char c : words) text += c == ' ' ? "`, `" : std::string(1, c);
  return text + "`";
}

std::string keys_text(std::span<const std::string_view> keys) {
  std::string text;
  for (const std::string_view key : keys) text += (text.empty() ? "" : " and ") + code(key);
  return text;
}

std::string line_of(const Field& field) {
  std::string fallback = field.required ? "required" : "";
  if (!field.required && field.fallback) fallback = code(field.fallback());
  return "| " + code(field.key) + " | " + allowed_text(field) + " | " + fallback + " | " +
         std::string(field.doc) + " |\n";
}

std::string section_of(const TaggedTable& entry) {
  const ObjectTable& table = *entry.table;
  std::string text = "#### " + std::string(table.name) + "\n";
  text += std::string(table.doc);
  if (table.alternatives) {
    text += " Exactly one of: " + keys_text(table.alternatives->first) + "; " +
            keys_text(table.alternatives->second);
    if (!table.alternatives->unless.empty())
      text += "; none beside " + code(table.alternatives->unless);
    text += ".";
  }
  text += "\n\n| key | value | default | meaning |\n|---|---|---|---|\n";
  if (!entry.tag.empty()) {
    text +=
        "| " + code(entry.tag) + " | " + code(json_quoted(table.name)) + " | required | Kind. |\n";
  }
  for (const Field& field : table.fields) text += line_of(field);
  return text + "\n";
}

}  // namespace

std::vector<TaggedTable> all_tables() { return walk_format().tables; }

std::vector<const ChoiceTable*> all_choices() { return walk_format().choices; }

std::string synonyms_markdown() {
  std::string text = "| word | name here | what differs |\n|---|---|---|\n";
  for (const Synonym& synonym : synonyms())
    text += "| " + codes(synonym.words) + " | " + codes(synonym.names) + " | " +
            std::string(synonym.note) + " |\n";
  return text;
}

std::string scenario_reference_markdown() {
  const Walk walk = walk_format();
  std::string text;
  for (const ChoiceTable* choice : walk.choices) {
    text += "- **" + std::string(choice->name) + "**: " + std::string(choice->doc) + " One of: ";
    for (const ChoiceEntry& entry : choice->entries) {
      if (&entry != &choice->entries.front()) text += ", ";
      text += std::string(entry.name);
    }
    text += ".\n";
  }
  text += "\n";
  for (const TaggedTable& table : walk.tables) text += section_of(table);
  return text;
}

}  // namespace soda::scenarios
