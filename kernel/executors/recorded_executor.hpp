// A run of Time Warp once more, in one thread and in the order in which a trace has it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "kernel/api/event_recorder.hpp"
#include "kernel/api/executor.hpp"

namespace soda::kernel {

// What an executor has done to its LPs; all else follows from it.
struct RecordedAct {
  Happening what{};  // kArrived, kSettled, kExecuted or kGvt
  LpId lp{}, peer{};
  VirtualTime time;
  std::uint64_t incarnation = 0;  // of what arrived
};
// Of each worker, in its order. An LP belongs to the worker whose acts name it.
using RecordedOrder = std::vector<std::vector<RecordedAct>>;

// The LPs do not do what they did, or no run can have had such acts. Names worker, act and times.
class NotAsRecorded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Drives every LP through the acts of `order`: the same messages late, the same rollbacks, event
// for event. Acts of different workers come in any order in which what arrives has been sent.
// Nothing may come from outside. Unless `whole`, `order` is only the beginning of a run: the LPs
// are left as its acts leave them.
RunResult run_as_recorded(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const RecordedOrder& order, const Recording& recording,
                          bool whole = true);

}  // namespace soda::kernel
