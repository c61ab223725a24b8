#include "kernel/virtual_cluster/adversary.hpp"

#include <utility>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {
namespace {

constexpr std::uint32_t kMostDelay = 40;       // units
constexpr std::uint32_t kMostAntiDelay = 400;  // units
constexpr std::uint32_t kMostStall = 100;      // units
constexpr std::uint32_t kMostHold = 60;        // units

}  // namespace

AdversaryPlan draw_adversary(std::uint64_t seed, std::size_t lps, std::int64_t unit_ns) {
  SplitMix64 random(append(seed, 0x6164u));
  // Absent, rare, frequent, always.
  const auto likelihood = [&random] {
    constexpr std::uint32_t kLevels[] = {0, 0, 30, 300, 1000};
    return kLevels[random.below(std::size(kLevels))];
  };
  AdversaryPlan plan{.seed = seed, .unit_ns = unit_ns};
  plan.pick = static_cast<PickRule>(random.below(4));
  plan.starved = LpId{static_cast<std::uint32_t>(random.below(lps))};
  plan.message_delay = likelihood();
  plan.anti_delay = likelihood();
  plan.stall = likelihood();
  plan.hold = likelihood() / 4;
  plan.undo = likelihood();
  return plan;
}

Adversary::Adversary(const AdversaryPlan& plan, std::function<void(const Decision&)> on_decision)
    : plan_(plan),
      on_decision_(std::move(on_decision)),
      replays_(false),
      random_(append(plan.seed, 0x646bu)) {}

Adversary::Adversary(const AdversaryPlan& plan, std::vector<Decision> decisions)
    : plan_(plan), replays_(true), replay_(std::move(decisions)), random_(0) {}

std::int64_t Adversary::message_delay_ns(bool anti) {
  std::uint32_t units = decide(plan_.message_delay, kMostDelay);
  if (anti) units += decide(plan_.anti_delay, kMostAntiDelay);
  return units * plan_.unit_ns;
}

std::int64_t Adversary::stall_ns() { return decide(plan_.stall, kMostStall) * plan_.unit_ns; }

std::int64_t Adversary::hold_ns() { return decide(plan_.hold, kMostHold) * plan_.unit_ns; }

bool Adversary::undoes() { return decide(plan_.undo, 1) > 0; }

std::size_t Adversary::pick(std::span<const LpId> by_floor) {
  SODA_ASSERT(!by_floor.empty(), "nothing to pick");
  if (by_floor.size() == 1 || rests()) return 0;
  if (replays_) return replayed() % by_floor.size();
  switch (plan_.pick) {
    case PickRule::kLowest:
      return record(0);
    case PickRule::kAny:
      return record(static_cast<std::uint32_t>(random_.below(by_floor.size())));
    case PickRule::kMostOptimistic:
      return record(static_cast<std::uint32_t>(by_floor.size() - 1));
    case PickRule::kStarve:
      return record(by_floor.front() == plan_.starved ? 1 : 0);
  }
  return 0;
}

// 0, or with the given likelihood one of 1 .. most.
std::uint32_t Adversary::decide(std::uint32_t per_mille, std::uint32_t most) {
  if (rests()) return 0;
  if (replays_) return replayed();
  // Both draws are made whatever comes out: the stream must not depend on likelihoods.
  const bool disturbs = random_.below(1000) < per_mille;
  const auto value = static_cast<std::uint32_t>(1 + random_.below(most));
  return record(disturbs ? value : 0);
}

std::uint32_t Adversary::record(std::uint32_t value) {
  if (value > 0) {
    made_.push_back({points_, value});
    if (on_decision_) on_decision_(made_.back());
  }
  ++points_;
  return value;
}

std::uint32_t Adversary::replayed() {
  while (next_replay_ < replay_.size() && replay_[next_replay_].point < points_) ++next_replay_;
  const bool here = next_replay_ < replay_.size() && replay_[next_replay_].point == points_;
  return record(here ? replay_[next_replay_].value : 0);
}

}  // namespace soda::kernel
