// How a whole scene is run: an executor with its options, as on a command line.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/whole/scene_parts.hpp"

namespace soda::analysis {

// kDefault: as the file says, without any option.
enum class RunExecutor { kDefault, kSequential, kThreads, kMpi, kVirtual, kCount };
inline constexpr std::size_t kRunExecutors = static_cast<std::size_t>(RunExecutor::kCount);
const char* name_of(RunExecutor executor);
// Of a list of these names. Throws UsageError.
std::vector<RunExecutor> parse_executors(const std::vector<std::string>& names);

using Option = std::vector<std::string>;  // with its values

struct WholeRun {
  RunExecutor executor = RunExecutor::kDefault;
  unsigned ranks = 1;           // kMpi
  std::vector<Option> options;  // of soda run
  bool logged = false;          // then replayed
  std::vector<Option> replay_options;
};

// A function of the seed and the list. Scheduling seed 0, which users get, in four of five.
WholeRun draw_run(std::uint64_t seed, const WholeScene& scene,
                  const std::vector<RunExecutor>& executors);

// The command that runs `file`; a log goes to `log`.
std::vector<std::string> run_command_of(const WholeRun& run, const std::string& program,
                                        const std::string& file, const std::string& log);
std::vector<std::string> replay_command_of(const WholeRun& run, const std::string& program,
                                           const std::string& log);

}  // namespace soda::analysis
