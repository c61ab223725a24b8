// `soda run --realtime`: a run that is shown while it is computed, paced by the wall clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "analysis/runs/step_load.hpp"
#include "kernel/api/partition.hpp"
#include "models/real_time/virtual_playback.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// Loads as fractions of the wall time that a step has (models/cost/artificial_load.hpp).
struct RealTimeRequest {
  double frames_per_s = 60.0;  // > 0
  double speed = 1.0;          // simulated over wall time, > 0
  double load = 0.0;           // of all worlds; >= 0
  double peak = 0.0;           // instead, during the peak; 0: there is none
  double peak_from_s = 2.0;    // since the first frame
  double peak_for_s = 1.0;
  // How far GVT may be beyond what is shown, in frames, >= 1; so late a user's input takes effect.
  // Without a value it is kUsualLeadFrames at first, and as many more as GVT needs to keep up.
  std::optional<double> lead_frames;
};
inline constexpr std::int64_t kUsualLeadFrames = 2;
models::ArtificialLoad load_of(const RealTimeRequest& request);

struct RealTimeReport {
  RealTimeRequest request;
  models::PlaybackOptions playback;
  std::int64_t buffer = 0;
  models::Lead lead;           // of GVT over what is shown
  std::int64_t most_lead = 0;  // steps that it has been
  double worst_wake_s = 0.0;   // by which a frame came late because the renderer slept on
  models::PlaybackSummary summary;
  std::vector<models::ShownFrame> frames;
  std::vector<std::vector<models::WorkMark>> work;  // of each thread, or processor
};

// Who executes which world.
kernel::Partition workers_of(const scenarios::Scenario& scenario);

// Throws UsageError for executors that no clock can pace.
void require_paceable(const models::RunOptions& run);

// The renderer of one run: by the wall clock, in a thread of its own from start() to finish(); on
// the virtual cluster by its clock. Over ranks each has a session, and the root's has the renderer:
// the others only need paced().
class RealTimeSession {
 public:
  RealTimeSession(const RealTimeRequest& request, const models::ArtificialLoad& load,
                  const scenarios::Scenario& scenario);
  ~RealTimeSession();

  // `scenario.run`, paced by this session, which must outlive the run.
  models::RunOptions paced(const models::RunOptions& run);
  // For each committed step, with states.
  void add(const models::CommittedStep& step) { buffer_.add(step); }
  void start();
  // The run is over: shows what is left.
  RealTimeReport finish();

 private:
  const bool is_root_;
  RealTimeReport report_;
  models::BufferInterface buffer_;
  std::unique_ptr<StepLoad> load_;                       // by the wall clock
  std::unique_ptr<models::VirtualPlayback> by_virtual_;  // or by the virtual one
  std::atomic<bool> run_ended_{false};
  std::thread renderer_;
};

// Text: counts and a diagram of the fill over time.
std::string real_time_text(const RealTimeReport& report);

}  // namespace soda::analysis
