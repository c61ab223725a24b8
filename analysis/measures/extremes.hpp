// One box at rest on a plane, over the whole product of sizes, steps, distances from the origin and
// masses: it must neither move nor fail.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace soda::analysis {

struct ExtremeSetting {
  double size_m = 1.0;  // edge of the box
  double dt_s = 1.0 / 60.0;
  double offset_m = 0.0;  // of box and plane from the origin, along each axis
  double mass_kg = 1.0;
};

struct ExtremeRun {
  ExtremeSetting setting;
  std::int64_t steps = 0;
  double displacement_rel = 0.0;  // largest of any corner at any step, over the size
  std::string fault;              // of the first step that had one; empty: none
};

inline constexpr double kExtremesMust = 1e-3, kExtremesStretch = 1e-6;

struct ExtremesReport {
  std::vector<ExtremeRun> runs;

  // Runs with a fault, or with a displacement that is no number or above this.
  std::size_t beyond(double displacement_rel) const;
};

// 7 sizes x 5 steps x 4 offsets x 7 masses.
std::vector<ExtremeSetting> extreme_settings();

// Each for 2 s, and for 100 steps at least; under 9.81 m/s^2, friction 0.5.
ExtremesReport measure_extremes(std::span<const ExtremeSetting> settings);

// A line for each size and offset, a column for each step: the worst over all masses.
std::string extremes_text(const ExtremesReport& report);

}  // namespace soda::analysis
