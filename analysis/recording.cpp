#include "analysis/recording.hpp"

#include <algorithm>
#include <limits>

#include "analysis/measured_run.hpp"
#include "models/territory.hpp"

namespace soda::analysis {
namespace {

using models::Grid;
using models::TerritoryMap;
using physics::Vec3;

template <class Vector>
void append(std::vector<float>& floats, const Vector& vector) {
  for (int i = 0; i < vector.size(); ++i) floats.push_back(static_cast<float>(vector[i]));
}

// The face of `cell` towards larger coordinates along `axis`.
void add_face(const Grid& grid, const std::array<std::int32_t, 3>& cell, int axis,
              std::vector<float>& corners) {
  const Vec3 low = grid.origin_m + grid.cell_size_m * Vec3(cell[0], cell[1], cell[2]);
  const Vec3 at = low + grid.cell_size_m * Vec3::Unit(axis);
  const Vec3 along = grid.cell_size_m * Vec3::Unit((axis + 1) % 3);
  const Vec3 across = grid.cell_size_m * Vec3::Unit((axis + 2) % 3);
  for (const Vec3& corner : {at, Vec3(at + along), Vec3(at + along + across), Vec3(at + across)})
    append(corners, corner);
}

std::vector<float> borders_of(const TerritoryMap& map) {
  const Grid& grid = map.grid();
  const auto owner = [&](const std::array<std::int32_t, 3>& cell) {
    return map.owners()[grid.index_of_cell(cell)];
  };
  std::vector<float> corners;
  std::array<std::int32_t, 3> cell{};
  for (cell[2] = 0; cell[2] < grid.cells[2]; ++cell[2])
    for (cell[1] = 0; cell[1] < grid.cells[1]; ++cell[1])
      for (cell[0] = 0; cell[0] < grid.cells[0]; ++cell[0])
        for (int axis = 0; axis < 3; ++axis) {
          std::array<std::int32_t, 3> next = cell;
          const auto i = static_cast<std::size_t>(axis);
          if (++next[i] < grid.cells[i] && owner(next) != owner(cell))
            add_face(grid, cell, axis, corners);
        }
  return corners;
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
    const std::uint32_t owner = models::index_of(map.owner_at(state.position_m));
    recording.owners.push_back(static_cast<std::uint16_t>(owner % Recording::kAway));
  }
}

// Of what is there at the beginning and at the end, with two cells around it.
struct Extent {
  Vec3 middle_m;
  double reach_m;
};
Extent extent_of(LogReader& log, double cell_m) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Vec3 low = Vec3::Constant(kFar), high = Vec3::Constant(-kFar);
  for (const std::int64_t step : {std::int64_t{0}, log.last_step()})
    for (const physics::BodyState& state : log.read_step(step).states) {
      low = low.cwiseMin(state.position_m);
      high = high.cwiseMax(state.position_m);
    }
  if (low.x() > high.x()) return {Vec3::Zero(), cell_m};
  return {0.5 * (low + high), (high - low).norm() + 2.0 * cell_m};
}

Triangles seen(const physics::Shape& shape, const physics::StaticBody* body, const Extent& extent) {
  if (body == nullptr) return triangles_of(shape, Vec3::Zero(), 0.0);
  const Vec3 middle = body->orientation.conjugate() * (extent.middle_m - body->position_m);
  return triangles_of(shape, middle, extent.reach_m);
}

void add_scene(const physics::SceneDescription& scene, const Extent& extent, Recording& recording) {
  // Half spaces are drawn where bodies are, so each static has a shape of its own.
  for (const physics::Shape& shape : scene.shapes) {
    const bool endless = std::holds_alternative<physics::HalfSpace>(shape);
    recording.shapes.push_back(endless ? Triangles() : seen(shape, nullptr, extent));
  }
  for (const physics::BodyParams& body : scene.bodies)
    recording.bodies.push_back({body.label, body.shape});
  for (const physics::StaticBody& body : scene.statics) {
    std::uint32_t shape = body.shape;
    if (std::holds_alternative<physics::HalfSpace>(scene.shapes[shape])) {
      shape = static_cast<std::uint32_t>(recording.shapes.size());
      recording.shapes.push_back(seen(scene.shapes[body.shape], &body, extent));
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

Recording record(LogReader& log, const scenarios::Scenario& scenario, std::int64_t every) {
  const TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  Recording recording;
  recording.name = scenario.name;
  recording.dt_s = scenario.scene.dt_s;
  const Vec3& gravity = scenario.scene.gravity_m_s2;
  if (gravity.norm() > 0.0) recording.up = -gravity.normalized();
  recording.worlds = map.worlds();
  add_scene(scenario.scene, extent_of(log, scenario.territory.grid.cell_size_m), recording);
  recording.borders = borders_of(map);
  const std::int64_t last = log.last_step();
  for (std::int64_t step = 0; step < last; step += every)
    add_frame(log.read_step(step), map, recording);
  add_frame(log.read_step(last), map, recording);
  return recording;
}

}  // namespace soda::analysis
