#include "analysis/viewer/recording.hpp"

#include <algorithm>
#include <limits>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "models/territory/territory.hpp"
#include "physics/events/sleeping.hpp"

namespace soda::analysis {
namespace {

using models::TerritoryMap;
using physics::Vec3;

template <class Vector>
void append(std::vector<float>& floats, const Vector& vector) {
  for (int i = 0; i < vector.size(); ++i) floats.push_back(static_cast<float>(vector[i]));
}

std::uint16_t shown(models::WorldId owner) {
  return static_cast<std::uint16_t>(models::index_of(owner) % (Recording::kResting - 1));
}

void note_changes(const LoggedStep& logged, Recording& recording) {
  const auto next_frame = static_cast<std::uint32_t>(recording.steps.size());
  for (const models::TerritoryChange& change : logged.territory_changes)
    recording.changes.push_back({next_frame, change.cell, shown(change.from), shown(change.to)});
}

void add_frame(const LoggedStep& logged, const TerritoryMap& map, Recording& recording) {
  recording.steps.push_back(logged.step);
  std::size_t there = 0;
  for (std::size_t body = 0; body < recording.bodies.size(); ++body) {
    if (there == logged.ids.size() || physics::index_of(logged.ids[there]) != body) {
      recording.numbers.insert(recording.numbers.end(), Recording::kNumbers, 0.0f);
      recording.owners.push_back(Recording::kAway);
      continue;
    }
    const physics::BodyState& state = logged.states[there++];
    const physics::Quat& q = state.orientation;
    append(recording.numbers, state.position_m);
    append(recording.numbers, Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
    recording.numbers.push_back(static_cast<float>(state.linear_velocity_m_s.norm()));
    const std::uint16_t resting = physics::has_no_velocity(state) ? Recording::kResting : 0;
    recording.owners.push_back(shown(map.owner_at(state.position_m)) | resting);
  }
}

// All corners of all bodies are drawn in each picture.
int sides_for(std::size_t bodies) { return bodies > 5'000 ? 8 : bodies > 1'500 ? 12 : 24; }

void add_scene(const physics::SceneDescription& scene, const Extent& extent, Recording& recording) {
  // Half spaces are drawn where bodies are, so each static has a shape of its own.
  for (const physics::Shape& shape : scene.shapes) {
    const bool endless = std::holds_alternative<physics::HalfSpace>(shape);
    recording.shapes.push_back(endless ? Triangles() : seen(shape, scene));
  }
  for (const physics::BodyParams& body : scene.bodies)
    recording.bodies.push_back({body.label, body.shape});
  for (const physics::StaticBody& body : scene.statics) {
    std::uint32_t shape = body.shape;
    if (std::holds_alternative<physics::HalfSpace>(scene.shapes[shape])) {
      shape = static_cast<std::uint32_t>(recording.shapes.size());
      recording.shapes.push_back(seen_static(body, scene, extent));
    }
    Recording::Static drawn{.name = body.name, .shape = shape, .pose = {}};
    std::vector<float> pose;
    append(pose, body.position_m);
    const physics::Quat& q = body.orientation;
    append(pose, Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
    std::ranges::copy(pose, drawn.pose.begin());
    recording.statics.push_back(std::move(drawn));
  }
}

}  // namespace

Extent extent_of(LogReader& log, double cell_m) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Vec3 low = Vec3::Constant(kFar), high = Vec3::Constant(-kFar);
  for (const std::int64_t step : {log.first_step(), log.last_states()})
    for (const physics::BodyState& state : log.read_states(step).states) {
      low = low.cwiseMin(state.position_m);
      high = high.cwiseMax(state.position_m);
    }
  if (low.x() > high.x()) return {Vec3::Zero(), cell_m};
  return {0.5 * (low + high), (high - low).norm() + 2.0 * cell_m};
}

Triangles seen(const physics::Shape& shape, const physics::SceneDescription& scene) {
  return triangles_of(shape, scene.shapes, Vec3::Zero(), 0.0, sides_for(scene.bodies.size()));
}

Triangles seen_static(const physics::StaticBody& body, const physics::SceneDescription& scene,
                      const Extent& extent) {
  const Vec3 middle = body.orientation.conjugate() * (extent.middle_m - body.position_m);
  return triangles_of(scene.shapes[body.shape], scene.shapes, middle, extent.reach_m);
}

Recording record(LogReader& log, const scenarios::Scenario& scenario, std::int64_t every) {
  TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  Recording recording;
  recording.name = scenario.name;
  recording.dt_s = scenario.scene.dt_s;
  const Vec3& gravity = scenario.scene.gravity_m_s2;
  if (gravity.norm() > 0.0) recording.up = -gravity.normalized();
  recording.worlds = map.worlds();
  add_scene(scenario.scene, extent_of(log, scenario.territory.grid.cell_size_m), recording);
  recording.grid = map.grid();
  for (const models::WorldId owner : map.owners()) recording.cell_owners.push_back(shown(owner));
  const std::int64_t last = log.last_states();
  const std::int64_t first = log.first_step();
  FrameMarker marker(scenario.scene, static_cast<std::size_t>((last - first) / every) + 2);
  for (std::int64_t step = first; step <= last; ++step) {
    const LoggedStep logged = log.read_step(step);
    follow_changes(logged, map);
    note_changes(logged, recording);
    if (!logged.has_states || ((step - first) % every != 0 && step != last)) continue;
    require_numbers(log, logged);
    add_frame(logged, map, recording);
    marker.add(logged, map);
  }
  recording.marks = marker.finish();
  return recording;
}

}  // namespace soda::analysis
