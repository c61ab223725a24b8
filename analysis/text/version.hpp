// The version of this program.
#pragma once

namespace soda::analysis {

inline constexpr const char* kVersion = SODA_VERSION;  // from CMake's project()

}  // namespace soda::analysis
