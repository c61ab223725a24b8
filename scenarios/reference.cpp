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

constexpr std::string_view kIntroduction =
    "# Scenario format, version 1\n"
    "\n"
    "Every key of a scenario file: its type, unit, range, default and meaning.\n"
    "`soda schema --markdown` prints this page from the tables that the reader itself uses, so do\n"
    "not edit it. How to write a scene is told in [scenarios](scenarios.md).\n"
    "\n"
    "- A file is one JSON object (RFC 8259): no comments, no trailing commas, no NaN.\n"
    "- Units are SI. A key ends with its unit.\n"
    "- Unknown keys are faults, and so are keys given twice.\n"
    "- Integers are written without fraction or exponent.\n"
    "- A key without a default may be absent. What that means stands under *meaning*.\n"
    "- The range of vectors is that of each component.\n"
    "\n";

constexpr std::string_view kHeadOfKeys =
    "| key | type | unit | range | default | meaning |\n|---|---|---|---|---|---|\n";

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

// To the section of that name.
std::string link_to(std::string_view name) {
  std::string anchor(name);
  std::replace(anchor.begin(), anchor.end(), ' ', '-');
  return "[" + std::string(name) + "](#" + anchor + ")";
}

// Bars end a cell of a table.
std::string cell(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? "\\|" : std::string(1, c);
  return escaped;
}

std::string type_of(const Field& field) {
  switch (field.kind) {
    case ValueKind::kNumber:
      return "number";
    case ValueKind::kInteger:
      return "integer";
    case ValueKind::kBoolean:
      return "boolean";
    case ValueKind::kText:
    case ValueKind::kName:
      return "string";
    case ValueKind::kVector:
      return "3 numbers";
    case ValueKind::kIntVector:
      return "3 integers";
    case ValueKind::kVectorList:
      return "array of 3 numbers each";
    case ValueKind::kIntVectorList:
      return "array of 3 integers each";
    case ValueKind::kObject:
      return link_to(field.object->name);
    case ValueKind::kObjectList:
      return "array of " + link_to(field.object->name);
    case ValueKind::kChoice:
      return link_to(field.choice->name);
    case ValueKind::kChoiceList:
      return "array of " + link_to(field.choice->name);
  }
  return "";
}

std::string quoted_names(std::span<const std::string_view> names) {
  std::string text;
  for (const std::string_view name : names)
    text += (text.empty() ? "" : ", ") + code(json_quoted(name));
  return text;
}

std::string bound_text(const Field& field, double bound) {
  const bool integer = field.kind == ValueKind::kInteger || field.kind == ValueKind::kIntVector;
  return integer ? std::to_string(static_cast<std::int64_t>(bound)) : number_text(bound);
}

std::string range_of(const Field& field) {
  const Limits& limits = field.limits;
  const std::string items =
      std::to_string(limits.min_items) + " to " + std::to_string(limits.max_items);
  switch (field.kind) {
    case ValueKind::kNumber:
    case ValueKind::kInteger:
    case ValueKind::kVector:
    case ValueKind::kIntVector:
      if (limits.min == limits.max) return bound_text(field, limits.min);
      return bound_text(field, limits.min) + " to " + bound_text(field, limits.max);
    case ValueKind::kText:
      return items + " characters";
    case ValueKind::kName:
      return quoted_names(field.names);
    case ValueKind::kVectorList:
    case ValueKind::kIntVectorList:
    case ValueKind::kObjectList:
    case ValueKind::kChoiceList:
      return items + " items";
    case ValueKind::kBoolean:
    case ValueKind::kObject:
    case ValueKind::kChoice:
      break;
  }
  return "";
}

std::string default_of(const Field& field) {
  if (field.required) return "required";
  return field.fallback ? code(field.fallback()) : "";
}

std::string line_of(const Field& field) {
  return "| " + code(field.key) + " | " + type_of(field) + " | " + std::string(unit_of(field.key)) +
         " | " + range_of(field) + " | " + default_of(field) + " | " + cell(field.doc) + " |\n";
}

bool holds(const ChoiceTable& choice, const ObjectTable& table) {
  return std::any_of(choice.entries.begin(), choice.entries.end(),
                     [&](const ChoiceEntry& entry) { return entry.table == &table; });
}

bool has_line(const ObjectTable& table, const std::string& line) {
  return std::any_of(table.fields.begin(), table.fields.end(),
                     [&](const Field& field) { return line_of(field) == line; });
}

// The key is told with the choice, for every entry has it alike.
bool is_common(const ChoiceTable& choice, const Field& field) {
  const std::string line = line_of(field);
  return std::all_of(choice.entries.begin(), choice.entries.end(),
                     [&](const ChoiceEntry& entry) { return has_line(*entry.table, line); });
}

std::string section_of(const ChoiceTable& choice) {
  std::string kinds;
  for (const ChoiceEntry& entry : choice.entries)
    kinds += (kinds.empty() ? "" : ", ") + link_to(entry.table->name);
  std::string text = "## " + std::string(choice.name) + "\n\n" + std::string(choice.doc);
  text += (choice.tag.empty() ? " One of: " : " By " + code(choice.tag) + ", one of: ");
  text += kinds + ".\n\n";
  std::string lines;
  for (const Field& field : choice.entries.front().table->fields)
    if (is_common(choice, field)) lines += line_of(field);
  if (lines.empty()) return text;
  return text + "Keys of every kind:\n\n" + std::string(kHeadOfKeys) + lines + "\n";
}

std::string alternatives_text(const Alternatives& alternatives) {
  std::string text =
      " Exactly one of: " + keys_text(alternatives.first) + "; " + keys_text(alternatives.second);
  if (!alternatives.unless.empty()) text += "; none beside " + code(alternatives.unless);
  return text + ".";
}

// Of an object; `choices`: those that it is an entry of.
std::string section_of(const TaggedTable& entry, std::span<const ChoiceTable* const> choices) {
  const ObjectTable& table = *entry.table;
  std::string text = "## " + std::string(table.name) + "\n\n";
  if (!entry.tag.empty())
    text += code(json_quoted(entry.tag) + ": " + json_quoted(table.name)) + ". ";
  text += std::string(table.doc);
  if (table.alternatives) text += alternatives_text(*table.alternatives);
  text += "\n\n";
  std::string lines;
  const ChoiceTable* common = nullptr;
  for (const Field& field : table.fields) {
    const auto told = std::find_if(choices.begin(), choices.end(), [&](const ChoiceTable* choice) {
      return is_common(*choice, field);
    });
    if (told == choices.end())
      lines += line_of(field);
    else
      common = *told;
  }
  if (common) text += "And the keys of every " + link_to(common->name) + ".\n\n";
  return lines.empty() ? text : text + std::string(kHeadOfKeys) + lines + "\n";
}

constexpr std::string_view kSynonymsIntroduction =
    "## Names of other programs\n"
    "\n"
    "Words that other programs use are faults here. The message says what they are called in this\n"
    "format.\n"
    "\n";

std::string synonyms_table() {
  std::string text = "| word | name here | what differs |\n|---|---|---|\n";
  for (const Synonym& synonym : synonyms())
    text += "| " + codes(synonym.words) + " | " + codes(synonym.names) + " | " +
            std::string(synonym.note) + " |\n";
  return text;
}

}  // namespace

std::vector<TaggedTable> all_tables() { return walk_format().tables; }

std::vector<const ChoiceTable*> all_choices() { return walk_format().choices; }

std::string scenario_reference_markdown() {
  const Walk walk = walk_format();
  std::string text(kIntroduction);
  std::vector<const ChoiceTable*> told;
  for (const TaggedTable& table : walk.tables) {
    std::vector<const ChoiceTable*> choices;
    for (const ChoiceTable* choice : walk.choices)
      if (holds(*choice, *table.table)) choices.push_back(choice);
    for (const ChoiceTable* choice : choices) {
      if (std::find(told.begin(), told.end(), choice) != told.end()) continue;
      told.push_back(choice);
      text += section_of(*choice);
    }
    text += section_of(table, choices);
  }
  return text + std::string(kSynonymsIntroduction) + synonyms_table();
}

}  // namespace soda::scenarios
