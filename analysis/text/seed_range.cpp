#include "analysis/text/seed_range.hpp"

#include <algorithm>
#include <charconv>

#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {

SeedRange parse_seeds(const std::string& text) {
  SeedRange range;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, range.first);
  const std::string dots(first.ptr, std::min(first.ptr + 2, end));
  const auto last = dots == ".." ? std::from_chars(first.ptr + 2, end, range.last)
                                 : std::from_chars(end, end, range.last);
  if (first.ec != std::errc{} || last.ec != std::errc{} || last.ptr != end ||
      range.first > range.last)
    throw UsageError("--seeds: found " + text + "; allowed: FIRST..LAST");
  return range;
}

}  // namespace soda::analysis
