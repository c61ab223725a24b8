// The load of each processor under a division of space that changes.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "models/load_balancing/load_balancer.hpp"
#include "models/territory/territory_shape.hpp"

namespace soda::models {

// `picture` and `processor_of` must outlive it.
class Loads {
 public:
  Loads(const LoadPicture& picture, const TerritoryMap& map,
        std::span<const std::uint32_t> processor_of, const BalancerOptions& options);

  const Territories& territories() const { return territories_; }
  std::uint32_t processor_of(WorldId world) const { return processor_of_[index_of(world)]; }
  double of_world(WorldId world) const { return load_[processor_of(world)]; }
  double mean() const { return mean_; }  // over processors, at the start
  // Whether a processor shares an island with another one.
  bool shares_island(WorldId world) const { return shared_[processor_of(world)] > 0; }
  std::span<const std::uint32_t> islands_in(std::uint32_t cell) const;
  const LoadPicture& picture() const { return picture_; }

  // By how much the sum of the processors' squared loads (ns^2) would fall if `cells`, all of one
  // owner, went to the world `to`. Negative if it would rise. Loads stay as they are.
  double gain(std::span<const std::uint32_t> cells, WorldId to);
  // Gives `cells` of `from` to `to` if both territories stay in one piece; whether they do.
  bool move(std::span<const std::uint32_t> cells, WorldId from, WorldId to);

 private:
  using Parts = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  // (processor, cells)

  void add(std::uint32_t processor, double ns);
  void add_island(std::uint32_t island, int sign);
  void add_borders(std::uint32_t cell, double sign);
  void count_part(std::uint32_t island, std::uint32_t processor, bool more);
  void give(std::uint32_t cell, WorldId to);

  const LoadPicture& picture_;
  const std::span<const std::uint32_t> processor_of_;
  const BalancerOptions& options_;
  Territories territories_;
  std::vector<std::vector<std::uint32_t>> islands_in_;  // of each cell
  std::vector<Parts> parts_;                            // of each island
  std::vector<double> load_;                            // of each processor
  std::vector<int> shared_;                             // of each: islands with others
  double squares_ = 0.0;                                // the sum of their squares
  double mean_ = 0.0;
  double face_ns_ = 0.0;  // of a border face, whatever lies there: short borders are better
};

}  // namespace soda::models
