// What of a step differs from the recorded one, and how far that is from where it began.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "analysis/event_log/log_format.hpp"

namespace soda::analysis {

struct StepDifference {
  std::int64_t step = 0;
  std::size_t bodies = 0;    // whose states are not the same bit for bit, or that only one has
  std::size_t one_side = 0;  // of these, those that only one has
  double reach_m = 0.0;      // the farthest of them from the nearest place where it began
  double deviation_m = 0.0;  // largest distance between where a body is in both
};

// Follows steps in order. It begins where bodies are that differ in the first step with any.
class BranchDifference {
 public:
  // Of a step with states.
  StepDifference add(const LoggedStep& recorded, std::span<const physics::BodyId> ids,
                     std::span<const physics::BodyState> states);

 private:
  std::vector<physics::Vec3> origins_m_;
};

}  // namespace soda::analysis
