#include "scenarios/printable.hpp"

#include <algorithm>
#include <cstdio>

namespace soda::scenarios {
namespace {

unsigned byte_at(std::string_view text, std::size_t at) {
  return static_cast<unsigned char>(text[at]);
}

// The code of a control character at the begin of a sequence of this length, or 0x100.
unsigned control_code(std::string_view text, std::size_t at, std::size_t length) {
  constexpr unsigned kNone = 0x100;
  const unsigned byte = byte_at(text, at);
  if (length == 1)
    return (byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7f ? byte : kNone;
  const bool is_c1 = length == 2 && byte == 0xc2 && byte_at(text, at + 1) < 0xa0;
  return is_c1 ? byte_at(text, at + 1) : kNone;
}

void append(std::string& out, const char* format, unsigned code) {
  char buffer[8];
  std::snprintf(buffer, sizeof buffer, format, code);
  out += buffer;
}

}  // namespace

std::size_t utf8_length(std::string_view text, std::size_t at) {
  const unsigned lead = byte_at(text, at);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xc2 && lead < 0xe0   ? 2
                             : lead >= 0xe0 && lead < 0xf0 ? 3
                             : lead >= 0xf0 && lead < 0xf5 ? 4
                                                           : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte_at(text, at + i) & 0xc0) != 0x80) return 0;
  // Too long for its code, a surrogate, or beyond the last code.
  const unsigned second = byte_at(text, at + 1);
  const bool is_wrong = (lead == 0xe0 && second < 0xa0) || (lead == 0xed && second >= 0xa0) ||
                        (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second >= 0x90);
  return is_wrong ? 0 : length;
}

std::string printable_text(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  const auto is_plain = [](char c) { return (c >= 0x20 && c < 0x7f) || c == '\n' || c == '\t'; };
  for (std::size_t at = 0; at < text.size();) {
    const auto begin = text.begin() + static_cast<std::ptrdiff_t>(at);
    const auto plain = std::find_if_not(begin, text.end(), is_plain) - begin;
    out.append(begin, begin + plain);
    at += static_cast<std::size_t>(plain);
    if (at == text.size()) break;
    const std::size_t length = utf8_length(text, at);
    if (length == 0) {
      append(out, "\\x%02X", byte_at(text, at++));
      continue;
    }
    const unsigned control = control_code(text, at, length);
    if (control < 0x100)
      append(out, "\\u%04x", control);
    else
      out += text.substr(at, length);
    at += length;
  }
  return out;
}

}  // namespace soda::scenarios
