// The oracle of a scenario: the plain loop over physics::step.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "physics/shapes/geometry.hpp"
#include "physics/step/step.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// When to stop before the scenario's last step. The work is a count, so that it is the same on
// every machine: nanoseconds of a usual one, roughly.
struct PlainLimits {
  bool stop_at_fault = false;
  std::uint64_t work = std::numeric_limits<std::uint64_t>::max();
  // Told of each step; may be empty.
  std::function<void(std::span<const physics::BodyId>, std::span<const physics::BodyState>)> watch =
      {};
};

// The first that is recorded: in the step that begins after `step` steps; of the least body id.
struct PlainFault {
  std::int64_t step = 0;
  std::uint32_t body_label = 0;
  std::string what;
};

// No worlds, no kernel, nothing shared with what it judges. `scenario` must outlive this object.
class PlainLoop {
 public:
  // Runs scenario.run.steps steps and keeps their digests.
  explicit PlainLoop(const scenarios::Scenario& scenario);
  // With these inputs instead of the scenario's.
  PlainLoop(const scenarios::Scenario& scenario, std::vector<models::UserInput> inputs,
            const PlainLimits& limits = {});

  // How many there are digests of: all, unless a limit was reached.
  std::int64_t steps() const { return static_cast<std::int64_t>(digests_.size()) - 1; }
  const std::optional<PlainFault>& fault() const { return fault_; }
  const physics::StageCounters& counters() const { return counters_; }
  std::uint64_t digest_after(std::int64_t steps) const;
  // The bodies that are there, by id. Runs again from the start.
  struct Bodies {
    std::vector<physics::BodyId> ids;
    std::vector<physics::BodyState> states;
  };
  Bodies after(std::int64_t steps);

 private:
  void restart();
  void advance();
  void note_fault();

  const scenarios::Scenario& scenario_;
  const physics::Geometry geometry_;
  std::vector<models::UserInput> inputs_;  // in the order of acting

  physics::SceneDescription scene_;  // materials change
  Bodies bodies_;
  models::Presence presence_{{}};
  std::int64_t step_ = 0;
  std::size_t next_input_ = 0;
  physics::StepScratch scratch_;
  physics::StepReport report_;
  physics::StageCounters counters_;
  std::vector<std::uint64_t> digests_;
  std::optional<PlainFault> fault_;
};

// What such a count of stages costs, in the unit of PlainLimits.
std::uint64_t work_of(const physics::StageCounters& counters);

}  // namespace soda::analysis
