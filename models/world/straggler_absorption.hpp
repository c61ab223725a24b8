// Absorbing stragglers: late ghosts that make no difference, so that what a world has executed
// stands.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "models/transform_buffer/transform_buffer.hpp"
#include "models/world/absorption.hpp"
#include "models/world/ghost_extrapolation.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// Looks at the step in progress and at those before it, of which the buffer has the memo.
class StragglerAbsorption {
 public:
  StragglerAbsorption(StepInProgress& step, TransformBuffer& buffer,
                      GhostExtrapolation& extrapolation)
      : step_(step), buffer_(buffer), extrapolation_(extrapolation) {}

  // As LogicalProcess::absorb, of a world that executes at `next` next. Only ghosts of steps whose
  // pairs have been tested are absorbed.
  bool absorb(kernel::VirtualTime now, Bag bag, kernel::VirtualTime next);
  // Of the last absorb().
  kernel::Refusal refusal() const { return refusal_; }

 private:
  bool absorb_ghosts(std::int64_t step, Bag bag);
  bool absorb_sent(std::int64_t step, Bag bag);
  bool absorb_with_extrapolation(std::int64_t from, Bag bag);
  void adopt(std::int64_t step, ReceivedGhosts received, std::vector<Ghost> usable);
  bool is_over(std::int64_t step) const { return step < next_.t; }
  std::function<bool(physics::BodyId)> own_bodies(std::int64_t step) const;
  std::optional<ExecutedStep> executed_step(std::int64_t step, std::vector<Ghost>& ghosts) const;
  bool comes_out_alike(std::int64_t step, std::span<const Ghost> usable);

  StepInProgress& step_;
  TransformBuffer& buffer_;
  GhostExtrapolation& extrapolation_;
  kernel::VirtualTime next_{};  // of the world, during absorb()
  kernel::Refusal refusal_;
};

}  // namespace soda::models
