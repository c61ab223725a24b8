// One trial of the swarm: a model, a virtual cluster and an adversary drawn from a seed, under
// checkers that compare every commit with the oracle as it happens.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "scenarios/warning.hpp"

namespace soda::analysis {

// What shrinking makes smaller. All else is drawn from the seed, whatever the size.
struct TrialSize {
  std::uint32_t lps = 1;         // of PHOLD, or worlds of a scene; >= 1
  std::int64_t end = 1;          // ticks, or steps; >= 1
  std::int64_t window = 1;       // or buffer; >= 1
  std::uint32_t processors = 1;  // >= 1

  friend bool operator==(const TrialSize&, const TrialSize&) = default;
};

// What is simulated.
class SwarmSubject {
 public:
  virtual ~SwarmSubject() = default;
  virtual std::string file() const = 0;  // empty: PHOLD
  virtual std::vector<scenarios::InputWarning> warnings() const { return {}; }
  virtual TrialSize draw_size(std::uint64_t seed) const = 0;
  // Runs under the checkers. `cluster` lacks only what the size says. Throws kernel::Violation.
  virtual kernel::Counters run(std::uint64_t seed, const TrialSize& size,
                               kernel::VirtualOptions cluster) const = 0;
};

// Order-sensitive, with ties, zero-delay rounds, several slots and, for some seeds, faults.
std::unique_ptr<SwarmSubject> phold_subject();

// A scenario, of which at most `most_steps` steps are run; `strict`: none with warnings. Throws
// what load_scenario throws.
std::unique_ptr<SwarmSubject> scene_subject(const std::string& file, std::int64_t most_steps,
                                            bool strict = false);

struct Trial {
  std::uint64_t seed = 0;
  TrialSize size;
  // The adversary's decisions to replay; otherwise it draws them from the seed.
  std::optional<std::vector<kernel::Decision>> decisions;
};

struct TrialSums {
  std::uint64_t executed = 0, rolled_back = 0, committed = 0, rollbacks = 0, anti_messages = 0;
};

// Throws kernel::Violation, or aborts if an invariant of the kernel breaks.
TrialSums run_trial(const SwarmSubject& subject, const Trial& trial,
                    const std::function<void(const kernel::Decision&)>& on_decision = {});

}  // namespace soda::analysis
