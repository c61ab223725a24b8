// What is known of the paper's Figures 6 and 7 beforehand, in numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "analysis/groups/sync_groups.hpp"

namespace soda::analysis {

// From an independent Monte Carlo of what ran for the figures, made for this project with other
// code, before this one: in per cent of the worlds, rounded. The paper prints the figures without
// numbers. 500 bodies in 12 worlds are there twice, once for each figure, and differ by up to 7
// points: so much of each row is chance.
struct FigureRow {
  int figure = 6;
  models::MapKind map = models::MapKind::kPaper;
  std::int64_t bodies = 0;
  std::uint32_t worlds = 0;
  std::array<int, kGroupClasses> per_cent{};
};
std::span<const FigureRow> figure_rows();

// Points by which a figure may differ from that of `soda groups --check`.
inline constexpr double kFigurePoints = 5.0;

}  // namespace soda::analysis
