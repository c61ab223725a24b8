// Showing a simulation at a constant frame rate: which clock each frame shows, and how it went.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "models/real_time/buffer_interface.hpp"

namespace soda::models {

// A source of time. Tests have their own; a program, the wall clock.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual double now_s() const = 0;
  virtual void sleep_until(double time_s) = 0;
};

struct PlaybackOptions {
  double frame_s = 1.0 / 60.0;   // > 0
  double steps_per_frame = 1.0;  // > 0; fewer than 1: a step is shown in several frames
  std::int64_t steps = 0;        // the clock of the last frame
  std::int64_t first_step = 0;   // that of the first
};

// One frame: what was due, and what there was.
enum class FrameFate : std::uint8_t {
  kOnTime,
  kSlow,  // the clock went on, but by less than it should: slow motion
  kLate,  // nothing new, though something was due: the frame before is repeated
};

struct ShownFrame {
  double due_s = 0.0;      // since the first frame
  std::int64_t clock = 0;  // shown
  std::int64_t fill = 0;   // steps that all worlds have beyond it
  FrameFate fate = FrameFate::kOnTime;
};

// A renderer without a picture. It asks for the clock that follows from what it showed last and the
// frame rate; if that is not there, it shows what there is and goes on from there. So an overload
// gives slow motion and no jump.
class Playback {
 public:
  // The first frame is due at `start_s`.
  Playback(BufferInterface& buffer, const PlaybackOptions& options, double start_s);

  double next_due_s() const;
  bool finished() const { return finished_; }
  // Shows the next frame, and returns it.
  const ShownFrame& show_next();

  const std::vector<ShownFrame>& frames() const { return frames_; }

 private:
  BufferInterface& buffer_;
  const PlaybackOptions options_;
  const double start_s_;
  double position_ = 0.0;  // in steps; the clock shown is its whole part
  bool finished_ = false;
  std::vector<ShownFrame> frames_;
};

// What frames add up to.
struct PlaybackSummary {
  std::int64_t frames = 0, on_time = 0, slow = 0, late = 0;
  std::int64_t least_fill = 0;  // while there were steps left to compute
  double slow_motion_s = 0.0;   // by how much the last frame came later than in real time
};
PlaybackSummary summary_of(const std::vector<ShownFrame>& frames, const PlaybackOptions& options);

// Plays until the last clock was shown, or `ended()` and nothing new can come. Before the first
// frame it waits until `fill` steps are in store or all are; `begins()` is called when they are.
Playback play(BufferInterface& buffer, const PlaybackOptions& options, Clock& clock,
              std::int64_t fill, const std::function<bool()>& ended,
              const std::function<void()>& begins = {});

}  // namespace soda::models
