#include "scenarios/json_tree.hpp"

#include <cstdio>
#include <vector>

namespace soda::scenarios {
namespace {

constexpr std::size_t kLongestQuote = 60;

void append_escape(std::string& out, unsigned char byte) {
  char buffer[8];
  std::snprintf(buffer, sizeof buffer, "\\x%02X", byte);
  out += buffer;
}

// Length of the well-formed UTF-8 sequence of several bytes at `at`, or 0.
std::size_t utf8_sequence(std::string_view text, std::size_t at) {
  const unsigned char lead = static_cast<unsigned char>(text[at]);
  const std::size_t length = lead >= 0xC2 && lead < 0xE0   ? 2
                             : lead >= 0xE0 && lead < 0xF0 ? 3
                             : lead >= 0xF0 && lead < 0xF5 ? 4
                                                           : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((static_cast<unsigned char>(text[at + i]) & 0xC0) != 0x80) return 0;
  }
  // C1 control characters (U+0080 to U+009F) steer terminals.
  const bool control = lead == 0xC2 && static_cast<unsigned char>(text[at + 1]) < 0xA0;
  return control ? 0 : length;
}

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
  std::string pointer;
  for (auto step = path.rbegin(); step != path.rend(); ++step) {
    pointer += '/';
    if ((*step)->parent->kind == JsonKind::kArray) {
      pointer += std::to_string((*step)->index);
      continue;
    }
    for (const char c : printable((*step)->key)) {
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
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (out.size() >= kLongestQuote) return out + "...";
    const unsigned char byte = static_cast<unsigned char>(text[i]);
    if (byte >= 0x20 && byte < 0x7F) {
      out += text[i++];
    } else if (const std::size_t length = byte < 0x80 ? 0 : utf8_sequence(text, i)) {
      out += text.substr(i, length);
      i += length;
    } else {
      append_escape(out, byte);
      ++i;
    }
  }
  return out;
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
