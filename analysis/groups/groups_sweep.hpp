// Synchronisation groups of the paper's scene over numbers of bodies and worlds, by Monte Carlo.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/groups/paper_figures.hpp"
#include "analysis/groups/sync_groups.hpp"
#include "analysis/text/seed_range.hpp"

namespace soda::analysis {

enum class GroupBond { kOverlap, kContact, kRollbacks };
const char* name_of(GroupBond bond);       // as --by
const char* name_of(models::MapKind map);  // as scenario files

struct SweepPoint {
  GroupBond bond = GroupBond::kOverlap;  // not kRollbacks: nothing runs
  models::MapKind map = models::MapKind::kPaper;
  std::int64_t bodies = 0;
  std::uint32_t worlds = 0;
  const FigureRow* known = nullptr;  // null: nothing is
};

// Over seeds, with half the width of the 95 % confidence interval of the mean (Student; NaN of a
// single seed).
struct MeanOfSeeds {
  double mean = 0.0, half_width = 0.0;
};

struct SweepResult {
  SweepPoint point;
  std::array<MeanOfSeeds, kGroupClasses> shares;  // of the worlds, 0 to 1
  MeanOfSeeds largest;                            // share of the worlds in the largest group
  MeanOfSeeds others;  // size of the group of a world that is not in the largest; 0: all are
  // Largest difference of a class from what is known, in points of a per cent, and what is left of
  // it beyond the interval; NaN: nothing is known.
  double most_points_off = 0.0, points_beyond_chance = 0.0;
};

// Bodies in contact are cubes that overlap. `on_point` is told of each point before it begins.
std::vector<SweepResult> sweep_groups(const std::vector<SweepPoint>& points, const SeedRange& seeds,
                                      const std::function<void(std::size_t)>& on_point);

// Where groups of any size appear, in a series over bodies: the number of bodies at which `others`
// is largest. Of points that differ in `bodies` only.
std::int64_t measured_threshold(const std::vector<SweepResult>& series);

}  // namespace soda::analysis
