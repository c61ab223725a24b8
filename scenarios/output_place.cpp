#include "scenarios/output_place.hpp"

#include <algorithm>
#include <filesystem>

#include "scenarios/json_tree.hpp"

namespace soda::scenarios {
namespace {

namespace fs = std::filesystem;

bool leads_up(const fs::path& path) {
  return std::any_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

// Through links. What cannot be looked up is told when the file is made.
bool lies_below(const fs::path& folder, const fs::path& inner) {
  std::error_code error;
  const fs::path root = fs::weakly_canonical(folder, error);
  if (error) return true;
  const fs::path place = fs::weakly_canonical(folder / inner, error);
  if (error) return true;
  return std::mismatch(root.begin(), root.end(), place.begin(), place.end()).first == root.end();
}

}  // namespace

std::string log_place(const OutputSpec& output, const std::string& folder, FaultList& faults) {
  if (!output.log || output.log->empty()) return "";
  const fs::path log(*output.log);
  std::string wrong;
  if (output.log->find('\0') != std::string::npos)
    wrong = "a zero byte";
  else if (log.is_absolute())
    wrong = "an absolute path";
  else if (leads_up(log))
    wrong = "a path with ..";
  else if (!log.has_filename())
    wrong = "no file's name";
  else if (!lies_below(folder.empty() ? "." : folder, log.parent_path()))
    wrong = "a path that a link leads out of the folder";
  if (wrong.empty()) return folder + *output.log;
  add_fault(faults, *find_member(*output.json, "log"),
            {wrong + ", " + json_quoted(printable(*output.log)),
             "a file below the folder of the scenario", "--log of soda run may name any other"});
  return "";
}

}  // namespace soda::scenarios
