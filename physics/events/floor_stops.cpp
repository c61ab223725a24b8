#include "physics/events/floor_stops.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "physics/continuous/face_passed.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// What a static gives a body that it takes from one state to the other.
void add_static_impulse(const SceneDescription& scene, BodyId id, const BodyState& from,
                        const BodyState& to, IslandReport& report) {
  const IslandMomentum was = momentum_of(scene, {&id, 1}, {&from, 1}),
                       now = momentum_of(scene, {&id, 1}, {&to, 1});
  report.static_impulse_newton_s += now.linear_newton_s - was.linear_newton_s;
  report.static_angular_impulse_newton_m_s += now.angular_newton_m_s - was.angular_newton_m_s +
                                              now.centre_m.cross(now.linear_newton_s) -
                                              was.centre_m.cross(was.linear_newton_s);
}

constexpr double kLowest = 0.2;  // of the width, of a centre above a plane

struct Stop {
  const SceneDescription& scene;
  BodyId id;
  double enough_m;
  const BodyState& before;
  const Pose* part = nullptr;  // of a compound: it is the part's centre that stays above

  Vec3 centre_m(const BodyState& state) const {
    return part ? Vec3(state.position_m + state.orientation * part->position) : state.position_m;
  }
  double height_m(const FacePlane& plane, const BodyState& state) const {
    return plane.normal.dot(centre_m(state)) - plane.offset_m;
  }
};

// False if the body is high enough.
bool stop_at_plane(const Stop& stop, const FacePlane& floor, BodyState& state,
                   IslandReport& report) {
  const SceneDescription& scene = stop.scene;
  const double now_m = stop.height_m(floor, state);
  if (!(now_m < stop.enough_m)) return false;
  const double lift_m = std::min(stop.height_m(floor, stop.before), stop.enough_m) - now_m;
  if (!(lift_m > 0.0)) return false;
  const BodyState sunk = state;
  state.position_m += floor.normal * lift_m;
  const double sinks_m_s = -floor.normal.dot(state.linear_velocity_m_s);
  if (sinks_m_s > 0.0) state.linear_velocity_m_s += floor.normal * sinks_m_s;
  add_static_impulse(scene, stop.id, sunk, state, report);
  report.beyond_tolerance = report.beyond_tolerance || scene.tolerance > 0.0;
  report.push_out_work_joule -=
      scene.bodies[index_of(stop.id)].mass_kg * lift_m * field_of(scene, stop.id).dot(floor.normal);
  return true;
}

// A centre that is put in front of one face may be behind another then.
void stop_at_faces(const Stop& stop, const Geometry& geometry, BodyId fixed, BodyState& state,
                   IslandReport& report) {
  constexpr int kMostFaces = 8;
  for (int i = 0; i < kMostFaces; ++i) {
    const std::optional<FacePlane> face = face_passed(geometry, fixed, stop.centre_m(stop.before),
                                                      stop.centre_m(state), stop.enough_m);
    if (!face || !stop_at_plane(stop, *face, state, report)) return;
  }
}

void stop_body(const Stop& stop, const Geometry& geometry, BodyState& state, IslandReport& report) {
  for (const std::uint32_t floor : geometry.impl().floors)
    if (groups_touch(stop.scene, stop.id, static_id(floor)))
      stop_at_plane(stop, geometry.impl().statics[floor].plane, state, report);
  const Vec3 from = stop.centre_m(stop.before), to = stop.centre_m(state);
  const Aabb path{from.cwiseMin(to) - Vec3::Constant(stop.enough_m),
                  from.cwiseMax(to) + Vec3::Constant(stop.enough_m)};
  std::vector<IndexPair> near;
  StageCounters unused;
  find_static_pairs(geometry, {&path, 1}, near, unused);
  for (const IndexPair& pair : near)
    if (groups_touch(stop.scene, stop.id, static_id(pair.second)))
      stop_at_faces(stop, geometry, static_id(pair.second), state, report);
}

}  // namespace

void stop_at_floors(const IslandStep& island, std::span<const BodyState> before,
                    std::span<BodyState> states, IslandReport& report) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!is_unjointed(scene.bodies[index_of(ids[i])], states[i]) || is_kinematic(scene, ids[i]))
      continue;
    const CompiledShape& shape = shape_of(scene, geometry, ids[i]);
    if (shape.parts.empty())
      stop_body({scene, ids[i], kLowest * shape.min_extent_m, before[i]}, geometry, states[i],
                report);
    for (const CompiledPart& part : shape.parts)
      stop_body({scene, ids[i], kLowest * part.solid->min_extent_m, before[i], &part.pose},
                geometry, states[i], report);
  }
}

}  // namespace soda::physics
