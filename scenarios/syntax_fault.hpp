// Wording of syntax faults: what a person sees at the place where the JSON parser gave up.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "scenarios/faults.hpp"

namespace soda::scenarios {

struct SyntaxFault {
  std::size_t offset = 0;  // of the offending word's first byte; text.size() at the end
  FaultText text;
};

// `failed_at`: offset of the byte at which the parser stopped. `parser_message`: what it said, of
// which only the wanted symbol is taken over.
SyntaxFault explain_syntax_fault(std::string_view text, std::size_t failed_at,
                                 const std::string& parser_message);

}  // namespace soda::scenarios
