// `soda diff`: what two event logs have in common, and the first thing that they have not.
#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/trace/trace_comparison.hpp"

namespace soda::analysis {

struct DiffRequest {
  std::array<std::string, 2> files;
  bool json = false;
};

// Numbers of doubles from one to the other; nothing if one is not a number. 0 and -0 are 1 apart.
std::optional<std::uint64_t> ulps_between(double a, double b);

struct LogDifference {
  // What was given to the runs and is not the same: program, scenario, meshes, bodies, options.
  struct Setting {
    std::string name;
    std::array<std::string, 2> values;
  };
  // The first step that both hold and that are not the same bit for bit.
  struct Step {
    std::int64_t step = 0;
    std::string what;                   // "inputs", "bodies", or a field of a body
    std::optional<std::uint32_t> body;  // by label
    std::array<double, 2> values{};     // of a field
  };
  std::vector<Setting> settings;
  std::optional<Step> step;
  std::array<std::int64_t, 2> last_steps{};
  std::int64_t equal_steps = 0;  // from step 0 on
  // Of logs that both have a trace of as many worlds from the same step on, the first of each
  // world, earliest first.
  bool compares_events = false;
  std::vector<HistoryDifference> events;
};

// Throws FileError for steps and traces that no soda wrote.
LogDifference difference_of(LogReader& first, LogReader& second);

// kExitCheckFailed unless all steps that both logs hold are the same and neither is damaged; events
// may differ, as the executions of two runs do.
int diff_command(const DiffRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
