// A run of Time Warp once more, in one thread and in the order in which a trace has it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "kernel/api/event_recorder.hpp"
#include "kernel/api/executor.hpp"
#include "kernel/api/message.hpp"

namespace soda::kernel {

// What an executor has done to its LPs; all else follows from it.
struct RecordedAct {
  Happening what{};  // kArrived, kSettled, kExecuted or kGvt
  LpId lp{}, peer{};
  VirtualTime time;
  // Of what arrived; kind and slot tell what came from outside.
  std::uint64_t version = 0;
  std::uint32_t kind = 0, slot = 0;
};
struct RecordedOrder {
  // Of each worker, in its order. An LP belongs to the worker whose acts name it.
  std::vector<std::vector<RecordedAct>> workers;
  // Of a run in sequence: messages are there when they are sent, and those from outside from the
  // start, so that none of them arrives.
  bool in_sequence = false;
  bool whole = true;  // else it is only the beginning of a run
};

// The LPs do not do what they did, or no run can have had such acts. Names worker, act and times.
class NotAsRecorded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Drives every LP through the acts of `order`: the same messages late, the same rollbacks, event
// for event. Acts of different workers come in any order in which what arrives has been sent.
// `external_messages`: the messages of the run's ExternalSource. Of an order that is not whole, the
// LPs are left as its acts leave them.
RunResult run_as_recorded(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const RecordedOrder& order, std::span<const Message> external_messages,
                          const Recording& recording);

}  // namespace soda::kernel
