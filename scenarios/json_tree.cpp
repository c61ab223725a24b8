#include "scenarios/json_tree.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "scenarios/printable.hpp"

namespace soda::scenarios {
namespace {

constexpr std::size_t kLongestQuote = 60;

}  // namespace

const JsonValue* find_member(const JsonValue& object, std::string_view key) {
  for (const JsonValue* child = object.first_child; child; child = child->next_sibling) {
    if (child->key == key) return child;
  }
  return nullptr;
}

std::string pointer_to(const JsonValue& value) {
  std::vector<const JsonValue*> path;
  for (const JsonValue* v = &value; v->parent; v = v->parent) path.push_back(v);
  std::reverse(path.begin(), path.end());
  std::string pointer;
  for (const JsonValue* step : path) {
    pointer += '/';
    if (step->parent->kind == JsonKind::kArray) {
      pointer += std::to_string(step->index);
      continue;
    }
    for (const char c : printable(step->key)) {
      if (c == '~')
        pointer += "~0";
      else if (c == '/')
        pointer += "~1";
      else
        pointer += c;
    }
  }
  return pointer;
}

std::string printable(std::string_view text) {
  // Line breaks and tabs are harmless on a terminal, but not in the middle of a message.
  std::size_t end = 0;
  while (end < text.size() && end < kLongestQuote)
    end += std::max<std::size_t>(1, utf8_length(text, end));
  std::string out;
  for (const char c : printable_text(text.substr(0, end))) {
    if (c == '\n')
      out += "\\u000a";
    else if (c == '\t')
      out += "\\u0009";
    else
      out += c;
  }
  return end < text.size() ? out + "..." : out;
}

std::string json_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char buffer[8];
      std::snprintf(buffer, sizeof buffer, "\\u%04x", static_cast<unsigned>(c));
      out += buffer;
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string describe(const JsonValue& value) {
  const auto counted = [&](const char* what, const char* item) {
    return std::string(what) + std::to_string(value.children) + item +
           (value.children == 1 ? "" : "s");
  };
  switch (value.kind) {
    case JsonKind::kArray:
      return counted("an array of ", " value");
    case JsonKind::kObject:
      return counted("an object with ", " key");
    case JsonKind::kString:
      return "the string " + printable(value.token);
    default:
      return printable(value.token);
  }
}

}  // namespace soda::scenarios
