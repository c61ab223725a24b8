// Networks by name, for the virtual cluster.
#pragma once

#include <span>
#include <string>

#include "analysis/runs/overrides.hpp"

namespace soda::analysis {

struct NetworkPreset {
  const char* name;
  double latency_us;      // of a short message, one way, between two programs
  double bandwidth_mb_s;  // that a processor can send
  const char* source;     // of both figures
};

// From the nearest to the farthest.
std::span<const NetworkPreset> network_presets();

// Throws UsageError for another name.
const NetworkPreset& network_named(const std::string& name);

// What `cluster` does not say itself comes from the preset.
void apply_network(const NetworkPreset& network, ClusterOverrides& cluster);

}  // namespace soda::analysis
