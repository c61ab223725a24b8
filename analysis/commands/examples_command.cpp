#include "analysis/commands/examples_command.hpp"

#include <filesystem>

#include "analysis/process/installed.hpp"
#include "analysis/runs/overrides.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

std::string first_sentence(const std::string& text) {
  for (std::size_t end = text.find('.'); end != std::string::npos; end = text.find('.', end + 1))
    if (end + 1 == text.size() || text[end + 1] == ' ') return text.substr(0, end);
  return text;
}

}  // namespace

std::string scenes_text(const std::string& folder) {
  if (!std::filesystem::is_directory(installed(folder)))
    return "the scenes are in " + folder + " of the sources\n";
  std::string text = "the scenes in " + folder + "\n";
  for (const std::string& file : scenario_files({}, folder)) {
    const scenarios::Scenario scenario = scenarios::read_scenario_file(file);
    text += "  " + std::filesystem::path(file).filename().string() + ": " +
            first_sentence(scenario.description) + "\n";
  }
  return text;
}

}  // namespace soda::analysis
