// The page of `soda view`.
#pragma once

#include <optional>
#include <string>

#include "analysis/viewer/recording.hpp"
#include "analysis/viewer/timeline.hpp"

namespace soda::analysis {

// One HTML file without anything from outside; it needs a browser with WebGL 2. What it does stands
// in viewer/*.js. Without a timeline it says how to get one.
std::string view_page(const Recording& recording, const std::optional<Timeline>& timeline);

}  // namespace soda::analysis
