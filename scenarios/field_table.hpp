// Tables that describe the objects of the format. One table per object; the reader, the JSON
// Schema and docs/scenario-format.md all come from it.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "scenarios/faults.hpp"
#include "scenarios/json_tree.hpp"

namespace soda::scenarios {

struct ObjectTable;
struct ChoiceTable;

enum class ValueKind {
  kNumber,
  kInteger,
  kBoolean,
  kText,
  kName,        // one of Field::names
  kVector,      // three numbers
  kIntVector,   // three integers
  kVectorList,  // array of three numbers each
  kIntVectorList,
  kObject,
  kObjectList,
  kChoice,
  kChoiceList,
};

// Closed ranges: of a number, or of each component; and of the length of a text or list.
struct Limits {
  double min = 0.0, max = 0.0;
  std::size_t min_items = 0, max_items = 0;
};

struct Field {
  std::string_view key;
  ValueKind kind{};
  bool required = false;
  Limits limits;
  std::span<const std::string_view> names;
  const ObjectTable* object = nullptr;
  const ChoiceTable* choice = nullptr;
  std::string_view doc;
  // Reads `value` into the owner's member; leaves the member as it is if there is a fault.
  void (*read)(const Field&, const JsonValue& value, void* owner, FaultList&) = nullptr;
  // JSON text of the default; empty if the key may be absent without standing for a value.
  std::string (*fallback)() = nullptr;
};

// Two sets of keys of which exactly one must be there, whole; where `unless` is, cross checks say.
struct Alternatives {
  std::span<const std::string_view> first, second;
  std::string_view unless = {};
};

struct ObjectTable {
  std::string_view name;  // of the definition in the schema
  std::string_view doc;
  std::span<const Field> fields;
  const Alternatives* alternatives = nullptr;
  struct Located* (*located)(void* object) = nullptr;
};

struct ChoiceEntry {
  std::string_view name;
  const ObjectTable* table = nullptr;
  void* (*emplace)(void* variant) = nullptr;  // makes it the active one and returns its address
};

// An object of one of several kinds, told apart by the text under `tag`; without a tag, by its
// keys.
struct ChoiceTable {
  std::string_view name;
  std::string_view doc;
  std::string_view tag;
  std::span<const ChoiceEntry> entries;
  std::span<const std::string_view> elsewhere;  // names known to the format but not allowed here
  std::string_view elsewhere_hint;
};

// Reads an object; unknown, missing and faulty members are faults at their places.
void read_object(const ObjectTable& table, const JsonValue& value, void* object, FaultList& faults);
void read_choice(const ChoiceTable& table, const JsonValue& value, void* variant,
                 FaultList& faults);

// What the field takes, for messages and the reference: "a number from 0 to 1".
std::string allowed_text(const Field& field);

// The unit that the end of a key stands for, e.g. "m/s" for velocity_m_s; empty if none.
std::string_view unit_of(std::string_view key);

}  // namespace soda::scenarios
