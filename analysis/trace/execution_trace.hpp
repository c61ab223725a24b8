// The trace of an event log as a story: which executions, late messages and rollbacks there were,
// and what led to what.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/trace/trace_records.hpp"

namespace soda::analysis {

// Places in the vectors of ExecutionTrace.
using ExecutionNumber = std::size_t;
using RollbackNumber = std::size_t;

struct TracedExecution {
  std::uint32_t world = 0, worker = 0;
  kernel::VirtualTime time;
  std::int64_t began_ns = 0, took_ns = 0;
  bool repeats = false;   // only what stood (coasts)
  bool absorbed = false;  // late news counts as executed; nothing was
  bool committed = false;
  std::optional<RollbackNumber> undone_by;  // the last that did, unless it is revalidated
  std::optional<RollbackNumber> again_for;  // what had undone the execution of this time before
};

// A message that came behind what its receiver had executed.
struct LateMessage {
  std::uint32_t from = 0, to = 0;  // worlds; `from` is kExternalSource of a user or a balancer
  kernel::VirtualTime time;
  std::uint32_t kind = 0, slot = 0;
  std::uint64_t version = 0;
  bool anti = false;
  std::int64_t arrived_ns = 0;
  std::vector<std::uint32_t> bodies;  // ids; that it brings, or took away
  bool absorbed = false;
  // Who sent it: an execution; of an anti-message the rollback behind it. Neither from outside.
  std::optional<ExecutionNumber> sent_by;
  std::optional<RollbackNumber> sent_in;
};

struct TracedRollback {
  std::uint32_t world = 0;
  kernel::VirtualTime restart;  // where the world goes on
  kernel::VirtualTime changed;  // what it went back for
  std::int64_t at_ns = 0;
  kernel::Refusal refusal;
  std::vector<std::size_t> late;  // messages for `changed`, which led to it; none: a test did
  std::vector<ExecutionNumber> undone;
  std::size_t put_back = 0;  // of these
};

struct ExecutionTrace {
  std::uint32_t worlds = 0, workers = 0;
  std::vector<TracedExecution> executions;
  std::vector<LateMessage> late;
  std::vector<TracedRollback> rollbacks;  // in the order of at_ns

  // The rollback that led to another: because of it, its cause was sent. None if what was sent
  // late was sent for the first time.
  std::optional<RollbackNumber> led_to(RollbackNumber rollback) const;
  // What a rollback undid that is not revalidated, in ns of the executor's clock.
  std::int64_t wasted_ns(RollbackNumber rollback) const;
};

// Throws as read_records().
ExecutionTrace read_trace(LogReader& log, std::uint32_t worlds);

}  // namespace soda::analysis
