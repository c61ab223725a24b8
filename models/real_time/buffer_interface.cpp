#include "models/real_time/buffer_interface.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "models/messages/schedule.hpp"

namespace soda::models {

BufferInterface::BufferInterface(std::span<const physics::BodyState> initial, std::uint32_t worlds,
                                 const Lead& lead, std::int64_t first)
    : lead_(lead),
      first_(first),
      lead_steps_(lead.steps),
      most_lead_steps_(lead.steps),
      newest_(worlds),
      shown_(first) {
  for (std::atomic<std::int64_t>& newest : newest_) newest.store(first);
  Frame start;
  start.clock = first;
  start.states.assign(initial.begin(), initial.end());
  for (std::uint32_t body = 0; body < initial.size(); ++body)
    start.ids.push_back(physics::BodyId{body});
  frames_.push_back(std::make_shared<const Frame>(std::move(start)));
}

void BufferInterface::add(const CommittedStep& step) {
  auto frame = std::make_shared<const Frame>(Frame{
      step.step, {step.ids.begin(), step.ids.end()}, {step.states.begin(), step.states.end()}});
  const std::lock_guard lock(mutex_);
  if (step.step != frames_.back()->clock + 1) {
    std::fprintf(stderr, "soda: buffer interface: frame %lld after %lld\n",
                 static_cast<long long>(step.step), static_cast<long long>(frames_.back()->clock));
    std::abort();
  }
  frames_.push_back(std::move(frame));
}

void BufferInterface::on_newest(WorldId world, std::int64_t step) {
  newest_[index_of(world)].store(step, std::memory_order_relaxed);
}

kernel::VirtualTime BufferInterface::floor() {
  return time_of(shown_.load() + lead_steps_.load(), Phase::kBegin);
}

std::shared_ptr<const Frame> BufferInterface::show(std::int64_t clock) {
  const std::lock_guard lock(mutex_);
  while (frames_.size() > 1 && frames_[1]->clock <= clock) frames_.pop_front();
  shown_.store(frames_.front()->clock);
  if (lead_.frame > 0) adapt_lead(frames_.back()->clock - frames_.front()->clock);
  return frames_.front();
}

void BufferInterface::adapt_lead(std::int64_t final_beyond) {
  constexpr int kFramesOfPlenty = 60;
  const std::int64_t lead = lead_steps_.load();
  const bool has_more = reached() > shown_.load() + final_beyond;
  const bool would_do_with_less = 2 * (final_beyond - lead_.frame) >= lead - lead_.frame;
  plenty_ = would_do_with_less ? plenty_ + 1 : 0;
  if (patience_ > 0) {
    --patience_;
  } else if (2 * final_beyond < lead && has_more && shown_.load() > first_) {
    patience_ = (lead - final_beyond) / lead_.frame;
    lead_steps_.store(std::min(2 * lead, lead_.most));
    most_lead_steps_ = std::max(most_lead_steps_, lead_steps_.load());
  } else if (plenty_ >= kFramesOfPlenty) {
    lead_steps_.store(std::max(lead - lead_.frame, lead_.steps));
    plenty_ = 0;
  }
}

std::int64_t BufferInterface::reached() const {
  std::int64_t least = newest_.front().load(std::memory_order_relaxed);
  for (const std::atomic<std::int64_t>& newest : newest_)
    least = std::min(least, newest.load(std::memory_order_relaxed));
  return least;
}

}  // namespace soda::models
