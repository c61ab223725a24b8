#include "physics/broadphase/pair_cache.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/forces/forces.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

constexpr std::size_t kFewest = 64;       // bodies; below, boxes are made and compared at once
constexpr double kLifetime = 10.0;        // steps that a body of usual speed stays in its fat box
constexpr double kLeastSlack = 0.05;      // of the radius: bodies at rest
constexpr double kMostSlack = 4.0;        // of the radius: faster ones are lost
constexpr double kSpare = 1.25;           // of speeds
constexpr double kLeastMove = 0.02;       // radii and radians a step
constexpr double kNotQuiteUnit = 1e-6;    // of an attitude's square
constexpr double kWider = 1.0 + 1e-5;     // covers that, and floats
constexpr double kPlaceRounding = 1e-12;  // of coordinates
constexpr std::size_t kMostLosses = 40;   // in a step; each costs about 1 / 40 of keeping anew
constexpr std::size_t kMostPairs = 16;    // of candidates a body: more are not worth keeping
constexpr int kShortLife = 3, kLeastPause = 8, kMostPause = 512;  // steps

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool is_within(const Vec3& p, const std::array<float, 3>& centre, double slack) {
  return std::abs(p.x() - centre[0]) <= slack && std::abs(p.y() - centre[1]) <= slack &&
         std::abs(p.z() - centre[2]) <= slack;
}

double squared(const Vec3& v) { return v.x() * v.x() + v.y() * v.y() + v.z() * v.z(); }

double squared(const Quat& q) {
  return q.w() * q.w() + q.x() * q.x() + q.y() * q.y() + q.z() * q.z();
}

// A speed that is no number counts as fast.
double finite_root(double square) { return square < 1e30 ? std::sqrt(square) : 1e15; }

}  // namespace

bool PairCache::is_for(const Input& in) const {
  return geometry_ == in.geometry.share() && dt_s_ == in.scene.dt_s &&
         gravity_m_s2_ == in.scene.gravity_m_s2 && std::ranges::equal(ids_, in.ids);
}

inline bool PairCache::keeps_to(const BodyState& state, const Bounds& b) {
  return is_within(state.position_m, b.centre_m, b.slack_m) &&
         squared(state.linear_velocity_m_s) <= b.speed2 &&
         squared(state.angular_velocity_rad_s) <= b.angular_speed2 &&
         squared(state.orientation) <= 1.0 + kNotQuiteUnit;
}

// Where the swept box lies of a body that keeps to its bounds.
Aabb PairCache::fat_box_of(const Bounds& b) {
  const Vec3 centre(b.centre_m[0], b.centre_m[1], b.centre_m[2]);
  const Vec3 half =
      Vec3::Constant((double{b.slack_m} + b.reach_m) * kWider) + centre.cwiseAbs() * kPlaceRounding;
  return b.is_void() ? Aabb{} : Aabb{centre - half, centre + half};
}

PairCache::Near PairCache::near_of(const Vec3& p, float reach_m) {
  constexpr float kFloat = 1e-6f;
  const float x = static_cast<float>(p.x()), y = static_cast<float>(p.y()),
              z = static_cast<float>(p.z());
  return {x, y, z, reach_m * (1.0f + kFloat) + (std::abs(x) + std::abs(y) + std::abs(z)) * kFloat};
}

PairCache::Stretch PairCache::stretch_of(const Aabb& fat_box) {
  constexpr double kFloat = 1e-6;
  const double low = fat_box.min.x(), high = fat_box.max.x();
  return {static_cast<float>(low - std::abs(low) * kFloat),
          static_cast<float>(high + std::abs(high) * kFloat)};
}

// None for a body that would soon be beyond them.
PairCache::Bounds PairCache::bounds_of(const Input& in, std::size_t body) const {
  constexpr double kFarthest = 1e15;  // squares are floats
  const BodyState& state = in.states[body];
  const CompiledShape& shape =
      geometry_->shapes[geometry_->body_shapes[index_of(in.ids[body])]].shape;
  const BodyParams& params = in.scene.bodies[index_of(in.ids[body])];
  const double radius = shape.bounding_radius_m;
  const double fall =
      (field_of(in.scene, params).norm() + most_push_m_s2(in.scene, params)) * dt_s_;
  const double moves = std::max(finite_root(squared(state.linear_velocity_m_s)), usual_speed_m_s_);
  const double turns =
      std::max(finite_root(squared(state.angular_velocity_rad_s)), usual_angular_speed_rad_s_);
  const double least = kLeastMove / dt_s_;
  const double speed = kSpare * moves + kLifetime * fall + least * radius;
  const double angular_speed = 2.0 * turns + least;
  const double slack = kLeastSlack * radius + kLifetime * dt_s_ * (moves + fall);
  const double seen_rad_s = angular_speed + most_twist_rad_s2(in.scene, params) * dt_s_;
  const double reach = radius * (1.0 + std::min(seen_rad_s * dt_s_, 2.0)) +
                       kContactMargin * shape.min_extent_m + (speed + fall) * dt_s_ +
                       kPlaceRounding * state.position_m.cwiseAbs().maxCoeff();
  Bounds bounds;
  if (!(slack <= kMostSlack * radius) || !(reach + speed + angular_speed <= kFarthest))
    return bounds;
  for (int i = 0; i < 3; ++i)
    bounds.centre_m[static_cast<std::size_t>(i)] = static_cast<float>(state.position_m[i]);
  bounds.slack_m = static_cast<float>(slack);
  bounds.speed2 = static_cast<float>(speed * speed);
  bounds.angular_speed2 = static_cast<float>(angular_speed * angular_speed);
  bounds.reach_m = static_cast<float>(reach * kWider);
  return bounds;
}

// The bounds of all bodies, and the pairs whose fat boxes overlap. False: not worth it.
bool PairCache::keep(const Input& in) {
  geometry_ = in.geometry.share();
  dt_s_ = in.scene.dt_s;
  gravity_m_s2_ = in.scene.gravity_m_s2;
  ids_.assign(in.ids.begin(), in.ids.end());
  const auto usual = [&](Vec3 BodyState::*velocity) {
    speeds_.clear();
    for (const BodyState& state : in.states)
      speeds_.push_back(finite_root(squared(state.*velocity)));
    return median(speeds_);
  };
  usual_speed_m_s_ = usual(&BodyState::linear_velocity_m_s);
  usual_angular_speed_rad_s_ = usual(&BodyState::angular_velocity_rad_s);
  bounds_.resize(ids_.size());
  boxes_.resize(ids_.size());
  stretches_.resize(ids_.size());
  near_.resize(ids_.size());
  unbounded_.clear();
  for (std::uint32_t i = 0; i < ids_.size(); ++i) {
    bounds_[i] = bounds_of(in, i);
    if (bounds_[i].is_void() || !keeps_to(in.states[i], bounds_[i])) {
      bounds_[i] = {};
      unbounded_.push_back(i);
    }
    boxes_[i] = fat_box_of(bounds_[i]);
    stretches_[i] = stretch_of(boxes_[i]);
    near_[i] = near_of(in.states[i].position_m, bounds_[i].reach_m);
  }
  if (unbounded_.size() > kMostLosses) return false;
  StageCounters uncounted;
  find_pairs(Broadphase::kGrid, boxes_, candidates_, uncounted);
  std::erase_if(candidates_, [this](const IndexPair& pair) {
    return bounds_[pair.first].is_void() || bounds_[pair.second].is_void();
  });
  age_ = 0;
  return candidates_.size() <= kMostPairs * ids_.size();
}

// Where everybody is, and who is beyond its bounds.
void PairCache::look(const Input& in) {
  lost_.clear();
  near_.resize(in.ids.size());
  for (std::uint32_t i = 0; i < in.ids.size(); ++i) {
    near_[i] = near_of(in.states[i].position_m, bounds_[i].reach_m);
    if (!keeps_to(in.states[i], bounds_[i])) lost_.push_back(i);
  }
}

// New bounds for the lost, and their pairs.
void PairCache::renew(const Input& in) {
  unbounded_.clear();
  if (lost_.empty()) return;
  renewed_.assign(in.ids.size(), 0);
  for (const std::uint32_t lost : lost_) renewed_[lost] = 1;
  std::erase_if(candidates_, [this](const IndexPair& pair) {
    return (renewed_[pair.first] | renewed_[pair.second]) != 0;
  });
  found_.clear();
  for (const std::uint32_t lost : lost_) {
    Bounds& mine = bounds_[lost];
    mine = bounds_of(in, lost);
    renewed_[lost] = 0;  // from now on the other lost ones find it
    if (!mine.is_void() && !keeps_to(in.states[lost], mine)) mine = {};
    near_[lost] = near_of(in.states[lost].position_m, mine.reach_m);
    if (mine.is_void()) {
      unbounded_.push_back(lost);
      continue;
    }
    const Aabb fat_box = fat_box_of(mine);
    const Stretch mine_x = stretches_[lost] = stretch_of(fat_box);
    for (std::uint32_t i = 0; i < in.ids.size(); ++i) {
      if (stretches_[i].to < mine_x.from || mine_x.to < stretches_[i].from) continue;
      const Bounds& other = bounds_[i];
      if (i != lost && renewed_[i] == 0 && !other.is_void() && overlap(fat_box, fat_box_of(other)))
        found_.push_back({std::min(lost, i), std::max(lost, i)});
    }
  }
  merge_found(candidates_);
}

void PairCache::merge_found(std::vector<IndexPair>& pairs) {
  std::sort(found_.begin(), found_.end());
  const auto middle = static_cast<std::ptrdiff_t>(pairs.size());
  pairs.insert(pairs.end(), found_.begin(), found_.end());
  std::inplace_merge(pairs.begin(), pairs.begin() + middle, pairs.end());
}

// Whether what is kept can be used now. If not, keeps anew, unless that was in vain lately.
bool PairCache::is_kept(const Input& in) {
  if (pause_ > 0) {
    --pause_;
    return false;
  }
  const bool is_old = geometry_ != nullptr;
  if (is_old && is_for(in)) {
    look(in);
    if (lost_.size() <= kMostLosses) {
      ++age_;
      renew(in);
      return candidates_.size() <= 2 * kMostPairs * ids_.size();
    }
  }
  if (is_old && age_ >= kShortLife) next_pause_ = kLeastPause;
  if ((!is_old || age_ >= kShortLife) && keep(in)) return true;
  geometry_ = nullptr;
  pause_ = next_pause_;
  next_pause_ = std::min(2 * next_pause_, kMostPause);
  return false;
}

// Candidates whose boxes may overlap now, in found_. Without branches: many are near, many are not.
void PairCache::choose_near() {
  wanted_.assign(ids_.size(), 0);
  found_.resize(candidates_.size());
  std::size_t count = 0;
  for (const IndexPair& pair : candidates_) {
    const Near &a = near_[pair.first], &b = near_[pair.second];
    const float reach = a.reach_m + b.reach_m;
    const auto near = static_cast<std::uint8_t>(std::uint8_t{std::abs(a.x - b.x) <= reach} &
                                                std::uint8_t{std::abs(a.y - b.y) <= reach} &
                                                std::uint8_t{std::abs(a.z - b.z) <= reach});
    found_[count] = pair;
    count += near;
    wanted_[pair.first] |= near;
    wanted_[pair.second] |= near;
  }
  found_.resize(count);
}

// Of the wanted bodies, in the order of memory.
void PairCache::make_boxes(const Input& in) {
  if (!in.given.empty()) return;
  boxes_.resize(in.ids.size());
  for (std::size_t i = 0; i < in.ids.size(); ++i)
    if (wanted_[i] != 0) boxes_[i] = swept_aabb(in.scene, in.geometry, in.ids[i], in.states[i]);
}

std::span<const Aabb> PairCache::boxes_of(const Input& in) const {
  return in.given.empty() ? std::span<const Aabb>(boxes_) : in.given;
}

// With each other, and with all others.
void PairCache::add_pairs_of_unbounded(const Input& in, std::vector<IndexPair>& pairs) {
  if (unbounded_.empty()) return;
  found_.clear();
  std::fill(wanted_.begin(), wanted_.end(), 1);
  make_boxes(in);
  const std::span<const Aabb> boxes = boxes_of(in);
  for (const std::uint32_t body : unbounded_)
    for (std::uint32_t i = 0; i < in.ids.size(); ++i)
      if ((body < i || !bounds_[i].is_void()) && overlap(boxes[body], boxes[i]))
        found_.push_back({std::min(body, i), std::max(body, i)});
  merge_found(pairs);
}

void PairCache::find_anew(const Input& in, std::vector<IndexPair>& pairs, StageCounters& counters) {
  if (!in.given.empty()) return find_pairs(in.scene.broadphase, in.given, pairs, counters);
  boxes_.resize(in.ids.size());
  for (std::size_t i = 0; i < in.ids.size(); ++i)
    boxes_[i] = swept_aabb(in.scene, in.geometry, in.ids[i], in.states[i]);
  find_pairs(in.scene.broadphase, boxes_, pairs, counters);
}

void PairCache::find(const Input& in, std::vector<IndexPair>& pairs, StageCounters& counters) {
  // Boxes of joined bodies hold more than what the bodies themselves can reach.
  served_ = in.ids.size() >= kFewest && in.scene.broadphase == Broadphase::kGrid &&
            in.scene.joints.empty() && is_kept(in);
  if (!served_) return find_anew(in, pairs, counters);
  choose_near();
  make_boxes(in);
  const std::span<const Aabb> made = boxes_of(in);
  pairs.clear();
  for (const IndexPair& pair : found_)
    if (overlap(made[pair.first], made[pair.second])) pairs.push_back(pair);
  add_pairs_of_unbounded(in, pairs);
  counters.candidate_pairs += pairs.size();
}

}  // namespace soda::physics
