#include "models/load_balancing/balancing.hpp"

#include <algorithm>
#include <utility>

#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"

namespace soda::models {
namespace {

constexpr std::size_t kMostRandomCells = 4;  // at once

}  // namespace

kernel::Message transfer_message(std::int64_t step, std::span<const CellTransfer> transfers) {
  kernel::Message message;
  message.time = time_of(step, Phase::kBegin);
  message.kind = static_cast<std::uint32_t>(MessageKind::kTransfers);
  message.payload = encode_transfers(transfers);
  return message;
}

Balancing::Balancing(const BalancingOptions& options, std::shared_ptr<const TerritoryMap> map,
                     std::vector<std::uint32_t> processor_of, std::int64_t buffer,
                     std::int64_t first_step, std::int64_t steps)
    : options_(options),
      processor_of_(std::move(processor_of)),
      delay_(buffer + 1),
      steps_(steps),
      map_(std::move(map)),
      random_(options.seed),
      holds_from_(first_step + delay_),
      next_decision_(first_step) {}

LoadSampling Balancing::sampling() const {
  if (options_.policy != BalancingPolicy::kPaper) return {};
  return {.interval = options_.interval, .from = delay_, .until = delay_ + options_.interval};
}

void Balancing::add(LoadSample sample) {
  const std::lock_guard lock(mutex_);
  samples_[sample.step].push_back(std::move(sample));
}

kernel::VirtualTime Balancing::floor() { return time_of(holds_from_, Phase::kBegin); }

void Balancing::take(kernel::VirtualTime gvt, kernel::VirtualTime earliest,
                     std::vector<kernel::Message>& out) {
  holds_from_ = std::max(holds_from_, gvt.t + delay_);
  const std::int64_t step =
      std::max(holds_from_, earliest > floor() ? earliest.t + 1 : holds_from_);
  if (gvt.t < next_decision_ || step >= steps_ || step == announced_) return;
  const std::vector<CellTransfer> transfers = decide(gvt.t);
  if (!transfers.empty()) announce(step, transfers, out);
}

std::vector<TerritoryChange> Balancing::changes_at(std::int64_t step) {
  const std::lock_guard lock(mutex_);
  return {std::ranges::lower_bound(changes_, step, {}, &TerritoryChange::step),
          std::ranges::upper_bound(changes_, step, {}, &TerritoryChange::step)};
}

// Of the newest step of which all worlds have told, by world; empty if there is none.
std::vector<LoadSample> Balancing::newest_samples() {
  const std::lock_guard lock(mutex_);
  auto whole = samples_.end();
  for (auto step = samples_.begin(); step != samples_.end(); ++step)
    if (step->second.size() == map_->worlds()) whole = step;
  if (whole == samples_.end()) return {};
  std::vector<LoadSample> newest = std::move(whole->second);
  samples_.erase(samples_.begin(), std::next(whole));
  std::sort(newest.begin(), newest.end(),
            [](const LoadSample& a, const LoadSample& b) { return a.world < b.world; });
  return newest;
}

std::vector<CellTransfer> Balancing::decide(std::int64_t step) {
  if (options_.policy == BalancingPolicy::kRandom) {
    next_decision_ = step + options_.interval;
    return random_transfers(*map_, 1 + random_.below(kMostRandomCells), random_);
  }
  const std::vector<LoadSample> samples = newest_samples();
  if (samples.empty()) return {};
  return paper_transfers(picture_of(samples, map_->owners().size()), *map_, processor_of_,
                         {.delay = delay_ + options_.interval});
}

void Balancing::announce(std::int64_t step, std::span<const CellTransfer> transfers,
                         std::vector<kernel::Message>& out) {
  announced_ = step;
  append_for_all(transfer_message(step, transfers), map_->worlds(), out);
  std::vector<WorldId> owners(map_->owners().begin(), map_->owners().end());
  const std::lock_guard lock(mutex_);
  for (const CellTransfer& transfer : transfers)
    changes_.push_back(
        {step, transfer.cell, std::exchange(owners[transfer.cell], transfer.to), transfer.to});
  map_ = std::make_shared<const TerritoryMap>(map_->after(transfers));
}

}  // namespace soda::models
