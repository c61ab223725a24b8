// One whole scene: the plain loop, the built program, its log, and what differs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/whole/whole_run.hpp"

namespace soda::analysis {

// How a trial failed. kRefused: the scenario reader does not take what was drawn.
enum class WholeFailureKind {
  kNone,
  kRefused,
  kPlainLoop,   // the plain loop itself crashed or did not end
  kCrash,       // ended by a signal
  kHang,        // did not end in a multiple of the plain loop's time
  kExitCode,    // another one than 0, or than 4 where the plain loop has a fault
  kFault,       // another fault than the plain loop's
  kDivergence,  // a step with other bits
  kReplay,      // the log's replay failed
  kSanitizer,
};
const char* name_of(WholeFailureKind kind);

// Sums over trials.
struct WholeSums {
  std::array<std::uint64_t, kRunExecutors> scenes{};  // by executor
  std::uint64_t bodies = 0, steps = 0;
  std::uint64_t events = 0, rolled_back = 0, rollbacks = 0, migrations = 0, replays = 0;
  std::uint64_t runs_with_rollbacks = 0;
  std::uint64_t plain_faults = 0;  // scenes that end with exit code 4 in the plain loop too
  double plain_s = 0.0, program_s = 0.0;
};
void add(const WholeSums& more, WholeSums& sums);

struct WholeTrial {
  std::uint64_t seed = 0;
  WholeScene scene;
  WholeRun run;
};

struct WholeOutcome {
  WholeFailureKind kind = WholeFailureKind::kNone;
  std::string what;         // empty if it did not fail
  std::string plain_fault;  // of the plain loop; empty: none
  std::int64_t steps = 0;   // that the plain loop came to
  WholeSums sums;

  bool failed() const { return kind != WholeFailureKind::kNone; }
};

// Where trials run, and for how long.
struct WholePlace {
  std::string program;                     // soda
  std::string folder;                      // for files that are no longer needed afterwards
  std::uint64_t plain_work = 150'000'000;  // of the plain loop, as of PlainLimits
  // Processor time that any run may take, beside 300 times that of the plain loop; in wall time,
  // eight times as much.
  double patience_s = 20.0;
  std::uint64_t address_bytes = 0;
};

// Runs the trial; the scene is cut to as many steps as the plain loop does within its work.
// Deterministic but for what the executors' threads do. From a program with one thread.
WholeOutcome try_whole(const WholeTrial& trial, const WholePlace& place);

// Writes scene and meshes to `folder`; the name of the scenario file.
std::string write_scene(const WholeScene& scene, const std::string& folder,
                        const std::string& name);

}  // namespace soda::analysis
