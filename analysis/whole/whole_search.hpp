// Making a failing whole scene small.
#pragma once

#include <functional>

#include "analysis/search/shrink_limits.hpp"
#include "analysis/whole/whole_trial.hpp"

namespace soda::analysis {

using TryWhole = std::function<WholeOutcome(const WholeTrial&)>;

struct ShrunkWhole {
  WholeTrial trial;  // fails
  WholeOutcome outcome;
  unsigned tried = 0;
};

// Fewer objects of every list, options, keys and steps, as long as it fails in the same way. What
// fails by chance is tried more than once.
ShrunkWhole shrink(const WholeTrial& failing, const WholeOutcome& how, const ShrinkLimits& limits,
                   const TryWhole& attempt);

}  // namespace soda::analysis
