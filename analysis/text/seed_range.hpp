// The option --seeds of commands that try many of them.
#pragma once

#include <cstdint>
#include <string>

namespace soda::analysis {

struct SeedRange {
  std::uint64_t first = 0, last = 0;  // both are tried
};

// "FIRST..LAST". Throws UsageError.
SeedRange parse_seeds(const std::string& text);

}  // namespace soda::analysis
