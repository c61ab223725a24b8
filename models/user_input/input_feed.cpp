#include "models/user_input/input_feed.hpp"

#include <algorithm>
#include <utility>

#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"

namespace soda::models {

kernel::Message input_message(const UserInput& input) {
  kernel::Message message;
  message.time = time_of(input.step, Phase::kBegin);
  message.kind = static_cast<std::uint32_t>(MessageKind::kInputs);
  message.slot = input.id;
  message.payload = encode_input(input);
  return message;
}

void LiveInputs::offer(const UserInput& input) {
  const std::lock_guard lock(mutex_);
  offered_.push_back({input, input.step, false});
}

std::vector<CommittedInput> LiveInputs::take(std::int64_t earliest_step) {
  const std::lock_guard lock(mutex_);
  const auto first = offered_.begin() + static_cast<std::ptrdiff_t>(taken_);
  for (auto at = first; at != offered_.end(); ++at)
    at->input.step = std::max(at->input.step, earliest_step);
  taken_ = offered_.size();
  return {first, offered_.end()};
}

std::size_t LiveInputs::waiting() const {
  const std::lock_guard lock(mutex_);
  return offered_.size() - taken_;
}

std::vector<CommittedInput> LiveInputs::offered() const {
  const std::lock_guard lock(mutex_);
  return offered_;
}

InputFeed::InputFeed(const InputOptions& options, std::uint32_t worlds, std::int64_t first_step,
                     std::int64_t ahead_steps)
    : live_(options.live),
      worlds_(worlds),
      first_step_(first_step),
      ahead_steps_(ahead_steps),
      presence_(options.absent) {
  for (const UserInput& input : options.script) stamped_.insert({input, input.step});
  waiting_ = stamped_;
}

kernel::VirtualTime InputFeed::floor() {
  const std::lock_guard lock(mutex_);
  return waiting_.empty() ? kernel::kNever : time_of(waiting_.begin()->input.step, Phase::kBegin);
}

void InputFeed::take(kernel::VirtualTime gvt, kernel::VirtualTime earliest,
                     std::vector<kernel::Message>& out) {
  const std::lock_guard lock(mutex_);
  if (live_ != nullptr)
    take_live(std::max(earliest.round == 0 ? earliest.t : earliest.t + 1, first_step_));
  while (!waiting_.empty() && waiting_.begin()->input.step - ahead_steps_ <= gvt.t) {
    append_for_all(input_message(waiting_.begin()->input), worlds_, out);
    waiting_.erase(waiting_.begin());
  }
}

void InputFeed::take_live(std::int64_t earliest_step) {
  for (const CommittedInput& taken : live_->take(earliest_step)) {
    const Stamped stamped{taken.input, taken.asked_step};
    if (stamped_.insert(stamped).second) waiting_.insert(stamped);
  }
}

std::size_t InputFeed::too_late() {
  const std::size_t unasked = live_ != nullptr ? live_->waiting() : 0;
  return stamped_.size() - log_.size() + unasked;
}

std::span<const CommittedInput> InputFeed::committed(std::int64_t step) {
  const std::lock_guard lock(mutex_);
  const std::size_t first = log_.size();
  UserInput from;
  from.step = step;
  for (auto at = stamped_.lower_bound({from, 0}); at != stamped_.end() && at->input.step == step;
       ++at)
    log_.push_back({at->input, at->asked_step, presence_.note(at->input)});
  return std::span(log_).subspan(first);
}

}  // namespace soda::models
