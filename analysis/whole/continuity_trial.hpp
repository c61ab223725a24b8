// One change that should not matter: how far the plain loop strays from itself.
#pragma once

#include <cstdint>
#include <string>

#include "analysis/whole/continuity_changes.hpp"

namespace soda::analysis {

enum class ContinuityEnding {
  kSameBits,  // of all that the change does not concern
  kRounding,  // within the bound
  kFailed,    // beyond it
  kNoChange,  // nothing to change in this scene, or it ends with a fault at once
};

struct ContinuityOutcome {
  ContinuityEnding ending = ContinuityEnding::kNoChange;
  std::string what;        // if it failed
  std::int64_t steps = 0;  // that were compared
  double worst = 0.0;      // deviation over what is allowed
};

// Runs the scene of the seed, the changed one, and three that are shaken by rounding, for at most
// 30 steps, in an isolated process. A body's deviation is that of its place, or of its velocity
// times the step, whichever is larger, over a metre and its distance from the origin. Allowed is
//   1e-10 + 1000 d + 10 f / m t (t + dt),
// with d the largest deviation of the shaken scenes so far, f the force that was added and m the
// least mass: what the change itself can do. The comparison ends where d is above 1e-6: there the
// scene is chaos and anything may differ.
ContinuityOutcome try_continuity(std::uint64_t seed, ContinuityKind kind,
                                 const std::string& folder);

}  // namespace soda::analysis
