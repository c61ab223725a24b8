// What a file may say, but hardly means.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace soda::scenarios {

// One such thing, where it stands.
struct InputWarning {
  std::string kind;                  // by which programs know it: of docs/scenarios.md, "Warnings"
  std::size_t line = 0, column = 0;  // 1-based
  std::string pointer;               // JSON pointer; "" is the document
  std::string found;                 // what stands there, and what comes of it
  std::string likely;                // what was probably meant, or what to do
  std::size_t more = 0;              // others of its kind, which are only counted
};

// A line: "FILE:LINE:COLUMN: POINTER: warning KIND: found F; likely: L; and N more of this kind".
std::string warning_text(const std::string& file, const InputWarning& warning);

}  // namespace soda::scenarios
