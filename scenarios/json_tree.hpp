// A JSON document as a tree that remembers where everything stood.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <string_view>

namespace soda::scenarios {

enum class JsonKind { kNull, kBoolean, kInteger, kNumber, kString, kArray, kObject };

// A place in a text, 1-based. Columns count characters (UTF-8 code points), tabs as one.
struct TextPlace {
  std::uint32_t line = 0, column = 0;
};

struct JsonValue {
  JsonKind kind = JsonKind::kNull;
  bool boolean = false;
  std::uint32_t index = 0;  // position among the parent's children
  std::uint32_t children = 0;
  TextPlace place;           // of the value's first character
  TextPlace key_place;       // of the key's opening quote; members of objects only
  std::int64_t integer = 0;  // kInteger: the value, saturated to the range of the type
  double number = 0.0;       // kInteger and kNumber, finite
  std::string_view token;    // as written; strings with their quotes; empty for arrays and objects
  std::string_view text;     // kString: decoded
  std::string_view key;      // members of objects only: decoded
  const JsonValue* parent = nullptr;
  const JsonValue* first_child = nullptr;
  const JsonValue* next_sibling = nullptr;
};

// Owns the values. Tokens point into the text that was parsed, which must outlive the tree.
struct JsonTree {
  std::deque<JsonValue> values;  // in the order of their places
  std::set<std::string, std::less<>> keys;
  std::deque<std::string> strings;

  const JsonValue* root() const { return values.empty() ? nullptr : &values.front(); }
};

// The member named `key`, or null; of several the first.
const JsonValue* find_member(const JsonValue& object, std::string_view key);

// JSON pointer (RFC 6901); "" for the root.
std::string pointer_to(const JsonValue& value);

// The value in a few words for a message, printable and short: `"abc"`, `3.7`, `an array of 4`.
std::string describe(const JsonValue& value);

// `text` in printable ASCII and valid UTF-8, cut to about 60 characters.
std::string printable(std::string_view text);

// `text` as a JSON string, with quotes.
std::string json_quoted(std::string_view text);

}  // namespace soda::scenarios
