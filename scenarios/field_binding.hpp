// Making table entries from pointers to members: what a field takes follows from its C++ type.
#pragma once

#include <concepts>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

#include "scenarios/document.hpp"
#include "scenarios/field_table.hpp"

namespace soda::scenarios {

// The names of an enumeration in the format, in the order of its values from 0.
template <class E>
inline constexpr std::array<std::string_view, 0> kNamesOf{};

// Reading of single values; false (and a fault) if the value is not what the field takes.
bool read_value(const Field& field, const JsonValue& value, double& out, FaultList& faults);
bool read_value(const Field& field, const JsonValue& value, std::int64_t& out, FaultList& faults);
bool read_value(const Field& field, const JsonValue& value, bool& out, FaultList& faults);
bool read_value(const Field& field, const JsonValue& value, std::string& out, FaultList& faults);
bool read_value(const Field& field, const JsonValue& value, Vec3& out, FaultList& faults);
bool read_value(const Field& field, const JsonValue& value, IntVec3& out, FaultList& faults);
bool read_list_start(const Field& field, const JsonValue& value, FaultList& faults);
// Index into field.names, or false.
bool read_name(const Field& field, const JsonValue& value, std::size_t& out, FaultList& faults);

// JSON text of defaults.
std::string json_text(double value);
std::string json_text(std::int64_t value);
std::string json_text(bool value);
std::string json_text(const std::string& value);
std::string json_text(const Vec3& value);
std::string json_text(const IntVec3& value);

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};
template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};
template <class T>
struct IsVariant : std::false_type {};
template <class... T>
struct IsVariant<std::variant<T...>> : std::true_type {};

template <class V>
constexpr ValueKind kind_of() {
  if constexpr (IsOptional<V>::value)
    return kind_of<typename V::value_type>();
  else if constexpr (std::same_as<V, double>)
    return ValueKind::kNumber;
  else if constexpr (std::same_as<V, std::int64_t>)
    return ValueKind::kInteger;
  else if constexpr (std::same_as<V, bool>)
    return ValueKind::kBoolean;
  else if constexpr (std::same_as<V, std::string>)
    return ValueKind::kText;
  else if constexpr (std::same_as<V, Vec3>)
    return ValueKind::kVector;
  else if constexpr (std::same_as<V, IntVec3>)
    return ValueKind::kIntVector;
  else if constexpr (std::same_as<V, std::vector<Vec3>>)
    return ValueKind::kVectorList;
  else if constexpr (std::same_as<V, std::vector<IntVec3>>)
    return ValueKind::kIntVectorList;
  else if constexpr (std::is_enum_v<V>)
    return ValueKind::kName;
  else if constexpr (IsVector<V>::value)
    return IsVariant<typename V::value_type>::value ? ValueKind::kChoiceList
                                                    : ValueKind::kObjectList;
  else
    return IsVariant<V>::value ? ValueKind::kChoice : ValueKind::kObject;
}

template <class V>
void read_member(const Field& field, const JsonValue& value, V& out, FaultList& faults) {
  if constexpr (IsOptional<V>::value) {
    typename V::value_type inner{};
    if (read_value(field, value, inner, faults)) out = std::move(inner);
  } else if constexpr (std::is_enum_v<V>) {
    std::size_t index = 0;
    if (read_name(field, value, index, faults)) out = static_cast<V>(index);
  } else if constexpr (IsVector<V>::value) {
    if (!read_list_start(field, value, faults)) return;
    out.resize(value.children);
    std::size_t i = 0;
    for (const JsonValue* item = value.first_child; item; item = item->next_sibling, ++i) {
      read_member(field, *item, out[i], faults);
    }
  } else if constexpr (IsVariant<V>::value) {
    read_choice(*field.choice, value, &out, faults);
  } else if constexpr (std::derived_from<V, Located>) {
    read_object(*field.object, value, &out, faults);
  } else {
    read_value(field, value, out, faults);
  }
}

template <class T, class V>
V member_type(V T::*);

// The entry of T's member M. `T` may inherit the member.
template <class T, auto M>
constexpr Field field(std::string_view key, bool required, Limits limits, std::string_view doc) {
  using V = decltype(member_type(M));
  Field f;
  f.key = key;
  f.kind = kind_of<V>();
  f.required = required;
  f.limits = limits;
  f.doc = doc;
  f.read = [](const Field& self, const JsonValue& value, void* owner, FaultList& faults) {
    read_member(self, value, static_cast<T*>(owner)->*M, faults);
  };
  if constexpr (std::is_enum_v<V>) {
    f.names = kNamesOf<V>;
    f.fallback = [] { return json_text(std::string(kNamesOf<V>[std::size_t(T{}.*M)])); };
  } else if constexpr (requires(const V& v) { json_text(v); }) {
    f.fallback = [] { return json_text(T{}.*M); };
  }
  if (required) f.fallback = nullptr;
  return f;
}

template <class T, auto M>
constexpr Field object_field(std::string_view key, bool required, Limits limits,
                             const ObjectTable& table, std::string_view doc) {
  Field f = field<T, M>(key, required, limits, doc);
  f.object = &table;
  return f;
}

template <class T, auto M>
constexpr Field choice_field(std::string_view key, bool required, Limits limits,
                             const ChoiceTable& table, std::string_view doc) {
  Field f = field<T, M>(key, required, limits, doc);
  f.choice = &table;
  return f;
}

template <class T>
constexpr ObjectTable object_table(std::string_view name, std::string_view doc,
                                   std::span<const Field> fields,
                                   const Alternatives* alternatives = nullptr) {
  return {.name = name,
          .doc = doc,
          .fields = fields,
          .alternatives = alternatives,
          .located = [](void* object) -> Located* { return static_cast<T*>(object); }};
}

template <class Variant, class T>
constexpr ChoiceEntry choice_entry(std::string_view name, const ObjectTable& table) {
  return {.name = name, .table = &table, .emplace = [](void* variant) -> void* {
            return &static_cast<Variant*>(variant)->template emplace<T>();
          }};
}

}  // namespace soda::scenarios
