// The paper's Figure 8: how long a transform buffer hides an overload from the renderer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "analysis/stopwatch.hpp"
#include "models/load_balancer.hpp"

namespace soda::analysis {

struct AnticipationOptions {
  std::vector<std::int64_t> buffers;  // entries, each >= 1
  std::vector<double> overloads;      // additional cost as a fraction of the base cost, >= 0
  double utilisation = 1.0;           // base step cost over frame time, > 0
  std::int64_t max_steps = 2000;      // a world that lasts longer counts as never late
};

// One experiment: a world with a full buffer meets an overload. If it starves in the warm-up
// already (utilisation too high for so small a buffer), steps_until_late and filled are 0, and what
// only steps after the peak can tell is NaN.
struct AnticipationPoint {
  std::int64_t buffer = 0;
  double overload = 0.0;           // wanted
  std::uint32_t bodies = 0;        // after the peak
  double measured_overload = 0.0;  // mean cost of its own steps after the peak, over base cost, - 1
  double ratio = 0.0;              // r: that mean cost over the frame time
  std::int64_t filled = 0;         // entries in the buffer at the peak
  std::int64_t steps_until_late = 0;  // frames shown after the peak until one was missing
  bool late = false;                  // false: not within max_steps
  double closed_form_steps = 0.0;     // A(filled, measured r); infinite for r <= 1
};

struct AnticipationReport {
  std::uint32_t base_bodies = 0;
  double base_step_s = 0.0;  // mean CPU time of a base step
  double frame_s = 0.0;      // frame time that gives the wanted utilisation
  double utilisation = 1.0;
  std::vector<AnticipationPoint> points;  // by buffer, then overload, as given
};

// Frames that a ring of `entries` lasts when each step costs `ratio` frames.
using models::anticipation_steps;

// What the renderer meets, in units of its own frames.
struct StarvationResult {
  std::int64_t frames = 0;  // shown before the first missing one
  bool late = false;
  std::int64_t filled_at_peak = 0;
};

// Producer and consumer around a ring of `buffer` entries in virtual wall time. The producer works
// without pause, but waits with a finished entry while the ring is full; from a full ring on, the
// consumer takes an entry every `frame_s`. The frame after `warm_up` of them is the peak: steps
// begun until then cost base_cost_s() each, later ones peak_cost_s(). Frames are counted from the
// one after the peak, up to `max_frames`.
template <class BaseCost, class PeakCost>
StarvationResult drain(std::int64_t buffer, double frame_s, std::int64_t warm_up,
                       std::int64_t max_frames, BaseCost base_cost_s, PeakCost peak_cost_s) {
  StarvationResult result;
  std::int64_t filled = buffer;
  double finished_s = base_cost_s();  // when the entry in the making is finished
  for (std::int64_t frame = 0; frame <= warm_up + max_frames; ++frame) {
    const double now_s = static_cast<double>(frame) * frame_s;
    while (finished_s <= now_s && filled < buffer) {
      ++filled;
      finished_s += frame <= warm_up ? base_cost_s() : peak_cost_s();
    }
    if (filled == 0) {
      result.late = true;
      return result;
    }
    --filled;
    if (finished_s <= now_s) {  // it waited for this room
      ++filled;
      finished_s = now_s + (frame < warm_up ? base_cost_s() : peak_cost_s());
    }
    if (frame == warm_up) result.filled_at_peak = filled;
    if (frame > warm_up) ++result.frames;
  }
  return result;
}

// Runs all combinations; each takes its own real steps, timed by the CPU clock of the thread in
// units of base steps timed alongside (see README.md, decision 4).
AnticipationReport measure_anticipation(const AnticipationOptions& options);

}  // namespace soda::analysis
