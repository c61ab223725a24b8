#include "analysis/process/installed.hpp"

#include <filesystem>

namespace soda::analysis {
namespace {

namespace fs = std::filesystem;

fs::path folder_of_program() { return fs::read_symlink("/proc/self/exe").parent_path(); }

// An installed program is somewhere else, and knows nothing of sources.
bool is_in_build_tree() {
  std::error_code error;
  return fs::equivalent(folder_of_program(), SODA_BUILD_FOLDER, error);
}

}  // namespace

std::string module_file(const std::string& name) {
  const fs::path beside = folder_of_program() / name;
  const fs::path installed = (folder_of_program() / SODA_TO_MODULES / name).lexically_normal();
  return fs::exists(installed) && !fs::exists(beside) ? installed : beside;
}

std::string installed(const std::string& path) {
  std::error_code error;
  if (path.empty() || fs::path(path).is_absolute() || fs::exists(path, error)) return path;
  const fs::path there = (folder_of_program() / SODA_TO_DATA / path).lexically_normal();
  if (fs::exists(there, error)) return there.string();
  const fs::path in_sources = fs::path(SODA_SOURCE_FOLDER) / path;
  return is_in_build_tree() && fs::exists(in_sources, error) ? in_sources.string() : path;
}

}  // namespace soda::analysis
