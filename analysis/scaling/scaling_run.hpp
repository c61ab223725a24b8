// What division gains on the virtual cluster: one scene over many worlds, or growing with them.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "analysis/runs/overrides.hpp"
#include "analysis/scaling/networks.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"

namespace soda::analysis {

// What a run is compared with: nobody runs ahead; rollbacks compute all again; worlds whose bodies
// touch do not wait for each other.
enum class Rival { kLockstep, kInvalidate, kUngated };
const char* name_of(Rival rival);

// How to measure.
struct ScalingSetting {
  Overrides overrides;
  bool weak = false;                  // the scene is repeated once a world
  std::vector<std::uint32_t> worlds;  // of each run, one processor each; none: chosen by scene
  std::vector<Rival> rivals;
};

// One number of worlds.
struct ScalingPoint {
  std::uint32_t worlds = 1;
  std::size_t bodies = 0;
  std::int64_t one_processor_ns = 0;  // of the undivided scene, modelled (undivided_run.hpp)
  kernel::VirtualReport cluster;
  bool equal = true;  // every run of the point ended with the bits of the undivided one
  std::vector<std::pair<Rival, std::int64_t>> rivals_ns;  // makespans

  double speed_up() const { return over(cluster.makespan_ns); }
  double speed_up_of(std::int64_t makespan_ns) const { return over(makespan_ns); }
  double efficiency() const { return speed_up() / cluster.processors; }

 private:
  double over(std::int64_t makespan_ns) const {
    return makespan_ns == 0
               ? 0.0
               : static_cast<double>(one_processor_ns) / static_cast<double>(makespan_ns);
  }
};

struct ScalingCurve {
  std::string scenario;
  std::int64_t steps = 0;
  bool weak = false;
  std::vector<ScalingPoint> points;  // by worlds
  std::string left_out;              // why there are no points, or fewer than asked for
};

struct ScalingReport {
  NetworkPreset network;
  double latency_us = 0.0, bandwidth_mb_s = 0.0;  // that were used
  std::vector<ScalingCurve> curves;

  bool all_equal() const;
};

// Of one scenario file. Steps are at most 20 if the setting does not say. Throws as
// load_scenario().
ScalingCurve measure_scaling(const std::string& file, const ScalingSetting& setting);

}  // namespace soda::analysis
