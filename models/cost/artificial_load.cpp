#include "models/cost/artificial_load.hpp"

#include <algorithm>

#include "kernel/api/hash_mix.hpp"

namespace soda::models {

double load_of(const ArtificialLoad& load, WorldId world, double since_s) {
  double now = load.base;
  for (const LoadPeak& peak : load.peaks) {
    const bool is_its = peak.worlds.empty() || std::ranges::count(peak.worlds, world) > 0;
    if (is_its && since_s >= peak.from_s && since_s - peak.from_s < peak.for_s) now = peak.load;
  }
  return now;
}

std::vector<LoadPeak> wandering_peak(std::uint32_t worlds, double load, double until_s,
                                     std::uint64_t seed) {
  kernel::SplitMix64 random(seed);
  std::vector<LoadPeak> peaks;
  for (double from_s = 1.0; from_s < until_s; from_s += 1.0)
    peaks.push_back({{WorldId{static_cast<std::uint32_t>(random.below(worlds))}},
                     from_s,
                     std::min(1.0, until_s - from_s),
                     load});
  return peaks;
}

}  // namespace soda::models
