#include "analysis/branch/recorded_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/event_log/logged_run.hpp"

namespace soda::analysis {
namespace {

using physics::Aabb;
using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

void cover(const Aabb& more, Aabb& box) {
  box.min = box.min.cwiseMin(more.min);
  box.max = box.max.cwiseMax(more.max);
}

// As floats, which are rounded to nearest: by more than that.
constexpr double kFloat = 1e-6;
float below(double value) { return static_cast<float>(value - std::abs(value) * kFloat); }
float above(double value) { return static_cast<float>(value + std::abs(value) * kFloat); }

}  // namespace

// A hit may take a body beyond its swept box, to where it ends; and if it was hit more than once,
// it may have been farther out, on its last way. The last two boxes are those of bodies that stand.
Aabb box_of_step(const physics::SceneDescription& scene, const physics::Geometry& geometry,
                 BodyId id, const BodyState& start, const BodyState* end) {
  Aabb box = swept_aabb(scene, geometry, id, start);
  if (end == nullptr) return box;
  BodyState still = *end;
  still.linear_velocity_m_s = still.angular_velocity_rad_s = Vec3::Zero();
  const Aabb there = swept_aabb(scene, geometry, id, still);
  const Vec3 back = end->linear_velocity_m_s * scene.dt_s;
  cover(there, box);
  cover({there.min - back, there.max - back}, box);
  return box;
}

RecordedBodies::RecordedBodies(LogReader& log, const physics::SceneDescription& scene,
                               const physics::Geometry& geometry)
    : log_(log), scene_(scene), geometry_(geometry), states_(log) {}

bool RecordedBodies::begin(std::int64_t step, std::span<const models::CommittedInput> inputs) {
  step_ = step;
  bodies_.clear();
  inputs_.clear();
  for (const models::CommittedInput& committed : inputs) inputs_.push_back(committed.input);
  std::ranges::sort(inputs_, models::acts_before);
  return step < bounded_to_ || read_bounds();
}

std::optional<BodyState> RecordedBodies::read(BodyId id, std::int64_t step) {
  std::optional<BodyState> state = states_.read(id, step);
  if (state) check_state(log_, step, *state, scene_);
  return state;
}

const RecordedBody& RecordedBodies::body(BodyId id) {
  if (const auto found = bodies_.find(id); found != bodies_.end()) return found->second;
  RecordedBody body{read(id, step_), read(id, step_ + 1), {}};
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  if (body.start) {
    ids.push_back(id);
    states.push_back(std::move(*body.start));
  }
  for (const models::UserInput& input : inputs_)
    if (input.body == id && !changes_scene(input.kind))
      models::act_on_bodies(input, scene_, ids, states);
  body.start.reset();
  if (!states.empty()) body.start = std::move(states.front());
  if (body.start.has_value() != body.end.has_value())
    log_.refuse(step_ + 1, "has other bodies than its inputs leave");
  if (body.start) body.box = box_of_step(scene_, geometry_, id, *body.start, &*body.end);
  return bodies_.emplace(id, std::move(body)).first->second;
}

// How far from its centre of mass a body's box goes in a step, but for where its velocity takes it.
double RecordedBodies::reach_m(BodyId id, double spin_rad_s) const {
  BodyState state;
  state.angular_velocity_rad_s = Vec3(spin_rad_s, 0.0, 0.0);
  const Aabb box = swept_aabb(scene_, geometry_, id, state);
  return box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs()).norm() + most_speed_m_s_ * scene_.dt_s;
}

bool RecordedBodies::read_bounds() {
  const std::optional<MotionBounds> bounds = log_.read_bounds(step_);
  if (!bounds || !(bounds->most_speed_m_s < std::numeric_limits<double>::infinity()) ||
      !(bounds->most_spin_rad_s < std::numeric_limits<double>::infinity()))
    return false;
  bounded_to_ = bounds->last_step;
  most_speed_m_s_ = bounds->most_speed_m_s;
  rooms_.resize(bounds->bodies.size());
  std::vector<double> of_shape(scene_.shapes.size(), -1.0);
  for (std::uint32_t i = 0; i < rooms_.size(); ++i) {
    const physics::BodyParams& params = scene_.bodies[i];
    double reach = params.joints == 0 ? of_shape[params.shape] : -1.0;
    if (reach < 0.0) reach = reach_m(BodyId{i}, bounds->most_spin_rad_s);
    if (params.joints == 0) of_shape[params.shape] = reach;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rooms_[i].low[axis] = below(double{bounds->bodies[i].low_m[axis]} - reach);
      rooms_[i].high[axis] = above(double{bounds->bodies[i].high_m[axis]} + reach);
    }
  }
  return true;
}

void RecordedBodies::find_near(const Aabb& box, std::vector<BodyId>& near) const {
  near.clear();
  Room asked;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    asked.low[axis] = below(box.min[static_cast<Eigen::Index>(axis)]);
    asked.high[axis] = above(box.max[static_cast<Eigen::Index>(axis)]);
  }
  for (std::uint32_t i = 0; i < rooms_.size(); ++i) {
    const Room& room = rooms_[i];
    if (room.low[0] <= asked.high[0] && asked.low[0] <= room.high[0] &&
        room.low[1] <= asked.high[1] && asked.low[1] <= room.high[1] &&
        room.low[2] <= asked.high[2] && asked.low[2] <= room.high[2])
      near.push_back(BodyId{i});
  }
}

}  // namespace soda::analysis
