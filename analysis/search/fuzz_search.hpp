// A random scene in a process of its own, and making a failing one small.
#pragma once

#include <functional>
#include <string>

#include "analysis/search/fuzz_scene.hpp"
#include "analysis/search/fuzz_trial.hpp"
#include "analysis/search/shrink_limits.hpp"

namespace soda::analysis {

struct FuzzOutcome {
  bool failed = false;
  bool refused = false;  // failed, as the scenario reader did not take the text
  std::string what;
  FuzzSums sums;  // if it did not fail
};

// Reads the text as a scenario and tries it (fuzz_trial.hpp), in a forked child. `file` names it in
// messages, and mesh files are looked up beside it.
FuzzOutcome try_scene(const std::string& text, const std::string& file = "fuzz.json");

using TryScene = std::function<FuzzOutcome(const FuzzScene&)>;

// As text, by try_scene.
FuzzOutcome try_drawn(const FuzzScene& scene);

struct ShrunkScene {
  FuzzScene scene;   // fails
  std::string what;  // how
  unsigned tried = 0;
};

// Fewer bodies, statics, joints and steps, plainer shapes, things at rest, round numbers, as long
// as it still fails in some way. Ends at the limits.
ShrunkScene shrink(const FuzzScene& failing, std::string what, const ShrinkLimits& limits,
                   const TryScene& attempt = try_drawn);

}  // namespace soda::analysis
