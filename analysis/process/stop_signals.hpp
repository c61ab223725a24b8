// Ending a run early: by the user's signals, or because it cannot go on.
#pragma once

#include <cstdint>

#include "kernel/api/executor.hpp"

namespace soda::analysis {

// Values of a kernel::StopRequest: the number of a signal, or this.
inline constexpr std::uint32_t kStopForFailure = 1000;

// "SIGINT" or "SIGTERM"; else "a failure".
const char* name_of_stop(std::uint32_t stop);

// While it lives, the first SIGINT or SIGTERM is put into `stop`; another one, .2 s later or more,
// ends the program at once (timeout(1) sends its signal twice). A signal that was ignored stays so.
// Not more than one at a time.
class StopOnSignals {
 public:
  // `stop` must outlive this object.
  explicit StopOnSignals(kernel::StopRequest& stop);
  ~StopOnSignals();
  StopOnSignals(const StopOnSignals&) = delete;
  StopOnSignals& operator=(const StopOnSignals&) = delete;
};

}  // namespace soda::analysis
