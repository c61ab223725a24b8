// A command as one types it.
#pragma once

#include <string>
#include <vector>

namespace soda::analysis {

// A shell reads it as these words: what it would not take as it is stands in quotes.
std::string as_typed(const std::vector<std::string>& words);

}  // namespace soda::analysis
