#include "analysis/groups/groups_sweep.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "analysis/groups/paper_scene.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::analysis {
namespace {

constexpr double kNothingKnown = std::numeric_limits<double>::quiet_NaN();

struct OneSeed {
  GroupShares shares{};
  double largest = 0.0, others = 0.0;
};

std::vector<models::WorldId> owners_in(const models::TerritoryMap& map,
                                       const std::vector<physics::Vec3>& centres) {
  std::vector<models::WorldId> owners;
  owners.reserve(centres.size());
  for (const physics::Vec3& centre : centres) owners.push_back(map.owner_at(centre));
  return owners;
}

OneSeed groups_of_seed(const SweepPoint& point, std::uint64_t seed) {
  const std::vector<physics::Vec3> centres = paper_bodies(point.bodies, seed);
  const std::vector<physics::Aabb> boxes = paper_boxes(centres);
  const models::TerritoryMap map =
      models::make_territory_map(paper_territory(point.worlds, point.map, seed), centres);
  const std::vector<models::WorldId> owners = owners_in(map, centres);
  SyncGroups groups(point.worlds);
  if (point.bond == GroupBond::kOverlap) {
    bond_by_overlap(boxes, owners, map, groups);
  } else {
    std::vector<physics::IndexPair> pairs;
    physics::StageCounters uncounted;
    physics::find_pairs(physics::Broadphase::kGrid, boxes, pairs, uncounted);
    for (const physics::IndexPair& pair : pairs)
      groups.bond(owners[pair.first], owners[pair.second]);
  }
  OneSeed one{groups.shares(), 0.0, 0.0};
  const std::vector<std::uint32_t> sizes = groups.sizes();
  const double left = static_cast<double>(point.worlds) - sizes[0];
  one.largest = sizes[0] / static_cast<double>(point.worlds);
  for (std::size_t i = 1; i < sizes.size(); ++i)
    one.others += static_cast<double>(sizes[i]) * sizes[i] / left;
  return one;
}

// In double throughout: with its long doubles Boost fails before main() where these are emulated by
// shorter ones, as under Valgrind.
using StudentsT = boost::math::students_t_distribution<
    double, boost::math::policies::policy<boost::math::policies::promote_double<false>>>;

template <class Value>
MeanOfSeeds mean_of(const std::vector<OneSeed>& seeds, Value value) {
  const auto count = static_cast<double>(seeds.size());
  double sum = 0.0, squares = 0.0;
  for (const OneSeed& seed : seeds) sum += value(seed);
  const double mean = sum / count;
  for (const OneSeed& seed : seeds) squares += (value(seed) - mean) * (value(seed) - mean);
  if (seeds.size() < 2) return {mean, kNothingKnown};
  const double quantile = boost::math::quantile(StudentsT(count - 1.0), 0.975);
  return {mean, quantile * std::sqrt(squares / (count - 1.0) / count)};
}

SweepResult result_of(const SweepPoint& point, const std::vector<OneSeed>& seeds) {
  SweepResult result{.point = point,
                     .shares = {},
                     .largest = mean_of(seeds, [](const OneSeed& s) { return s.largest; }),
                     .others = mean_of(seeds, [](const OneSeed& s) { return s.others; }),
                     .most_points_off = point.known == nullptr ? kNothingKnown : 0.0,
                     .points_beyond_chance = point.known == nullptr ? kNothingKnown : 0.0};
  for (std::size_t k = 0; k < kGroupClasses; ++k) {
    result.shares[k] = mean_of(seeds, [k](const OneSeed& s) { return s.shares[k]; });
    if (point.known == nullptr) continue;
    const double off = std::abs(100.0 * result.shares[k].mean - point.known->per_cent[k]);
    result.most_points_off = std::max(result.most_points_off, off);
    const double chance = 100.0 * result.shares[k].half_width;
    result.points_beyond_chance = std::max(result.points_beyond_chance, off - chance);
  }
  return result;
}

}  // namespace

const char* name_of(GroupBond bond) {
  constexpr const char* kNames[] = {"overlap", "contact", "rollbacks"};
  return kNames[static_cast<std::size_t>(bond)];
}

const char* name_of(models::MapKind map) {
  constexpr const char* kNames[] = {"blocks", "k-means", "paper", "statics"};
  return kNames[static_cast<std::size_t>(map)];
}

std::vector<SweepResult> sweep_groups(const std::vector<SweepPoint>& points, const SeedRange& seeds,
                                      const std::function<void(std::size_t)>& on_point) {
  std::vector<SweepResult> results;
  for (const SweepPoint& point : points) {
    on_point(results.size());
    std::vector<OneSeed> all;
    for (std::uint64_t seed = seeds.first;; ++seed) {
      all.push_back(groups_of_seed(point, seed));
      if (seed == seeds.last) break;
    }
    results.push_back(result_of(point, all));
  }
  return results;
}

std::int64_t measured_threshold(const std::vector<SweepResult>& series) {
  const auto most = std::ranges::max_element(
      series, {}, [](const SweepResult& result) { return result.others.mean; });
  return most->point.bodies;
}

}  // namespace soda::analysis
