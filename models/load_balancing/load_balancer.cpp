#include "models/load_balancing/load_balancer.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "models/cost/work_cost.hpp"
#include "models/load_balancing/loads.hpp"

namespace soda::models {
namespace {

using physics::BodyId;

// Of what is not worth the unrest: gains below this share of the squared mean load.
constexpr double kLeastGain = 0.01;

// Union of bodies in contact; the representative is the smallest id, as an island's label.
class IslandsOfLinks {
 public:
  BodyId label_of(BodyId id) {
    auto place = parent_.find(id);
    if (place == parent_.end()) return id;
    while (place->second != id) {
      id = place->second;
      place = parent_.find(id);
    }
    return id;
  }
  void join(BodyId a, BodyId b) {
    parent_.try_emplace(a, a);
    parent_.try_emplace(b, b);
    const BodyId x = label_of(a), y = label_of(b);
    parent_[std::max(x, y)] = std::min(x, y);
  }

 private:
  std::map<BodyId, BodyId> parent_;
};

// One world's cells and what may be done with them.
struct Candidate {
  std::vector<std::uint32_t> cells;
  double gain = 0.0;
};

// Breadth first from the border with `to` through the territory of `from`: each cell's way there.
std::map<std::uint32_t, std::uint32_t> ways_to_border(const Territories& territories, WorldId from,
                                                      WorldId to) {
  std::map<std::uint32_t, std::uint32_t> previous;
  std::vector<std::uint32_t> frontier;
  std::vector<std::uint32_t> cells(territories.cells_of(from).begin(),
                                   territories.cells_of(from).end());
  std::sort(cells.begin(), cells.end());
  for (const std::uint32_t cell : cells)
    for (const std::uint32_t next : face_neighbours(territories.grid(), cell))
      if (territories.owner(next) == to && previous.try_emplace(cell, cell).second)
        frontier.push_back(cell);
  for (std::size_t done = 0; done < frontier.size(); ++done)
    for (const std::uint32_t next : face_neighbours(territories.grid(), frontier[done]))
      if (territories.owner(next) == from && previous.try_emplace(next, frontier[done]).second)
        frontier.push_back(next);
  return previous;
}

// A cell with the way to it.
std::set<std::uint32_t> with_way(const std::map<std::uint32_t, std::uint32_t>& previous,
                                 std::uint32_t cell) {
  std::set<std::uint32_t> cells;
  while (cells.insert(cell).second) cell = previous.at(cell);
  return cells;
}

// All cells of the sender in which an island of `cell` has bodies, each with its way: the island
// goes as a whole, as far as it is the sender's.
std::set<std::uint32_t> with_islands(const Loads& loads,
                                     const std::map<std::uint32_t, std::uint32_t>& previous,
                                     std::uint32_t cell) {
  std::set<std::uint32_t> cells = with_way(previous, cell);
  for (const std::uint32_t island : loads.islands_in(cell))
    for (const std::uint32_t other : loads.picture().islands[island].cells)
      if (previous.contains(other)) cells.merge(with_way(previous, other));
  return cells;
}

// All cells of the sender within 1, 2, ... steps of the border, as long as they are not more than
// `most`. A single cell of many alike is all corner: its new border would cost more than it gives.
std::vector<std::set<std::uint32_t>> layers(const std::map<std::uint32_t, std::uint32_t>& previous,
                                            std::size_t most) {
  std::vector<std::set<std::uint32_t>> found;
  std::set<std::uint32_t> within;
  while (within.size() < previous.size()) {
    std::set<std::uint32_t> wider = within;
    for (const auto& [cell, way] : previous)
      if (way == cell || within.contains(way)) wider.insert(cell);
    if (wider.size() > most) break;
    within = wider;
    found.push_back(std::move(wider));
  }
  return found;
}

std::vector<Candidate> candidates(Loads& loads, WorldId from, WorldId to, std::size_t most) {
  const auto previous = ways_to_border(loads.territories(), from, to);
  std::set<std::vector<std::uint32_t>> bundles;
  const auto add = [&](const std::set<std::uint32_t>& cells) {
    if (cells.size() <= most) bundles.emplace(cells.begin(), cells.end());
  };
  for (const auto& [cell, way] : previous) {
    const bool at_border = way == cell;
    const bool loaded = loads.picture().cell_ns[cell] > 0;
    if (at_border || loaded) add(with_way(previous, cell));
    if (!loads.islands_in(cell).empty()) add(with_islands(loads, previous, cell));
  }
  for (const std::set<std::uint32_t>& layer : layers(previous, most)) add(layer);
  std::vector<Candidate> out;
  for (const std::vector<std::uint32_t>& cells : bundles) {
    const double gain = loads.gain(cells, to);
    if (gain > kLeastGain * loads.mean() * loads.mean()) out.push_back({cells, gain});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
  return out;
}

class PaperScheme {
 public:
  PaperScheme(const LoadPicture& picture, const TerritoryMap& map,
              std::span<const std::uint32_t> processor_of, const BalancerOptions& options)
      : options_(options), before_(map.owners()), loads_(picture, map, processor_of, options) {}

  std::vector<CellTransfer> decide() {
    std::vector<WorldId> worlds(loads_.territories().worlds());
    for (std::uint32_t i = 0; i < worlds.size(); ++i) worlds[i] = WorldId{i};
    std::stable_sort(worlds.begin(), worlds.end(), [this](WorldId a, WorldId b) {
      return loads_.of_world(a) > loads_.of_world(b);
    });
    for (const WorldId world : worlds) relieve(world);
    return net_transfers();
  }

 private:
  // Who gets a cell may pass it on at once: what counts is who has it in the end.
  std::vector<CellTransfer> net_transfers() const {
    std::vector<CellTransfer> transfers;
    for (std::uint32_t cell = 0; cell < before_.size(); ++cell)
      if (loads_.territories().owner(cell) != before_[cell])
        transfers.push_back({cell, loads_.territories().owner(cell)});
    return transfers;
  }

  // The other processors' worlds beside it, the least loaded first; then the smallest.
  std::vector<WorldId> ranked_neighbours(WorldId world) const {
    std::vector<WorldId> neighbours = loads_.territories().neighbours(world);
    std::erase_if(neighbours, [&](WorldId other) {
      return loads_.processor_of(other) == loads_.processor_of(world);
    });
    const auto rank = [this](WorldId other) {
      return std::pair(loads_.of_world(other), loads_.territories().cells_of(other).size());
    };
    std::stable_sort(neighbours.begin(), neighbours.end(),
                     [&](WorldId a, WorldId b) { return rank(a) < rank(b); });
    return neighbours;
  }

  double mean_around(WorldId world, std::span<const WorldId> neighbours) const {
    double sum = loads_.of_world(world);
    for (const WorldId other : neighbours) sum += loads_.of_world(other);
    return sum / static_cast<double>(1 + neighbours.size());
  }

  // Twice the tolerance for who can wait, half of it for whose store is used up before a decision
  // would help.
  double tolerance(WorldId world) const {
    const double ratio = loads_.of_world(world) / std::max(loads_.mean(), 1.0);
    const double entries = static_cast<double>(loads_.picture().entries[index_of(world)]);
    const double lasts = anticipation_steps(entries, ratio);
    const double urgency = static_cast<double>(options_.delay) / std::max(lasts, 1.0);
    return options_.tolerance / std::clamp(urgency, 0.5, 2.0);
  }

  void relieve(WorldId world) {
    const std::vector<WorldId> neighbours = ranked_neighbours(world);
    const double goal = mean_around(world, neighbours);
    const bool overloaded = loads_.of_world(world) > (1.0 + tolerance(world)) * goal;
    if (!overloaded && !loads_.shares_island(world)) return;
    for (const WorldId to : neighbours) {
      while (moved_ < options_.most_cells && give_best(world, to)) {
        if (loads_.of_world(world) <= goal && !loads_.shares_island(world)) return;
      }
    }
  }

  // False if nothing that `to` could get is worth it.
  bool give_best(WorldId from, WorldId to) {
    const std::size_t room = options_.most_cells - moved_;
    for (const Candidate& candidate : candidates(loads_, from, to, room)) {
      if (!loads_.move(candidate.cells, from, to)) continue;
      moved_ += candidate.cells.size();
      return true;
    }
    return false;
  }

  const BalancerOptions& options_;
  const std::span<const WorldId> before_;
  Loads loads_;
  std::size_t moved_ = 0;
};

}  // namespace

// After N steps the ring has given N entries and received N / r: empty when B + N / r = N.
double anticipation_steps(double entries, double ratio) {
  if (ratio <= 1.0) return std::numeric_limits<double>::infinity();
  return entries * ratio / (ratio - 1.0);
}

LoadPicture picture_of(std::span<const LoadSample> samples, std::size_t cells) {
  LoadPicture picture;
  picture.cell_ns.assign(cells, 0);
  picture.entries.assign(samples.size(), 0);
  IslandsOfLinks links;
  for (const LoadSample& sample : samples) {
    picture.entries[index_of(sample.world)] = sample.entries;
    for (const BodyLink& link : sample.links) links.join(link.a, link.b);
  }
  std::map<BodyId, LoadPicture::Island> islands;
  for (const LoadSample& sample : samples)
    for (const IslandLoad& island : sample.islands) {
      LoadPicture::Island& sum = islands[links.label_of(island.label)];
      sum.solve_ns += island.solve_ns;
      sum.is_shared_out = sum.is_shared_out || island.is_shared_out;
    }
  for (const LoadSample& sample : samples)
    for (const BodyLoad& body : sample.bodies) {
      picture.cell_ns[body.cell] += body.cost_ns / 2;
      picture.cell_ns[body.later] += body.cost_ns / 2;
      const auto island = islands.find(links.label_of(body.id));
      if (island == islands.end()) continue;
      island->second.cells.insert(island->second.cells.end(), {body.cell, body.later});
      island->second.telling_ns += record_cost_ns();
    }
  for (const LoadSample& sample : samples)
    for (const BodyLink& link : sample.links) {
      const auto island = islands.find(links.label_of(link.a));
      if (island != islands.end()) island->second.telling_ns += record_cost_ns();
    }
  for (auto& [label, island] : islands) {
    std::sort(island.cells.begin(), island.cells.end());
    island.cells.erase(std::unique(island.cells.begin(), island.cells.end()), island.cells.end());
    if (!island.cells.empty()) picture.islands.push_back(std::move(island));
  }
  return picture;
}

std::vector<CellTransfer> paper_transfers(const LoadPicture& picture, const TerritoryMap& map,
                                          std::span<const std::uint32_t> processor_of,
                                          const BalancerOptions& options) {
  return PaperScheme(picture, map, processor_of, options).decide();
}

std::vector<CellTransfer> random_transfers(const TerritoryMap& map, std::size_t most,
                                           kernel::SplitMix64& random) {
  Territories territories(map);
  std::vector<CellTransfer> transfers;
  for (std::size_t attempt = 0; attempt < 64 * most && transfers.size() < most; ++attempt) {
    const auto cell = static_cast<std::uint32_t>(random.below(map.owners().size()));
    const FaceNeighbours around = face_neighbours(map.grid(), cell);
    if (around.count == 0) break;
    const WorldId to = territories.owner(around.cells[random.below(around.count)]);
    const WorldId from = territories.owner(cell);
    if (to == from || !territories.give_in_one_piece({&cell, 1}, from, to)) continue;
    transfers.push_back({cell, to});
  }
  return transfers;
}

}  // namespace soda::models
