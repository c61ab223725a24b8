// "Did you mean ...?" for command lines.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace soda::analysis {

// The known name with the fewest edits (insert, delete, replace, swap of neighbours) from `name`,
// the first of several; empty if even that needs more than a third of the longer name, rounded up.
std::string nearest_name(std::string_view name, std::span<const std::string> known);

}  // namespace soda::analysis
