// Faults of one process: what a handler says, and what leaves it.
#include <exception>
#include <new>
#include <utility>

#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {

// While coasting, the record of the first time round still stands.
void TimeWarpProcess::note_fault(VirtualTime now, Fault fault) {
  auto& faults = rare().faults;
  if (faults.empty() || faults.back().time < now) faults.push_back({now, std::move(fault)});
}

void TimeWarpProcess::note_failure(VirtualTime now) {
  Fault fault{0, "an exception", std::current_exception()};
  try {
    throw;
  } catch (const std::exception& error) {
    fault.what = error.what();
  } catch (...) {
  }
  note_fault(now, std::move(fault));
  failed_ = true;
}

// What is sent is half noted then: that is beyond repair, other than a handler that ran out of
// memory.
void TimeWarpProcess::end_without_memory() {
  struct NoMemoryForMessages : std::bad_alloc, EndsRun {
    const char* what() const noexcept override { return "no memory for messages"; }
  };
  throw NoMemoryForMessages();
}

std::optional<CommittedFault> TimeWarpProcess::first_fault() const {
  if (!has_fault()) return std::nullopt;
  return CommittedFault{rare_->faults.front().time, id_, rare_->faults.front().fault};
}

}  // namespace soda::kernel
