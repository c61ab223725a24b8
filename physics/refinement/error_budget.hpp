// How far a refined step may be off, and how far it is.
#pragma once

#include <algorithm>
#include <span>

#include "physics/measures/refinement_error.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// What errors a step may still have, in widths: of the scene's tolerance, half is shared out over
// time, the other half is for changes. Without a tolerance each part may be off by 1e-7, and
// nothing is told.
class ErrorBudget {
 public:
  explicit ErrorBudget(const SceneDescription& scene)
      : tolerance_(scene.tolerance), dt_s_(scene.dt_s), for_changes_(0.5 * tolerance_) {}

  // Half of what may still be spent on a change is kept for those that follow.
  bool allows(double relative_error, double time_s) const {
    if (!(tolerance_ > 0.0)) return relative_error <= kOwn;
    return relative_error <= share_of(time_s) + kForOne * for_changes_;
  }
  void spend(const StepError& error, double time_s, std::span<const BodyId> ids) {
    if (!(tolerance_ > 0.0)) return;
    for_changes_ -= std::clamp(error.relative_error - share_of(time_s), 0.0, for_changes_);
    sum_ += error.relative_error;
    if (!(error.relative_error > largest_)) return;
    largest_ = error.relative_error;
    worst_ = ids[error.body];
  }
  void tell(IslandReport& report) const {
    report.error_estimate = sum_;
    report.worst_body = worst_;
    report.beyond_tolerance = tolerance_ > 0.0 && !(sum_ <= tolerance_);
  }

 private:
  static constexpr double kOwn = 1e-7;
  static constexpr double kForOne = 0.25;
  double share_of(double time_s) const { return 0.5 * tolerance_ * (time_s / dt_s_); }

  double tolerance_, dt_s_, for_changes_;
  double sum_ = 0.0, largest_ = 0.0;
  BodyId worst_{};
};

}  // namespace soda::physics
