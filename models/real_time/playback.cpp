#include "models/real_time/playback.hpp"

#include <algorithm>
#include <cmath>

namespace soda::models {
namespace {

// A frame rate that is the rate of steps up to rounding must not fall one step behind by it.
constexpr double kRounding = 1e-6;

std::int64_t whole_steps(double position) {
  return static_cast<std::int64_t>(std::floor(position + kRounding));
}

constexpr double kNap = 1e-3;

}  // namespace

Playback::Playback(BufferInterface& buffer, const PlaybackOptions& options, double start_s)
    : buffer_(buffer), options_(options), start_s_(start_s) {}

double Playback::next_due_s() const {
  return start_s_ + static_cast<double>(frames_.size()) * options_.frame_s;
}

const ShownFrame& Playback::show_next() {
  const double due = frames_.empty() ? static_cast<double>(options_.first_step)
                                     : position_ + options_.steps_per_frame;
  const std::int64_t before = buffer_.shown();
  const std::int64_t wanted = std::min(whole_steps(due), options_.steps);
  const std::int64_t clock = buffer_.show(wanted)->clock;
  ShownFrame frame{.due_s = next_due_s() - start_s_,
                   .clock = clock,
                   .fill = std::max<std::int64_t>(buffer_.reached() - clock, 0)};
  if (clock < wanted) frame.fate = clock > before ? FrameFate::kSlow : FrameFate::kLate;
  position_ = clock < wanted ? static_cast<double>(clock) : due;
  finished_ = clock >= options_.steps;
  frames_.push_back(frame);
  return frames_.back();
}

PlaybackSummary summary_of(const std::vector<ShownFrame>& frames, const PlaybackOptions& options) {
  PlaybackSummary sum;
  sum.frames = static_cast<std::int64_t>(frames.size());
  bool is_first = true;
  for (const ShownFrame& frame : frames) {
    sum.on_time += frame.fate == FrameFate::kOnTime;
    sum.slow += frame.fate == FrameFate::kSlow;
    sum.late += frame.fate == FrameFate::kLate;
    // At the end nothing is left to fill the buffer with.
    if (frame.clock + frame.fill >= options.steps) continue;
    sum.least_fill = is_first ? frame.fill : std::min(sum.least_fill, frame.fill);
    is_first = false;
  }
  if (!frames.empty()) {
    const double real_s = static_cast<double>(frames.back().clock - options.first_step) /
                          options.steps_per_frame * options.frame_s;
    sum.slow_motion_s = std::max(0.0, frames.back().due_s - real_s);
  }
  return sum;
}

Playback play(BufferInterface& buffer, const PlaybackOptions& options, Clock& clock,
              std::int64_t fill, const std::function<bool()>& ended,
              const std::function<void()>& begins) {
  const std::int64_t enough = std::min(options.first_step + fill, options.steps);
  while (buffer.reached() < enough && !ended()) clock.sleep_until(clock.now_s() + kNap);
  if (begins) begins();
  Playback playback(buffer, options, clock.now_s());
  while (!playback.finished()) {
    clock.sleep_until(playback.next_due_s());
    const bool was_ended = ended();  // asked before, so that a last step is not missed
    const ShownFrame& frame = playback.show_next();
    if (was_ended && frame.fate != FrameFate::kOnTime) break;
  }
  return playback;
}

}  // namespace soda::models
