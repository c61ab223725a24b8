// The page of `soda view`.
#pragma once

#include <string>

#include "analysis/recording.hpp"

namespace soda::analysis {

// One HTML file without anything from outside; it needs a browser with WebGL. What it does stands
// in viewer/viewer.js.
std::string view_page(const Recording& recording);

}  // namespace soda::analysis
