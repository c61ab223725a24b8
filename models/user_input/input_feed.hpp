// How user input gets from outside to the worlds, and what is known of it when it is committed.
#pragma once

#include <cstdint>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "kernel/api/external_source.hpp"
#include "models/user_input/user_input.hpp"

namespace soda::models {

// Tells a world of an input; without its destination.
kernel::Message input_message(const UserInput& input);

// Where inputs wait that come while a run goes on. From any thread.
class LiveInputs {
 public:
  // `input.step` < 0: as early as possible.
  void offer(const UserInput& input);
  // All since the last call, in the order of offering, with the steps at which they act: no earlier
  // than `earliest_step`.
  std::vector<CommittedInput> take(std::int64_t earliest_step);
  std::size_t waiting() const;
  // All that were ever offered: with that step, or, of those that wait, with the one asked for. For
  // who writes down what has not acted yet.
  std::vector<CommittedInput> offered() const;

 private:
  mutable std::mutex mutex_;
  std::vector<CommittedInput> offered_;
  std::size_t taken_ = 0;
};

// Sends every input to all worlds, for the beginning of its step. One that comes too late for its
// step gets the earliest that is still possible. GVT does not pass an input that is known.
//
// floor() and take() from the executor, committed() from whoever hears of committed steps.
class InputFeed final : public kernel::ExternalSource {
 public:
  // An input is sent when GVT is `ahead_steps` before its step, or closer. The run begins before
  // `first_step`.
  InputFeed(const InputOptions& options, std::uint32_t worlds, std::int64_t first_step,
            std::int64_t ahead_steps);

  kernel::VirtualTime floor() override;
  void take(kernel::VirtualTime gvt, kernel::VirtualTime earliest,
            std::vector<kernel::Message>& out) override;

  // When GVT has passed the beginning of `step`: its inputs, in the order in which they acted. Call
  // for each step, in order; valid until the next call.
  std::span<const CommittedInput> committed(std::int64_t step);

  // After the run: all that committed() returned, and how many others there were, which never
  // acted.
  const std::vector<CommittedInput>& acted() const { return log_; }
  std::size_t too_late();

 private:
  struct Stamped {
    UserInput input;
    std::int64_t asked_step = 0;
    friend bool operator<(const Stamped& a, const Stamped& b) {
      return acts_before(a.input, b.input);
    }
  };

  void take_live(std::int64_t earliest_step);

  LiveInputs* const live_;
  const std::uint32_t worlds_;
  const std::int64_t first_step_;
  const std::int64_t ahead_steps_;
  std::mutex mutex_;
  std::set<Stamped> waiting_;  // to be sent
  std::set<Stamped> stamped_;  // all that are known
  Presence presence_;          // after what has been committed
  std::vector<CommittedInput> log_;
};

}  // namespace soda::models
