// A scheduler's opponent: it delays, reorders, stalls, holds back and undoes, by a seed, within
// what a network and a processor may do. Its decisions are a list that can be replayed and
// shortened.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/message.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// At the `point`-th question of a run the answer was `value` instead of 0, the undisturbed one.
struct Decision {
  std::uint64_t point = 0;
  std::uint32_t value = 0;
};

// Which of the LPs that can execute is taken.
enum class PickRule : std::uint32_t {
  kLowest,          // the earliest floor: what an undisturbed processor does
  kAny,             // at random
  kMostOptimistic,  // the one furthest ahead
  kStarve,          // the earliest, but never `starved` while there is another
};

// Likelihoods of disturbances, in thousandths of the occasions.
struct AdversaryPlan {
  std::uint64_t seed = 0;
  PickRule pick = PickRule::kLowest;
  LpId starved{};
  std::uint32_t message_delay = 0;  // any message, so that channels are not FIFO
  std::uint32_t anti_delay = 0;     // anti-messages, long enough to come last
  std::uint32_t stall = 0;          // an execution that takes long
  std::uint32_t hold = 0;           // a processor that takes in nothing for a while: late batches
  std::uint32_t undo = 0;           // an execution that is undone once without need
  std::int64_t unit_ns = 1000;      // >= 1: delays are multiples of it
  // After so many questions it rests: without an end to it, optimism that is always misled can
  // multiply its work for as long as a window lasts.
  std::uint64_t most_points = 10'000;
};

// A composition of disturbances, each present or not (swarm testing).
AdversaryPlan draw_adversary(std::uint64_t seed, std::size_t lps, std::int64_t unit_ns);

class Adversary {
 public:
  // `on_decision` hears of each decision as it is made: a run that aborts leaves no list.
  explicit Adversary(const AdversaryPlan& plan,
                     std::function<void(const Decision&)> on_decision = {});
  // Answers with `decisions` (ascending points), with 0 to all other questions.
  Adversary(const AdversaryPlan& plan, std::vector<Decision> decisions);

  std::int64_t message_delay_ns(bool anti);
  std::int64_t stall_ns();
  std::int64_t hold_ns();
  bool undoes();
  // Index of the LP to take, of candidates ordered by floor.
  std::size_t pick(std::span<const LpId> by_floor);

  // What was decided so far, ascending, and out of how many questions.
  const std::vector<Decision>& decisions() const { return made_; }
  std::uint64_t points() const { return points_; }

 private:
  std::uint32_t decide(std::uint32_t per_mille, std::uint32_t most);
  std::uint32_t record(std::uint32_t value);
  std::uint32_t replayed();
  bool rests() const { return points_ >= plan_.most_points; }

  const AdversaryPlan plan_;
  const std::function<void(const Decision&)> on_decision_;
  const bool replays_;
  const std::vector<Decision> replay_;
  std::size_t next_replay_ = 0;
  SplitMix64 random_;
  std::uint64_t points_ = 0;
  std::vector<Decision> made_;
};

}  // namespace soda::kernel
