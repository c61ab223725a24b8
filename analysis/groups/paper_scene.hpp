// The scene of the paper's Figures 6 and 7, for any number of bodies and worlds, and what
// percolation says of it.
#pragma once

#include <cstdint>
#include <vector>

#include "models/territory/territory.hpp"

namespace soda::analysis {

// Lengths are in edges of the cubes, of 1 m, as in scenarios/library/twelve-worlds.json; z is up.
inline constexpr double kPaperSide_m = 200.0;  // along x and y
inline constexpr double kPaperHeight_m = 60.0;
inline constexpr double kPaperBody_m = 1.0;

// Centres of cubes anywhere in the space, whether they overlap or not: integer arithmetic and exact
// scaling, so that a seed has the same bits everywhere. The paper's bodies fall five edges in ten
// seconds, so this is the first step for all of them.
std::vector<physics::Vec3> paper_bodies(std::int64_t bodies, std::uint64_t seed);
// Of cubes that are not turned.
std::vector<physics::Aabb> paper_boxes(const std::vector<physics::Vec3>& centres);
models::TerritoryOptions paper_territory(std::uint32_t worlds, models::MapKind map,
                                         std::uint64_t seed);

// Territories as equal cubes, or as equal square columns of the whole height where there would be
// no two layers of cubes or the map knows columns only. Law and threshold are those of an endless
// lattice: near it, and where borders are ragged, groups are larger.
class Percolation {
 public:
  Percolation(std::uint32_t worlds, models::MapKind map);

  bool has_columns() const { return has_columns_; }
  // Mean number of bodies that overlap a face between two territories.
  double bodies_on_face(double bodies) const;
  // Whether any does: 1 - exp(-bodies_on_face).
  double bond_probability(double bodies) const;
  // Share of the worlds that have no bond: those at the walls have fewer faces.
  double alone(double bodies) const;
  // Where groups of any size appear: with bond probabilities of 0.2488 on the cubic lattice, 0.5 on
  // the square one.
  double threshold_bodies() const;

 private:
  double edge_m() const;

  bool has_columns_;
  double worlds_;
};

}  // namespace soda::analysis
