// A whole run of a scene by the Time Warp kernel: divided into worlds, over threads.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "soda/inputs.hpp"
#include "soda/scene.hpp"

namespace soda {

// What is not given is as the scene says. No option changes a state.
struct RunOptions {
  std::optional<std::int64_t> steps = {};
  std::optional<std::uint32_t> worlds = {};
  std::optional<unsigned> threads = {};
  std::optional<std::int64_t> buffer_entries = {};
  std::vector<Input> inputs = {};  // beside the scene's own
};

// A step that is final in all worlds.
struct CommittedStep {
  std::int64_t step = 0;  // after so many
  std::span<const std::uint32_t> body_ids = {};
  std::span<const BodyState> states = {};
};
// Called in order of steps, one call at a time, from any worker thread.
using CommitCallback = std::function<void(const CommittedStep&)>;

struct RunResult {
  std::int64_t steps = 0;
  std::uint64_t digest = 0;
  std::vector<std::uint32_t> body_ids = {};
  std::vector<BodyState> states = {};
  std::uint64_t events_executed = 0, events_rolled_back = 0, events_committed = 0;
};

// Throws UsageError, SceneError (of inputs) and NumericalError.
SODA_API RunResult run(const Scene& scene, const RunOptions& options = {},
                       const CommitCallback& on_commit = {});

}  // namespace soda
