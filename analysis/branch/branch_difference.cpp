#include "analysis/branch/branch_difference.hpp"

#include <algorithm>
#include <limits>

#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

double distance_to_nearest(const physics::Vec3& place, std::span<const physics::Vec3> others) {
  double least = std::numeric_limits<double>::infinity();
  for (const physics::Vec3& other : others) least = std::min(least, (place - other).squaredNorm());
  return std::sqrt(least);
}

}  // namespace

StepDifference BranchDifference::add(const LoggedStep& recorded,
                                     std::span<const physics::BodyId> ids,
                                     std::span<const physics::BodyState> states) {
  StepDifference difference;
  difference.step = recorded.step;
  std::vector<physics::Vec3> places_m;
  std::size_t old = 0, now = 0;
  while (old < recorded.ids.size() || now < ids.size()) {
    const bool is_old =
        now == ids.size() || (old < recorded.ids.size() && recorded.ids[old] <= ids[now]);
    const bool is_new =
        old == recorded.ids.size() || (now < ids.size() && ids[now] <= recorded.ids[old]);
    if (is_old && is_new) {
      const physics::BodyState& before = recorded.states[old];
      if (!physics::identical(before, states[now])) {
        places_m.push_back(states[now].position_m);
        difference.deviation_m =
            std::max(difference.deviation_m, (before.position_m - states[now].position_m).norm());
      }
    } else {
      ++difference.one_side;
      places_m.push_back((is_old ? recorded.states[old] : states[now]).position_m);
    }
    old += is_old ? 1 : 0;
    now += is_new ? 1 : 0;
  }
  difference.bodies = places_m.size();
  if (origins_m_.empty()) origins_m_ = places_m;
  for (const physics::Vec3& place : places_m)
    difference.reach_m = std::max(difference.reach_m, distance_to_nearest(place, origins_m_));
  return difference;
}

}  // namespace soda::analysis
