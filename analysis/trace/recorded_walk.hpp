// A trace as a row of happenings that can be walked through in both directions, and where every
// world stands after any of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "analysis/trace/trace_records.hpp"

namespace soda::analysis {

struct WalkedHappening {
  kernel::TraceRecord record;  // without its note
  std::uint32_t worker = 0;
};
// Numbers of happenings as users know them are from 1: `number` of them have happened then.
using RecordedWalk = std::vector<WalkedHappening>;

// In the order of causes (trace_records.hpp). Throws as read_records().
RecordedWalk recorded_walk(LogReader& log, std::uint32_t worlds);
// Of a log without trace: nothing is known to happen but that steps are committed, one by one.
RecordedWalk committed_walk(const LogReader& log);

// Whether it is of a run in sequence. Nothing arrives there, for it is there as soon as it is sent;
// and GVT is what is executed.
bool is_in_sequence(const RecordedWalk& walk);

struct WorldSituation {
  std::optional<kernel::VirtualTime> executed;   // the last that stands: its LVT
  std::optional<kernel::VirtualTime> committed;  // the last
  std::size_t ahead = 0;                         // executions that stand and are not committed
  std::int64_t entries = 0;   // finished steps that are not committed, as its buffer holds them
  std::size_t waiting = 0;    // messages that it has and that are for later
  std::size_t in_flight = 0;  // messages to it that have not arrived
  std::size_t executions = 0, rollbacks = 0;  // so far
};
struct Situation {
  kernel::VirtualTime gvt = kernel::kBeginning;
  std::vector<WorldSituation> worlds;
};
// After the first `number` happenings, of a run that began at `first_step`.
Situation situation_after(const RecordedWalk& walk, std::size_t number, std::uint32_t worlds,
                          std::int64_t first_step = 0);
// GVT then, as the last worker that told of it knew it.
kernel::VirtualTime gvt_after(const RecordedWalk& walk, std::size_t number);

// The last rollback that has begun among the first `number` happenings.
std::optional<RollbackNumber> last_rollback(const RecordedWalk& walk, std::size_t number,
                                            const ExecutionTrace& trace);

// One sentence without its stop: "world 1 executed step 84, pairs".
std::string happening_text(const WalkedHappening& happening);
// "happening 12 of 3456, at 3.4 ms, worker 0: world 1 executed step 84, pairs".
std::string place_text(const RecordedWalk& walk, std::size_t number);
// GVT and a table of the worlds, or of `only` one.
std::string situation_text(const Situation& situation, std::int64_t buffer,
                           const std::optional<std::uint32_t>& only = {});

}  // namespace soda::analysis
