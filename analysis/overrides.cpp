#include "analysis/overrides.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "analysis/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

template <class T>
void take(std::optional<T>& target, const std::optional<T>& source) {
  if (source) target = source;
}

void require_at_least(std::int64_t value, std::int64_t smallest, const char* option) {
  if (value >= smallest) return;
  throw UsageError(std::string(option) + ": found " + std::to_string(value) +
                   "; allowed: at least " + std::to_string(smallest));
}

void apply_executor(const Overrides& overrides, models::RunOptions& run) {
  if (overrides.executor) run.executor = *overrides.executor;
  if (!overrides.threads) return;
  require_at_least(*overrides.threads, 1, "--threads");
  if (overrides.executor == models::ExecutorKind::kSequential) {
    if (*overrides.threads == 1) return;
    throw UsageError(
        "--threads: the sequential executor has one thread; allowed: 1, or "
        "--executor threads");
  }
  run.executor = models::ExecutorKind::kThreads;
  run.threads = *overrides.threads;
}

}  // namespace

const char* name_of(models::ExecutorKind executor) {
  return executor == models::ExecutorKind::kSequential ? "sequential" : "threads";
}

Overrides combined(const Overrides& base, const Overrides& over) {
  Overrides result = base;
  // A thread count belongs to its executor: one asked for anew does not inherit the old count.
  if (over.executor) result.threads.reset();
  if (over.threads && !over.executor) result.executor.reset();
  take(result.executor, over.executor);
  take(result.threads, over.threads);
  take(result.worlds, over.worlds);
  take(result.buffer, over.buffer);
  take(result.steps, over.steps);
  take(result.seed, over.seed);
  take(result.scheduling_seed, over.scheduling_seed);
  return result;
}

void apply_overrides(const Overrides& overrides, models::TerritoryOptions& territory,
                     models::RunOptions& run) {
  apply_executor(overrides, run);
  if (overrides.worlds) {
    require_at_least(*overrides.worlds, 1, "--worlds");
    if (*overrides.worlds > territory.grid.cell_count()) {
      throw UsageError("--worlds: found " + std::to_string(*overrides.worlds) +
                       "; allowed: at most the scenario's " +
                       std::to_string(territory.grid.cell_count()) + " cells");
    }
    territory.worlds = *overrides.worlds;
  }
  if (overrides.buffer) {
    require_at_least(*overrides.buffer, 1, "--buffer");
    run.buffer = *overrides.buffer;
  }
  if (overrides.steps) {
    require_at_least(*overrides.steps, 0, "--steps");
    run.steps = *overrides.steps;
  }
  if (overrides.scheduling_seed) run.scheduling_seed = *overrides.scheduling_seed;
}

std::string read_whole_file(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw scenarios::FileError(file + ": cannot be opened: " + std::strerror(errno));
  try {
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  } catch (const std::ios_base::failure&) {  // a directory opens but does not read
    throw scenarios::FileError(file + ": cannot be read: " + std::strerror(errno));
  }
}

scenarios::Scenario load_scenario(const std::string& file, const Overrides& overrides) {
  scenarios::Scenario scenario = scenarios::read_scenario_file(file, overrides.seed);
  apply_overrides(overrides, scenario.territory, scenario.run);
  return scenario;
}

}  // namespace soda::analysis
