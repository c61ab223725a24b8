// Text that steers no terminal.
#pragma once

#include <string>
#include <string_view>

namespace soda::scenarios {

// Length of the well-formed UTF-8 sequence at `at`: 1 to 4, or 0 if there is none.
std::size_t utf8_length(std::string_view text, std::size_t at);

// `text` with its control characters as \u001b (C0 but line break and tab, DEL, C1), and bytes that
// are no UTF-8 as \xFF. Names and paths hold anything; a terminal takes some of it for commands.
// JSON stays the same JSON, for it holds such characters in strings only, and no such bytes.
std::string printable_text(std::string_view text);

}  // namespace soda::scenarios
