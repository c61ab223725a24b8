#include <algorithm>

#include "scenarios/field_binding.hpp"
#include "scenarios/synonyms.hpp"

namespace soda::scenarios {
namespace {

bool fail(FaultList& faults, const JsonValue& at, std::string allowed, std::string hint = "") {
  if (hint.empty()) hint = value_hint(at.key, at);
  add_fault(faults, at, {describe(at), std::move(allowed), std::move(hint)});
  return false;
}

std::string range_text(const Field& field, bool integer) {
  const auto text = [&](double x) {
    return integer ? std::to_string(static_cast<std::int64_t>(x)) : number_text(x);
  };
  if (field.limits.min == field.limits.max) return " " + text(field.limits.min);
  return " from " + text(field.limits.min) + " to " + text(field.limits.max);
}

std::string with_unit(const std::string& text, const Field& field) {
  const std::string_view unit = unit_of(field.key);
  return unit.empty() ? text : text + " " + std::string(unit);
}

bool read_number(const Field& field, const JsonValue& value, double& out) {
  const bool number = value.kind == JsonKind::kNumber || value.kind == JsonKind::kInteger;
  if (!number || !(value.number >= field.limits.min && value.number <= field.limits.max)) {
    return false;
  }
  out = value.number;
  return true;
}

bool read_integer(const Field& field, const JsonValue& value, std::int64_t& out) {
  if (value.kind != JsonKind::kInteger || value.number < field.limits.min ||
      value.number > field.limits.max) {
    return false;
  }
  out = value.integer;
  return true;
}

std::string number_text_of(const Field& field) {
  return with_unit("a number" + range_text(field, false), field);
}
std::string integer_text_of(const Field& field) {
  return with_unit("an integer" + range_text(field, true), field);
}

// Three numbers: `read` takes one component.
template <class Components, class Read>
bool read_three(const Field& field, const JsonValue& value, Components& out, FaultList& faults,
                const std::string& each, Read read) {
  if (value.kind != JsonKind::kArray || value.children != 3) {
    return fail(faults, value, "an array of three values, each " + each);
  }
  bool good = true;
  std::size_t i = 0;
  for (const JsonValue* item = value.first_child; item; item = item->next_sibling, ++i) {
    if (!read(field, *item, out[i])) good = fail(faults, *item, each);
  }
  return good;
}

struct Seen {
  std::vector<bool> key;
  bool operator()(const ObjectTable& table, std::string_view name) const {
    for (std::size_t i = 0; i < table.fields.size(); ++i) {
      if (table.fields[i].key == name) return key[i];
    }
    return false;
  }
};

std::string join(std::span<const std::string_view> keys) {
  std::string text;
  for (const std::string_view key : keys) {
    if (!text.empty()) text += " and ";
    text += key;
  }
  return text;
}

void check_alternatives(const ObjectTable& table, const JsonValue& value, const Seen& seen,
                        FaultList& faults) {
  if (!table.alternatives) return;
  if (!table.alternatives->unless.empty() && seen(table, table.alternatives->unless)) return;
  std::vector<std::string_view> there;
  bool whole[2] = {true, true}, any[2] = {false, false};
  const std::span<const std::string_view> sets[2] = {table.alternatives->first,
                                                     table.alternatives->second};
  for (int s = 0; s < 2; ++s) {
    for (const std::string_view key : sets[s]) {
      if (seen(table, key)) {
        any[s] = true;
        there.push_back(key);
      } else {
        whole[s] = false;
      }
    }
  }
  if ((whole[0] && !any[1]) || (whole[1] && !any[0])) return;
  const std::string found =
      there.empty() ? "neither " + join(sets[0]) + " nor " + join(sets[1]) : join(there);
  add_fault(faults, value, {found, "either " + join(sets[0]) + " or " + join(sets[1]), ""});
}

const ChoiceEntry* entry_by_keys(const ChoiceTable& table, const JsonValue& value) {
  for (const ChoiceEntry& entry : table.entries) {
    for (const Field& field : entry.table->fields) {
      if (find_member(value, field.key)) return &entry;
    }
  }
  return nullptr;
}

std::vector<std::string_view> names_of(const ChoiceTable& table) {
  std::vector<std::string_view> names;
  for (const ChoiceEntry& entry : table.entries) names.push_back(entry.name);
  return names;
}

// The entry that the tag names, or null and a fault.
const ChoiceEntry* entry_by_tag(const ChoiceTable& table, const JsonValue& value,
                                FaultList& faults) {
  const std::vector<std::string_view> names = names_of(table);
  const std::string allowed = "one of " + list_names(names);
  const JsonValue* tag = find_member(value, table.tag);
  if (!tag) {
    add_fault(faults, value, {"no key " + json_quoted(table.tag), allowed + " under it", ""});
    return nullptr;
  }
  if (tag->kind == JsonKind::kString) {
    for (const ChoiceEntry& entry : table.entries) {
      if (entry.name == tag->text) return &entry;
    }
    fail(faults, *tag, allowed, name_hint(tag->text, names, table.elsewhere, table.elsewhere_hint));
    return nullptr;
  }
  fail(faults, *tag, allowed);
  return nullptr;
}

void read_members(const ObjectTable& table, std::string_view tag, const JsonValue& value,
                  void* object, FaultList& faults) {
  const std::size_t faults_before = faults.size();
  Seen seen{std::vector<bool>(table.fields.size(), false)};
  std::vector<std::string_view> keys;
  for (const Field& field : table.fields) keys.push_back(field.key);
  if (!tag.empty()) keys.push_back(tag);
  for (const JsonValue* m = value.first_child; m; m = m->next_sibling) {
    if (!tag.empty() && m->key == tag) continue;
    const auto at = std::find(keys.begin(), keys.end(), m->key);
    if (at == keys.end()) {
      add_fault_at_key(faults, *m,
                       {"the unknown key " + json_quoted(printable(m->key)),
                        "the keys " + list_names(keys), name_hint(m->key, keys)});
      continue;
    }
    const std::size_t i = static_cast<std::size_t>(at - keys.begin());
    if (seen.key[i]) continue;  // the parser has reported it
    seen.key[i] = true;
    table.fields[i].read(table.fields[i], *m, object, faults);
  }
  for (std::size_t i = 0; i < table.fields.size(); ++i) {
    if (!table.fields[i].required || seen.key[i]) continue;
    add_fault(faults, value,
              {"no key " + json_quoted(table.fields[i].key),
               allowed_text(table.fields[i]) + " under it", ""});
  }
  check_alternatives(table, value, seen, faults);
  Located* located = table.located(object);
  located->json = &value;
  located->sound = faults.size() == faults_before && faults.size() < kMaxFaults;
}

}  // namespace

void read_object(const ObjectTable& table, const JsonValue& value, void* object,
                 FaultList& faults) {
  table.located(object)->json = &value;
  if (value.kind != JsonKind::kObject) {
    fail(faults, value, "an object (" + std::string(table.name) + ")");
    return;
  }
  read_members(table, "", value, object, faults);
}

void read_choice(const ChoiceTable& table, const JsonValue& value, void* variant,
                 FaultList& faults) {
  if (value.kind != JsonKind::kObject) {
    fail(faults, value, "an object (" + std::string(table.name) + ")");
    return;
  }
  const ChoiceEntry* entry =
      table.tag.empty() ? entry_by_keys(table, value) : entry_by_tag(table, value, faults);
  if (!entry && !table.tag.empty()) return;
  if (!entry) entry = &table.entries.front();
  read_members(*entry->table, table.tag, value, entry->emplace(variant), faults);
}

std::string allowed_text(const Field& field) {
  const std::string count = " (" + std::to_string(field.limits.min_items) + " to " +
                            std::to_string(field.limits.max_items) + ")";
  switch (field.kind) {
    case ValueKind::kNumber:
      return number_text_of(field);
    case ValueKind::kInteger:
      return integer_text_of(field);
    case ValueKind::kBoolean:
      return "true or false";
    case ValueKind::kText:
      return "a string of " + std::to_string(field.limits.min_items) + " to " +
             std::to_string(field.limits.max_items) + " characters";
    case ValueKind::kName:
      return "one of " + list_names(field.names);
    case ValueKind::kVector:
      return "three numbers, each " + number_text_of(field);
    case ValueKind::kIntVector:
      return "three integers, each " + integer_text_of(field);
    case ValueKind::kVectorList:
      return "an array" + count + " of three numbers";
    case ValueKind::kIntVectorList:
      return "an array" + count + " of three integers";
    case ValueKind::kObject:
      return "an object (" + std::string(field.object->name) + ")";
    case ValueKind::kObjectList:
      return "an array" + count + " of objects (" + std::string(field.object->name) + ")";
    case ValueKind::kChoice:
      return "an object (" + std::string(field.choice->name) + ")";
    case ValueKind::kChoiceList:
      return "an array" + count + " of objects (" + std::string(field.choice->name) + ")";
  }
  return "";
}

std::string_view unit_of(std::string_view key) {
  static constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"stiffness_newton_m", "N/m"},
      {"damping_newton_s_m", "N s/m"},
      {"_newton_m", "N m"},
      {"_newton", "N"},
      {"_1_s", "1/s"},
      {"_newton_s", "N s"},
      {"_kg_m3", "kg/m^3"},
      {"_kg_m2", "kg m^2"},
      {"_m_s2", "m/s^2"},
      {"_rad_s", "rad/s"},
      {"_m_s", "m/s"},
      {"_deg", "degrees"},
      {"_rad", "rad"},
      {"_kg", "kg"},
      {"_m", "m"},
      {"_ms", "ms"},
      {"_s", "s"}};
  for (const auto& [ending, unit] : kUnits) {
    if (key.ends_with(ending)) return unit;
  }
  return "";
}

bool read_value(const Field& field, const JsonValue& value, double& out, FaultList& faults) {
  return read_number(field, value, out) || fail(faults, value, number_text_of(field));
}

bool read_value(const Field& field, const JsonValue& value, std::int64_t& out, FaultList& faults) {
  return read_integer(field, value, out) || fail(faults, value, integer_text_of(field));
}

bool read_value(const Field& field, const JsonValue& value, bool& out, FaultList& faults) {
  if (value.kind != JsonKind::kBoolean) return fail(faults, value, allowed_text(field));
  out = value.boolean;
  return true;
}

bool read_value(const Field& field, const JsonValue& value, std::string& out, FaultList& faults) {
  const auto characters = static_cast<std::size_t>(std::count_if(
      value.text.begin(), value.text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  if (value.kind != JsonKind::kString || characters < field.limits.min_items ||
      characters > field.limits.max_items) {
    return fail(faults, value, allowed_text(field));
  }
  out = value.text;
  return true;
}

bool read_value(const Field& field, const JsonValue& value, Vec3& out, FaultList& faults) {
  return read_three(field, value, out, faults, number_text_of(field), read_number);
}

bool read_value(const Field& field, const JsonValue& value, IntVec3& out, FaultList& faults) {
  return read_three(field, value, out, faults, integer_text_of(field), read_integer);
}

bool read_list_start(const Field& field, const JsonValue& value, FaultList& faults) {
  if (value.kind != JsonKind::kArray || value.children < field.limits.min_items ||
      value.children > field.limits.max_items) {
    return fail(faults, value, allowed_text(field));
  }
  return true;
}

bool read_name(const Field& field, const JsonValue& value, std::size_t& out, FaultList& faults) {
  if (value.kind == JsonKind::kString) {
    const auto at = std::find(field.names.begin(), field.names.end(), value.text);
    out = static_cast<std::size_t>(at - field.names.begin());
    if (at != field.names.end()) return true;
    return fail(faults, value, allowed_text(field), name_hint(value.text, field.names));
  }
  return fail(faults, value, allowed_text(field));
}

std::string json_text(double value) { return number_text(value); }
std::string json_text(std::int64_t value) { return std::to_string(value); }
std::string json_text(bool value) { return value ? "true" : "false"; }
std::string json_text(const std::string& value) { return json_quoted(value); }

std::string json_text(const Vec3& value) {
  return "[" + number_text(value.x()) + ", " + number_text(value.y()) + ", " +
         number_text(value.z()) + "]";
}

std::string json_text(const IntVec3& value) {
  return "[" + std::to_string(value[0]) + ", " + std::to_string(value[1]) + ", " +
         std::to_string(value[2]) + "]";
}

}  // namespace soda::scenarios
