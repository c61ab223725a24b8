// How long transform buffers hide an overload from a renderer (the paper's Figure 8): runs that a
// clock consumes, by the wall or on the virtual cluster, and the law for them.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "analysis/runs/realtime.hpp"
#include "models/load_balancing/load_balancer.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// Who is overloaded, and when; times since the first frame.
struct PeakOptions {
  std::vector<models::WorldId> worlds;     // empty: all
  std::optional<std::uint64_t> wandering;  // instead: one world after the other, by this seed
  double from_s = 1.0;                     // the paper's
  double for_s = std::numeric_limits<double>::infinity();
};

struct AnticipationOptions {
  std::vector<std::int64_t> buffers;  // entries, each >= 1
  std::vector<double> overloads;      // additional cost as a fraction of the base, >= 0
  bool measured = true, modelled = true;
  PeakOptions peak;
  double utilisation = 1.0;      // base load: CPU time of a step over the time that it has, > 0
  double frames_per_s = 60.0;    // > 0
  double speed = 1.0;            // simulated over shown time, > 0
  std::optional<double> lead_frames;  // of measured runs: RealTimeRequest::lead_frames
  int repeat = 1;                // measured runs of a point, of which the median counts
  std::int64_t max_steps = 600;  // a buffer that lasts longer counts as never empty
};

// THE LAW. A worker whose step takes r frames (all its worlds' shares together) gives one entry
// every r frames. The renderer takes one every frame, the entry that all worlds have: the least. So
// F entries in store last
//   A = F r / (r - 1) frames, for ever if r <= 1,
// and several workers as long as the one with the largest r: run ahead as the others may, what a
// frame needs is the slowest's. Gated worlds wait for the slow one within the same step, worlds
// that run ahead are bounded by their own buffers: neither makes it faster or slower.
std::int64_t law_steps(std::int64_t entries, double ratio);  // whole frames; < 0: for ever

// The largest r of the workers, if a step of a world costs base * (1 + overload) in the peak worlds
// and base in others. Worlds as kernel::Partition gives them to workers.
double ratio_of(const scenarios::Scenario& scenario, const AnticipationOptions& options,
                double overload);

// One run. If a frame is late before the peak, nothing of it is known.
struct AnticipationRun {
  bool late = false;          // within max_steps
  bool late_before = false;   // in the warm-up: the load is too much for so small a buffer
  std::int64_t filled = 0;    // entries in store when the peak begins
  std::int64_t steps = 0;     // shown after that until one was missing
  double ratio = 0.0;         // r of its own steps; NaN: it made none in the peak
  std::int64_t law = 0;       // law_steps(filled, ratio)
  double recovery_s = 0.0;    // from the peak's end until as much is in store as before; NaN: not
  double rolled_back = 0.0;   // share of events
  double buffer_bytes = 0.0;  // of all worlds' full buffers, what entries share counted once
  models::PlaybackSummary frames;
};

struct AnticipationPoint {
  std::int64_t buffer = 0;
  double overload = 0.0;
  double ratio = 0.0;    // wanted
  std::int64_t law = 0;  // law_steps(buffer, ratio)
  std::optional<AnticipationRun> measured, modelled;
};

// A scene in which nothing happens, so that a step costs what it is told to: `worlds` of a ball
// each.
scenarios::Scenario idle_scene(std::uint32_t worlds);

// All points, by buffer, then overload, as given. `progress` is told before each run how many are
// done, of how many. Over ranks all make the same call, and only the root's points are of use.
std::vector<AnticipationPoint> anticipation(
    const scenarios::Scenario& scenario, const AnticipationOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress);

// A run without a clock, on the virtual cluster, for each size of buffers.
struct BufferCost {
  std::int64_t buffer = 0;
  double makespan_s = 0.0;
  double efficiency = 0.0;  // 1 - rolled back / executed
  double lead_steps = 0.0;  // mean
  double buffer_bytes = 0.0;
};
std::vector<BufferCost> makespan_over_buffers(
    const scenarios::Scenario& scenario, const std::vector<std::int64_t>& buffers,
    const std::function<void(std::size_t, std::size_t)>& progress);

// The smallest buffer whose makespan is within `tolerance` of the best; `costs` not empty.
std::int64_t knee_of(const std::vector<BufferCost>& costs, double tolerance = 0.02);

}  // namespace soda::analysis
