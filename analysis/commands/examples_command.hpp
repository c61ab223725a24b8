// What `soda examples` says of the scenes that come with soda.
#pragma once

#include <string>

namespace soda::analysis {

// A line for each scene of a folder: its file, and the first sentence of its description. If the
// folder is not there, nor among installed data, a line that says so. Throws
// scenarios::InputError of a scene.
std::string scenes_text(const std::string& folder);

}  // namespace soda::analysis
