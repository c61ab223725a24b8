// A load that is added to what steps cost, to see what buffers do about it.
#pragma once

#include <cstdint>
#include <vector>

#include "models/territory/territory.hpp"

namespace soda::models {

// Instead of the base, for a time; times since the first frame.
struct LoadPeak {
  std::vector<WorldId> worlds;  // empty: all
  double from_s = 0.0;
  double for_s = 0.0;  // may be infinite
  double load = 0.0;
};

// What a step of each world costs more, as a fraction of the wall time that a step has; so 1 is
// what one processor can just bear. Where peaks overlap, the last one counts.
struct ArtificialLoad {
  double base = 0.0;  // >= 0
  std::vector<LoadPeak> peaks = {};
};

// What a worker has worked in all, when a world of it has written an entry.
struct WorkMark {
  double since_s = 0.0;  // since the first frame; < 0: before it
  double worked_s = 0.0;
};

// `since_s` < 0: before the first frame, when there is no peak.
double load_of(const ArtificialLoad& load, WorldId world, double since_s);

// From second to second another world of `worlds`, drawn by `seed`, has a peak of `load`, until
// `until_s`.
std::vector<LoadPeak> wandering_peak(std::uint32_t worlds, double load, double until_s,
                                     std::uint64_t seed);

}  // namespace soda::models
