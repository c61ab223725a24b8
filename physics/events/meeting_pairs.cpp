#include "physics/events/meeting_pairs.hpp"

#include <algorithm>
#include <limits>

#include "physics/model/joint.hpp"

namespace soda::physics {
namespace {

// Free flight can change which way a body spins, and how fast: twice is enough for looking.
Aabb path_box(const SceneDescription& scene, const Geometry& geometry, BodyId id,
              const BodyState& state, double share) {
  BodyState moving;
  moving.broken_joints = state.broken_joints;
  moving.position_m = state.position_m;
  moving.orientation = state.orientation;
  moving.linear_velocity_m_s = state.linear_velocity_m_s * share;
  moving.angular_velocity_rad_s = state.angular_velocity_rad_s * (2.0 * share);
  return swept_aabb(scene, geometry, id, moving);
}

std::vector<Aabb> path_boxes(const SceneDescription& scene, const Geometry& geometry,
                             std::span<const BodyId> ids, std::span<const BodyState> states) {
  std::vector<Aabb> boxes;
  boxes.reserve(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i)
    boxes.push_back(path_box(scene, geometry, ids[i], states[i], 1.0));
  return boxes;
}

}  // namespace

MeetingPairs::MeetingPairs(const SceneDescription& scene, const Geometry& geometry,
                           std::span<const BodyId> ids, std::span<const BodyState> states,
                           StageCounters& counters)
    : scene_(scene),
      geometry_(geometry),
      ids_(ids),
      boxes_(path_boxes(scene, geometry, ids, states)),
      of_(ids.size()) {
  for (std::uint32_t i = 0; i < ids.size(); ++i) {
    boxes_.find(boxes_.box(i), found_);
    for (const std::uint32_t j : found_)
      if (j > i && may_touch_unheld(scene, ids[i], ids[j])) add({i, j, false});
  }
  for (std::uint32_t i = 0; i < ids.size(); ++i) add_statics_of(i, counters);
}

std::uint32_t MeetingPairs::add(const MeetingPair& pair) {
  const auto before = [this, &pair](std::uint32_t body) {
    return [this, body](std::uint32_t known, const MeetingPair& p) {
      const MeetingPair& k = pairs_[known];
      if (k.fixed != p.fixed) return p.fixed;
      return k.other(body) < p.other(body);
    };
  };
  const auto at = [&](std::uint32_t body) {
    return std::lower_bound(of_[body].begin(), of_[body].end(), pair, before(body));
  };
  const auto place = at(pair.a);
  if (place != of_[pair.a].end() && pairs_[*place].fixed == pair.fixed &&
      pairs_[*place].other(pair.a) == pair.b)
    return *place;
  const auto index = static_cast<std::uint32_t>(pairs_.size());
  of_[pair.a].insert(place, index);
  if (!pair.fixed) {
    const auto of_other = at(pair.b);
    of_[pair.b].insert(of_other, index);
  }
  pairs_.push_back(pair);
  return index;
}

void MeetingPairs::add_statics_of(std::uint32_t body, StageCounters& counters) {
  find_static_pairs(geometry_, {&boxes_.box(body), 1}, statics_, counters);
  for (const IndexPair& pair : statics_)
    if (may_touch_unheld(scene_, ids_[body], static_id(pair.second)))
      add({body, pair.second, true});
}

bool MeetingPairs::are_near(std::uint32_t pair) const {
  const MeetingPair& p = pairs_[pair];
  return p.fixed || overlap(boxes_.box(p.a), boxes_.box(p.b));
}

void MeetingPairs::redirect(std::uint32_t body, const BodyState& state, double share,
                            StageCounters& counters) {
  boxes_.change(body, path_box(scene_, geometry_, ids_[body], state, share));
  boxes_.find(boxes_.box(body), found_);
  for (const std::uint32_t other : found_)
    if (other != body) {
      const std::uint32_t a = std::min(body, other), b = std::max(body, other);
      if (may_touch_unheld(scene_, ids_[a], ids_[b])) add({a, b, false});
    }
  counters.candidate_pairs += found_.size();
  add_statics_of(body, counters);
}

bool NextPair::Entry::operator<(const Entry& e) const {
  if (time_s != e.time_s) return time_s > e.time_s;
  if (of.fixed != e.of.fixed) return of.fixed;
  return of.a != e.of.a ? of.a > e.of.a : of.b > e.of.b;
}

void NextPair::set(const MeetingPairs& pairs, std::uint32_t pair, double time_s) {
  if (times_.size() < pairs.size()) times_.resize(pairs.size(), kNever);
  if (times_[pair] == time_s) return;
  times_[pair] = time_s;
  if (time_s == kNever) return;
  heap_.push_back({time_s, pairs[pair], pair});
  std::push_heap(heap_.begin(), heap_.end());
}

double NextPair::time_s(std::uint32_t pair) const {
  return pair < times_.size() ? times_[pair] : kNever;
}

double NextPair::first_s() {
  while (!heap_.empty() && heap_.front().time_s != times_[heap_.front().pair]) {
    std::pop_heap(heap_.begin(), heap_.end());
    heap_.pop_back();
  }
  return heap_.empty() ? kNever : heap_.front().time_s;
}

std::uint32_t NextPair::take_first() {
  first_s();
  const std::uint32_t pair = heap_.front().pair;
  times_[pair] = kNever;
  return pair;
}

}  // namespace soda::physics
