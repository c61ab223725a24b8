#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scenarios/format.hpp"
#include "scenarios/read_scenario.hpp"
#include "scenarios/reference.hpp"

namespace soda::scenarios {
namespace {

struct Member;
using Members = std::vector<Member>;

// A piece of JSON to be printed: a literal, an object or an array.
struct Json {
  enum class Kind { kLiteral, kObject, kArray };
  Kind kind = Kind::kLiteral;
  std::string literal;
  Members members;  // keys of array items are empty
};

struct Member {
  std::string key;
  Json value;

  Member(std::string_view its_key, Json its_value) : key(its_key), value(std::move(its_value)) {}
};

Json literal(std::string text) {
  return {.kind = Json::Kind::kLiteral, .literal = std::move(text), .members = {}};
}
Json text(std::string_view s) { return literal(json_quoted(s)); }
Json object(Members members) { return {Json::Kind::kObject, "", std::move(members)}; }
Json array(std::vector<Json> items) {
  Json result{.kind = Json::Kind::kArray, .literal = {}, .members = {}};
  for (Json& item : items) result.members.emplace_back("", std::move(item));
  return result;
}
Json texts(std::span<const std::string_view> names) {
  std::vector<Json> items;
  for (const std::string_view name : names) items.push_back(text(name));
  return array(std::move(items));
}
Json reference_to(std::string_view name) {
  return object({{"$ref", text("#/definitions/" + std::string(name))}});
}

std::string on_one_line(const Json& json) {
  if (json.kind == Json::Kind::kLiteral) return json.literal;
  const bool is_object = json.kind == Json::Kind::kObject;
  std::string out = is_object ? "{" : "[";
  for (const auto& [key, member] : json.members) {
    if (out.size() > 1) out += ", ";
    if (is_object) out += json_quoted(key) + ": ";
    out += on_one_line(member);
  }
  return out + (is_object ? "}" : "]");
}

void print(const Json& json, std::size_t indent, std::size_t used, std::string& out) {
  const std::string line = on_one_line(json);
  if (json.kind == Json::Kind::kLiteral || indent + used + line.size() <= 96) {
    out += line;
    return;
  }
  const bool is_object = json.kind == Json::Kind::kObject;
  out += is_object ? "{" : "[";
  bool first = true;
  for (const auto& [key, member] : json.members) {
    out += first ? "\n" : ",\n";
    first = false;
    out.append(indent + 2, ' ');
    const std::string name = is_object ? json_quoted(key) + ": " : "";
    out += name;
    print(member, indent + 2, name.size(), out);
  }
  out += "\n";
  out.append(indent, ' ');
  out += is_object ? "}" : "]";
}

Members number_range(const Field& field, bool integer) {
  const auto bound = [&](double x) {
    return literal(integer ? std::to_string(static_cast<std::int64_t>(x)) : number_text(x));
  };
  return {{"type", text(integer ? "integer" : "number")},
          {"minimum", bound(field.limits.min)},
          {"maximum", bound(field.limits.max)}};
}

Json array_of(Json items, std::size_t least, std::size_t most) {
  return object({{"type", text("array")},
                 {"items", std::move(items)},
                 {"minItems", literal(std::to_string(least))},
                 {"maxItems", literal(std::to_string(most))}});
}

// What the field's value must be.
Json value_schema(const Field& field) {
  const Limits& limits = field.limits;
  const auto list = [&](Json items) {
    return array_of(std::move(items), limits.min_items, limits.max_items);
  };
  const auto three = [&](bool integer) {
    return array_of(object(number_range(field, integer)), 3, 3);
  };
  switch (field.kind) {
    case ValueKind::kNumber:
      return object(number_range(field, false));
    case ValueKind::kInteger:
      return object(number_range(field, true));
    case ValueKind::kBoolean:
      return object({{"type", text("boolean")}});
    case ValueKind::kText:
      return object({{"type", text("string")},
                     {"minLength", literal(std::to_string(limits.min_items))},
                     {"maxLength", literal(std::to_string(limits.max_items))}});
    case ValueKind::kName:
      return object({{"type", text("string")}, {"enum", texts(field.names)}});
    case ValueKind::kVector:
      return three(false);
    case ValueKind::kIntVector:
      return three(true);
    case ValueKind::kVectorList:
      return list(three(false));
    case ValueKind::kIntVectorList:
      return list(three(true));
    case ValueKind::kObject:
      return reference_to(field.object->name);
    case ValueKind::kObjectList:
      return list(reference_to(field.object->name));
    case ValueKind::kChoice:
      return reference_to(field.choice->name);
    case ValueKind::kChoiceList:
      return list(reference_to(field.choice->name));
  }
  return object({});
}

Json described_value(const Field& field) {
  const std::string_view unit = unit_of(field.key);
  std::string description(field.doc);
  if (!unit.empty()) description += " Unit: " + std::string(unit) + ".";
  Json value = value_schema(field);
  value.members.emplace_back("description", text(description));
  if (field.fallback) value.members.emplace_back("default", literal(field.fallback()));
  return value;
}

// All keys of one set are there and none of the other.
Json one_alternative(std::span<const std::string_view> here,
                     std::span<const std::string_view> not_here) {
  std::vector<Json> others;
  for (const std::string_view& key : not_here) {
    others.push_back(object({{"required", texts({&key, 1})}}));
  }
  return object(
      {{"required", texts(here)}, {"not", object({{"anyOf", array(std::move(others))}})}});
}

Members object_schema(const TaggedTable& entry) {
  const ObjectTable& table = *entry.table;
  Members properties;
  std::vector<Json> required;
  if (!entry.tag.empty()) {
    properties.emplace_back(entry.tag, object({{"const", text(table.name)}}));
    required.push_back(text(entry.tag));
  }
  for (const Field& field : table.fields) {
    properties.emplace_back(field.key, described_value(field));
    if (field.required) required.push_back(text(field.key));
  }
  Members members{{"type", text("object")},
                  {"description", text(table.doc)},
                  {"properties", object(std::move(properties))},
                  {"required", array(std::move(required))},
                  {"additionalProperties", literal("false")}};
  if (table.alternatives) {
    const auto& [first, second, unless] = *table.alternatives;
    std::vector<Json> ways{one_alternative(first, second), one_alternative(second, first)};
    if (!unless.empty()) ways.push_back(object({{"required", texts({&unless, 1})}}));
    members.emplace_back(unless.empty() ? "oneOf" : "anyOf", array(std::move(ways)));
  }
  return members;
}

Json choice_schema(const ChoiceTable& choice) {
  std::vector<Json> entries;
  for (const ChoiceEntry& entry : choice.entries) {
    entries.push_back(reference_to(entry.table->name));
  }
  return object({{"description", text(choice.doc)}, {"oneOf", array(std::move(entries))}});
}

}  // namespace

std::string scenario_schema() {
  Members definitions;
  for (const ChoiceTable* choice : all_choices()) {
    definitions.emplace_back(choice->name, choice_schema(*choice));
  }
  const std::vector<TaggedTable> tables = all_tables();
  for (std::size_t i = 1; i < tables.size(); ++i) {
    definitions.emplace_back(tables[i].table->name, object(object_schema(tables[i])));
  }
  Members root{{"$schema", text("http://json-schema.org/draft-07/schema#")},
               {"title", text("SODA scenario, format " + std::to_string(kFormatVersion))}};
  for (auto& member : object_schema(tables.front())) root.push_back(std::move(member));
  root.emplace_back("definitions", object(std::move(definitions)));
  std::string out;
  print(object(std::move(root)), 0, 0, out);
  return out + "\n";
}

}  // namespace soda::scenarios
