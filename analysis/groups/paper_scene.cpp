#include "analysis/groups/paper_scene.hpp"

#include <cmath>

#include "scenarios/random.hpp"

namespace soda::analysis {
namespace {

constexpr double kBase_m2 = kPaperSide_m * kPaperSide_m;
constexpr double kVolume_m3 = kBase_m2 * kPaperHeight_m;
// Bond percolation: Lorenz and Ziff, Phys. Rev. E 57 (1998); Kesten (1980), exact.
constexpr double kLeastLayers = 1.5;  // rounded two: one layer of cubes is a square lattice
constexpr double kCubicThreshold = 0.2488, kSquareThreshold = 0.5;

}  // namespace

std::vector<physics::Vec3> paper_bodies(std::int64_t bodies, std::uint64_t seed) {
  constexpr double kHalf = 0.5 * kPaperBody_m;
  scenarios::RandomStream stream = scenarios::make_stream(seed, 0);
  std::vector<physics::Vec3> centres;
  for (std::int64_t i = 0; i < bodies; ++i) {
    const double side = 0.5 * kPaperSide_m - kHalf;
    const double x = scenarios::uniform(stream, -side, side);
    const double y = scenarios::uniform(stream, -side, side);
    centres.emplace_back(x, y, scenarios::uniform(stream, kHalf, kPaperHeight_m - kHalf));
  }
  return centres;
}

std::vector<physics::Aabb> paper_boxes(const std::vector<physics::Vec3>& centres) {
  const physics::Vec3 half = physics::Vec3::Constant(0.5 * kPaperBody_m);
  std::vector<physics::Aabb> boxes;
  boxes.reserve(centres.size());
  for (const physics::Vec3& centre : centres) boxes.push_back({centre - half, centre + half});
  return boxes;
}

models::TerritoryOptions paper_territory(std::uint32_t worlds, models::MapKind map,
                                         std::uint64_t seed) {
  models::Grid grid;
  grid.origin_m = physics::Vec3(-0.5 * kPaperSide_m, -0.5 * kPaperSide_m, 0.0);
  grid.cell_size_m = 2.02;
  grid.cells = {99, 99, 29};
  return {.grid = grid, .worlds = worlds, .map = map, .seed = seed};
}

Percolation::Percolation(std::uint32_t worlds, models::MapKind map)
    : has_columns_(map != models::MapKind::kBlocks ||
                   std::cbrt(kVolume_m3 / worlds) * kLeastLayers > kPaperHeight_m),
      worlds_(worlds) {}

double Percolation::edge_m() const {
  return has_columns_ ? std::sqrt(kBase_m2 / worlds_) : std::cbrt(kVolume_m3 / worlds_);
}

// A body overlaps a face if its centre is within half an edge: a layer one edge thick.
double Percolation::bodies_on_face(double bodies) const {
  const double face_m2 = edge_m() * (has_columns_ ? kPaperHeight_m : edge_m());
  return bodies * face_m2 * kPaperBody_m / kVolume_m3;
}

double Percolation::bond_probability(double bodies) const {
  return -std::expm1(-bodies_on_face(bodies));
}

double Percolation::alone(double bodies) const {
  const double edge_m = this->edge_m();
  double faces = 4.0 * (1.0 - edge_m / kPaperSide_m);  // of a territory, towards others
  if (!has_columns_) faces += 2.0 * (1.0 - edge_m / kPaperHeight_m);
  return std::exp(-faces * bodies_on_face(bodies));
}

double Percolation::threshold_bodies() const {
  const double threshold = has_columns_ ? kSquareThreshold : kCubicThreshold;
  return -std::log1p(-threshold) / bodies_on_face(1.0);
}

}  // namespace soda::analysis
