// `soda groups`: synchronisation groups, of the paper's scene or of a run.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace soda::analysis {

struct GroupsRequest {
  std::string file;             // of a scenario; empty: the paper's scene
  std::vector<std::string> by;  // overlap, contact, rollbacks, all; empty: overlap, of a file all
  std::vector<std::int64_t> bodies;   // of the paper's scene; empty: 500
  std::vector<std::uint32_t> worlds;  // empty: 12, or those of the file
  std::vector<std::string> maps;      // paper, blocks; empty: both
  std::string seeds = "1..20";
  std::string preset;                 // paper-fig6, paper-fig7 or threshold: bodies, worlds, maps
  std::optional<std::int64_t> steps;  // of a file
  bool check = false;                 // of a preset with known figures: exit 1 if one is off
  bool json = false, csv = false;
  std::string page_file;  // empty: no page
  std::string command;    // as typed, for the page
  bool force = false;     // replaces it if it exists
};

// Returns an exit code. Throws UsageError for options that do not go together, InputError,
// FileError and NumericalFailure as `soda run`, which it uses for a file: on the virtual cluster.
int groups_command(const GroupsRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
