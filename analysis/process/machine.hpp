// The machine that a program runs on.
#pragma once

#include <string>

namespace soda::analysis {

// The processor's name, as the system says; "unknown machine" if it does not.
std::string machine_name();

}  // namespace soda::analysis
