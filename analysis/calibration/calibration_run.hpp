// Measuring what work costs on this machine, and predictions beside what runs take.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/calibration/machine_costs.hpp"
#include "kernel/api/transport.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// A scene in one way: undivided, or in its worlds on one thread.
struct CalibratedRun {
  std::string scenario;
  std::uint32_t worlds = 1;
  double measured_ns = 0.0, usual_ns = 0.0, fitted_ns = 0.0;
};

struct Calibration {
  MachineCosts costs;
  std::vector<CalibratedRun> runs;
};

// CPU time of the calling thread, the least of `repeat` (>= 1) runs of each scene; the time that
// `processors` threads need at once for what one does alone. Scenes are not to fault.
Calibration calibrate(const std::vector<scenarios::Scenario>& scenes, int repeat,
                      unsigned processors);

// A scene over threads, or over ranks: what the virtual cluster says, and the wall clock.
struct Prediction {
  std::string scenario;
  std::uint32_t worlds = 1;
  unsigned threads = 1;                          // of each rank
  std::uint32_t ranks = 0;                       // 0: without MPI
  double factor = 1.0;                           // of the scene's own work, over the costs
  double predicted_ns = 0.0, measured_ns = 0.0;  // the median of the measured runs
  bool equal = true;                             // both ended with the same bits

  double ratio() const { return predicted_ns / measured_ns; }
};

// What the scene's work takes in its worlds on one thread, over what the costs say of it: counters
// do not tell all. The least time of `repeat` runs, right before the prediction: the speed of a
// machine varies over minutes.
double own_factor(const scenarios::Scenario& scene, const MachineCosts& costs, int repeat);

// `factor`: the scene's own, by which its work is costed. So what is predicted is how the run
// scales. `job` may be null: without MPI. Over ranks all make the same call, and only the root's
// factor and prediction are of use; a worker more than worlds would have nothing to do.
Prediction predict(const scenarios::Scenario& scene, const MachineCosts& costs, double factor,
                   unsigned threads, int repeat, kernel::Transport* job = nullptr);

}  // namespace soda::analysis
