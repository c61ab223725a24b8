#include "models/territory/paper_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <vector>

#include "kernel/api/hash_mix.hpp"

namespace soda::models {
namespace {

constexpr int kPaperIterations = 12;
constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

struct Spot {
  double x = 0.0, y = 0.0;
};

double manhattan_m(const Spot& a, const Spot& b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y);
}

// What cluster `c` gets of `items` that are shared out among `clusters`.
std::size_t share_of(std::size_t items, std::size_t clusters, std::size_t c) {
  return items * (c + 1) / clusters - items * c / clusters;
}

// Bodies at different places, as far as there are enough: the first of a shuffle.
std::vector<Spot> first_centres(std::vector<Spot> bodies, std::uint32_t clusters,
                                std::uint64_t seed) {
  kernel::SplitMix64 random(seed);
  const std::size_t drawn = std::min<std::size_t>(clusters, bodies.size());
  for (std::size_t i = 0; i < drawn; ++i)
    std::swap(bodies[i], bodies[i + random.below(bodies.size() - i)]);
  std::vector<Spot> centres;
  for (std::uint32_t c = 0; c < clusters; ++c) centres.push_back(bodies[c % drawn]);
  return centres;
}

// Cluster after cluster takes its share of what is free, the nearest first.
std::vector<std::uint32_t> fill_in_turn(const std::vector<Spot>& items,
                                        const std::vector<Spot>& centres) {
  using Choice = std::pair<double, std::uint32_t>;
  std::vector<std::uint32_t> cluster_of(items.size(), kFree);
  std::vector<Choice> free;
  for (std::size_t c = 0; c < centres.size(); ++c) {
    free.clear();
    for (std::uint32_t i = 0; i < items.size(); ++i)
      if (cluster_of[i] == kFree) free.emplace_back(manhattan_m(items[i], centres[c]), i);
    const auto taken =
        free.begin() + static_cast<std::ptrdiff_t>(share_of(items.size(), centres.size(), c));
    std::nth_element(free.begin(), taken, free.end());
    for (auto it = free.begin(); it != taken; ++it)
      cluster_of[it->second] = static_cast<std::uint32_t>(c);
  }
  return cluster_of;
}

void move_to_means(const std::vector<Spot>& items, const std::vector<std::uint32_t>& cluster_of,
                   std::vector<Spot>& centres) {
  std::vector<Spot> sum(centres.size());
  std::vector<double> count(centres.size(), 0.0);
  for (std::size_t i = 0; i < items.size(); ++i) {
    Spot& mine = sum[cluster_of[i]];
    mine = {mine.x + items[i].x, mine.y + items[i].y};
    count[cluster_of[i]] += 1.0;
  }
  for (std::size_t c = 0; c < centres.size(); ++c)
    if (count[c] > 0.0) centres[c] = {sum[c].x / count[c], sum[c].y / count[c]};
}

// The nearest of all pairs of an item and a cluster that has not its share yet comes first. Items
// whose cluster has filled up meanwhile queue again for the next one, so that not all pairs need be
// kept.
std::vector<std::uint32_t> fill_by_distance(const std::vector<Spot>& items,
                                            const std::vector<Spot>& centres) {
  using Choice = std::tuple<double, std::uint32_t, std::uint32_t>;  // distance, item, cluster
  std::vector<std::size_t> left;
  for (std::size_t c = 0; c < centres.size(); ++c)
    left.push_back(share_of(items.size(), centres.size(), c));
  std::priority_queue<Choice, std::vector<Choice>, std::greater<>> queue;
  const auto enqueue = [&](std::uint32_t item) {
    Choice best{std::numeric_limits<double>::infinity(), item, kFree};
    for (std::uint32_t c = 0; c < centres.size(); ++c)
      if (left[c] > 0) best = std::min(best, Choice{manhattan_m(items[item], centres[c]), item, c});
    queue.push(best);
  };
  for (std::uint32_t i = 0; i < items.size(); ++i) enqueue(i);
  std::vector<std::uint32_t> cluster_of(items.size(), kFree);
  while (!queue.empty()) {
    const auto [distance, item, cluster] = queue.top();
    queue.pop();
    if (left[cluster] == 0) {
      enqueue(item);
      continue;
    }
    cluster_of[item] = cluster;
    --left[cluster];
  }
  return cluster_of;
}

std::vector<Spot> columns_of(const Grid& grid) {
  std::vector<Spot> columns;
  for (std::int32_t x = 0; x < grid.cells[0]; ++x)
    for (std::int32_t y = 0; y < grid.cells[1]; ++y)
      columns.push_back({grid.origin_m.x() + (x + 0.5) * grid.cell_size_m,
                         grid.origin_m.y() + (y + 0.5) * grid.cell_size_m});
  return columns;
}

}  // namespace

TerritoryMap make_paper_map(const Grid& grid, std::uint32_t worlds, std::uint64_t seed,
                            std::span<const physics::Vec3> body_positions_m) {
  const std::vector<Spot> columns = columns_of(grid);
  if (columns.size() < worlds) return make_territory_map({grid, worlds, MapKind::kBlocks}, {});
  std::vector<Spot> bodies;
  for (const physics::Vec3& position : body_positions_m)
    bodies.push_back({position.x(), position.y()});
  std::vector<Spot> centres = first_centres(bodies, worlds, seed);
  for (int iteration = 0; iteration < kPaperIterations; ++iteration)
    move_to_means(bodies, fill_in_turn(bodies, centres), centres);

  const std::vector<std::uint32_t> world_of = fill_by_distance(columns, centres);
  const auto height = static_cast<std::size_t>(grid.cells[2]);
  std::vector<WorldId> owners;
  owners.reserve(grid.cell_count());
  for (const std::uint32_t world : world_of) owners.insert(owners.end(), height, WorldId{world});
  return {grid, worlds, std::move(owners)};
}

}  // namespace soda::models
