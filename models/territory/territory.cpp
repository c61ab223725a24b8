#include "models/territory/territory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <limits>

#include "kernel/api/hash_mix.hpp"
#include "models/territory/paper_map.hpp"
#include "models/territory/static_map.hpp"

namespace soda::models {
namespace {

// A box of cells [low, high) still to be divided among worlds first_world .. first_world + worlds.
struct Block {
  std::array<std::int32_t, 3> low, high;
  std::uint32_t first_world, worlds;
};

std::int64_t volume(const Block& part) {
  std::int64_t cells = 1;
  for (int axis = 0; axis < 3; ++axis) cells *= part.high[axis] - part.low[axis];
  return cells;
}

// Cuts across the longest axis, worlds in proportion to cells as far as whole layers allow, and
// never more worlds than cells on either side.
std::array<Block, 2> bisect(const Block& part) {
  int axis = 0;
  for (int candidate = 1; candidate < 3; ++candidate) {
    if (part.high[candidate] - part.low[candidate] > part.high[axis] - part.low[axis]) {
      axis = candidate;
    }
  }
  const std::int64_t length = part.high[axis] - part.low[axis];
  const std::int64_t layer = volume(part) / length;
  const std::int64_t worlds = part.worlds;
  std::int64_t lower_worlds = worlds / 2;
  const std::int64_t cut =
      std::clamp<std::int64_t>((2 * length * lower_worlds + worlds) / (2 * worlds), 1, length - 1);
  lower_worlds = std::clamp<std::int64_t>(
      lower_worlds, std::max<std::int64_t>(1, worlds - (length - cut) * layer),
      std::min(worlds - 1, cut * layer));
  Block lower = part, upper = part;
  lower.high[axis] = upper.low[axis] = part.low[axis] + static_cast<std::int32_t>(cut);
  lower.worlds = static_cast<std::uint32_t>(lower_worlds);
  upper.first_world += lower.worlds;
  upper.worlds -= lower.worlds;
  return {lower, upper};
}

std::vector<WorldId> block_owners(const Grid& grid, std::uint32_t worlds) {
  std::vector<WorldId> owners(grid.cell_count(), WorldId{0});
  std::vector<Block> open{{{0, 0, 0}, grid.cells, 0, worlds}};
  while (!open.empty()) {
    const Block part = open.back();
    open.pop_back();
    if (part.worlds > 1) {
      for (const Block& half : bisect(part)) open.push_back(half);
      continue;
    }
    for (std::int32_t x = part.low[0]; x < part.high[0]; ++x)
      for (std::int32_t y = part.low[1]; y < part.high[1]; ++y)
        for (std::int32_t z = part.low[2]; z < part.high[2]; ++z)
          owners[grid.index_of_cell({x, y, z})] = WorldId{part.first_world};
  }
  return owners;
}

struct Point2 {
  double x = 0.0, y = 0.0;
};

double manhattan(const Point2& a, const Point2& b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y);
}

// Each cluster takes at most ceil(n / clusters) points, the globally nearest (point, cluster)
// combinations first.
std::vector<std::uint32_t> assign_equal_size(const std::vector<Point2>& points,
                                             const std::vector<Point2>& centers) {
  struct Choice {
    double distance;
    std::uint32_t point, cluster;
  };
  std::vector<Choice> choices;
  choices.reserve(points.size() * centers.size());
  for (std::uint32_t p = 0; p < points.size(); ++p)
    for (std::uint32_t c = 0; c < centers.size(); ++c)
      choices.push_back({manhattan(points[p], centers[c]), p, c});
  std::sort(choices.begin(), choices.end(), [](const Choice& a, const Choice& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.point != b.point ? a.point < b.point : a.cluster < b.cluster;
  });
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  const std::size_t capacity = (points.size() + centers.size() - 1) / centers.size();
  std::vector<std::uint32_t> cluster_of(points.size(), kNone);
  std::vector<std::size_t> size(centers.size(), 0);
  for (const Choice& choice : choices) {
    if (cluster_of[choice.point] != kNone || size[choice.cluster] == capacity) continue;
    cluster_of[choice.point] = choice.cluster;
    ++size[choice.cluster];
  }
  return cluster_of;
}

std::vector<std::uint32_t> equal_size_kmeans(const std::vector<Point2>& points,
                                             std::uint32_t clusters, std::uint64_t seed) {
  constexpr int kIterations = 12;
  std::vector<Point2> centers(clusters);
  kernel::SplitMix64 random(seed);
  for (Point2& center : centers) center = points[random.below(points.size())];
  std::vector<std::uint32_t> cluster_of;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    cluster_of = assign_equal_size(points, centers);
    std::vector<Point2> sum(clusters);
    std::vector<double> count(clusters, 0.0);
    for (std::size_t p = 0; p < points.size(); ++p) {
      sum[cluster_of[p]].x += points[p].x;
      sum[cluster_of[p]].y += points[p].y;
      count[cluster_of[p]] += 1.0;
    }
    for (std::uint32_t c = 0; c < clusters; ++c)
      if (count[c] > 0.0) centers[c] = {sum[c].x / count[c], sum[c].y / count[c]};
  }
  return cluster_of;
}

// Columns (all cells of one x, y) go to the cluster of the nearest column with a body: a breadth
// first search from all of them at once, which is the Manhattan metric. Ties: the earlier body.
std::vector<WorldId> kmeans_owners(const Grid& grid, std::uint32_t worlds, std::uint64_t seed,
                                   std::span<const physics::Vec3> positions) {
  std::vector<Point2> points;
  for (const physics::Vec3& position : positions) points.push_back({position.x(), position.y()});
  const std::vector<std::uint32_t> cluster_of = equal_size_kmeans(points, worlds, seed);

  const std::int32_t nx = grid.cells[0], ny = grid.cells[1];
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> column_owner(static_cast<std::size_t>(nx) * ny, kNone);
  const auto column = [ny](std::int32_t x, std::int32_t y) {
    return static_cast<std::size_t>(x) * ny + y;
  };
  std::deque<std::array<std::int32_t, 2>> frontier;
  const auto reach = [&](std::int32_t x, std::int32_t y, std::uint32_t owner) {
    if (x < 0 || x >= nx || y < 0 || y >= ny || column_owner[column(x, y)] != kNone) return;
    column_owner[column(x, y)] = owner;
    frontier.push_back({x, y});
  };
  for (std::size_t body = 0; body < positions.size(); ++body) {
    const std::array<std::int32_t, 3> cell = grid.cell_of(positions[body]);
    reach(cell[0], cell[1], cluster_of[body]);
  }
  while (!frontier.empty()) {
    const auto [x, y] = frontier.front();
    frontier.pop_front();
    const std::uint32_t owner = column_owner[column(x, y)];
    reach(x - 1, y, owner);
    reach(x + 1, y, owner);
    reach(x, y - 1, owner);
    reach(x, y + 1, owner);
  }
  std::vector<WorldId> owners(grid.cell_count());
  for (std::int32_t x = 0; x < nx; ++x)
    for (std::int32_t y = 0; y < ny; ++y)
      for (std::int32_t z = 0; z < grid.cells[2]; ++z)
        owners[grid.index_of_cell({x, y, z})] = WorldId{column_owner[column(x, y)]};
  return owners;
}

// Also takes infinities and NaN to a cell: speculative states can be absurd.
std::int32_t clamped_cell(double offset_cells, std::int32_t cells) {
  if (!(offset_cells > 0.0)) return 0;
  if (offset_cells >= static_cast<double>(cells)) return cells - 1;
  return static_cast<std::int32_t>(offset_cells);
}

// Deeper cells need not be told apart: a body that spans more is rare.
constexpr std::uint8_t kDeepest = 6;

// Of each cell, the best value among it and its neighbours, diagonal ones included. What is best of
// a cube is best of the best of its rows: one axis at a time.
template <class T, class Best>
std::vector<T> around(const Grid& grid, std::vector<T> values, Best best) {
  std::vector<T> next(values.size());
  std::size_t stride = 1;  // between neighbours along the axis
  for (int axis = 2; axis >= 0; --axis) {
    const auto length = static_cast<std::size_t>(grid.cells[axis]);
    for (std::size_t row = 0; row < values.size(); row += length * stride) {
      for (std::size_t k = 0; k < length; ++k) {
        const std::size_t at = row + k * stride;
        const std::size_t before = k == 0 ? at : at - stride;
        const std::size_t after = k + 1 == length ? at : at + stride;
        for (std::size_t i = 0; i < stride; ++i)
          next[at + i] = best(values[at + i], best(values[before + i], values[after + i]));
      }
    }
    std::swap(values, next);
    stride *= length;
  }
  return values;
}

}  // namespace

std::size_t Grid::cell_count() const {
  return static_cast<std::size_t>(cells[0]) * cells[1] * cells[2];
}

std::array<std::int32_t, 3> Grid::cell_of(const physics::Vec3& point) const {
  std::array<std::int32_t, 3> cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = clamped_cell((point[axis] - origin_m[axis]) / cell_size_m, cells[axis]);
  }
  return cell;
}

std::size_t Grid::index_of_cell(const std::array<std::int32_t, 3>& cell) const {
  return (static_cast<std::size_t>(cell[0]) * cells[1] + cell[1]) * cells[2] + cell[2];
}

TerritoryMap::TerritoryMap(Grid grid, std::uint32_t worlds, std::vector<WorldId> owner_of_cell)
    : grid_(std::move(grid)), worlds_(worlds), owner_of_cell_(std::move(owner_of_cell)) {
  if (worlds_ == 1) return;  // no borders, and nobody asks
  const auto lower = [](auto a, auto b) { return std::min(a, b); };
  const auto higher = [](auto a, auto b) { return std::max(a, b); };
  const std::vector<WorldId> lowest = around(grid_, owner_of_cell_, lower);
  const std::vector<WorldId> highest = around(grid_, owner_of_cell_, higher);
  depth_.resize(owner_of_cell_.size());
  for (std::size_t cell = 0; cell < depth_.size(); ++cell)
    depth_[cell] = lowest[cell] == highest[cell] ? kDeepest : 0;
  for (std::uint8_t reached = 1; reached < kDeepest; ++reached) {
    const std::vector<std::uint8_t> next = around(grid_, depth_, lower);
    for (std::size_t cell = 0; cell < depth_.size(); ++cell)
      depth_[cell] = std::min<std::uint8_t>(depth_[cell], next[cell] + 1);
  }
}

bool TerritoryMap::is_inland(const physics::Aabb& box, WorldId world, physics::Aabb& around) const {
  const std::array<std::int32_t, 3> low = grid_.cell_of(box.min), high = grid_.cell_of(box.max);
  const std::size_t cell = grid_.index_of_cell(low);
  const std::int32_t depth = depth_[cell];
  // Closer cells than the nearest one at the border have the owner of this one.
  for (int axis = 0; axis < 3; ++axis)
    if (high[axis] - low[axis] >= depth) return false;
  if (owner_of_cell_[cell] != world) return false;
  around = box;
  physics::Aabb wide;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t last = grid_.cells[axis] - 1;
    const double size = grid_.cell_size_m, origin = grid_.origin_m[axis];
    wide.min[axis] = origin + (std::max(low[axis] - depth + 1, 0) + 0.25) * size;
    wide.max[axis] = origin + (std::min(low[axis] + depth - 1, last) + 0.75) * size;
  }
  // Cells grow with coordinates, so what lies between two points lies between their cells. Points
  // far from the origin can be rounded out of the cell that was meant.
  const std::array<std::int32_t, 3> first = grid_.cell_of(wide.min), end = grid_.cell_of(wide.max);
  for (int axis = 0; axis < 3; ++axis)
    if (first[axis] <= low[axis] - depth || end[axis] >= low[axis] + depth) return true;
  around = wide;
  return true;
}

bool TerritoryMap::border_cells_of(const physics::Aabb& box, WorldId world,
                                   std::vector<std::uint32_t>& out) const {
  out.clear();
  bool all = true;
  const std::array<std::int32_t, 3> low = grid_.cell_of(box.min), high = grid_.cell_of(box.max);
  for (std::int32_t x = low[0]; x <= high[0]; ++x)
    for (std::int32_t y = low[1]; y <= high[1]; ++y) {
      const std::size_t row = grid_.index_of_cell({x, y, 0});
      for (std::int32_t z = low[2]; z <= high[2]; ++z) {
        const std::size_t cell = row + static_cast<std::size_t>(z);
        if (owner_of_cell_[cell] != world) continue;
        if (depth_[cell] == 0)
          out.push_back(static_cast<std::uint32_t>(cell));
        else
          all = false;
      }
    }
  return all;
}

WorldId TerritoryMap::owner_at(const physics::Vec3& point) const {
  return owner_of_cell_[grid_.index_of_cell(grid_.cell_of(point))];
}

void TerritoryMap::owners_of(const physics::Aabb& box, std::vector<WorldId>& out) const {
  out.clear();
  const std::array<std::int32_t, 3> low = grid_.cell_of(box.min), high = grid_.cell_of(box.max);
  for (std::int32_t x = low[0]; x <= high[0]; ++x)
    for (std::int32_t y = low[1]; y <= high[1]; ++y) {
      const std::size_t row = grid_.index_of_cell({x, y, 0});
      for (std::int32_t z = low[2]; z <= high[2]; ++z) {
        const WorldId owner = owner_of_cell_[row + z];
        const auto place = std::lower_bound(out.begin(), out.end(), owner);
        if (place == out.end() || *place != owner) out.insert(place, owner);
      }
    }
}

TerritoryMap TerritoryMap::after(std::span<const CellTransfer> transfers) const {
  std::vector<WorldId> owners = owner_of_cell_;
  for (const CellTransfer& transfer : transfers) owners[transfer.cell] = transfer.to;
  return {grid_, worlds_, std::move(owners)};
}

TerritoryMap make_territory_map(const TerritoryOptions& options,
                                std::span<const physics::Vec3> body_positions_m,
                                const physics::SceneDescription* scene) {
  if (options.map == MapKind::kStatics && scene != nullptr)
    return make_static_map(options.grid, options.worlds, *scene);
  if (options.map == MapKind::kPaper && !body_positions_m.empty())
    return make_paper_map(options.grid, options.worlds, options.seed, body_positions_m);
  const bool cluster = options.map == MapKind::kKMeans && !body_positions_m.empty();
  return {options.grid, options.worlds,
          cluster ? kmeans_owners(options.grid, options.worlds, options.seed, body_positions_m)
                  : block_owners(options.grid, options.worlds)};
}

}  // namespace soda::models
