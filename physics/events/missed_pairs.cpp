#include "physics/events/missed_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "physics/continuous/face_passed.hpp"
#include "physics/continuous/time_of_impact.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// Contacts are looked for along the way that a body begins with, gravity and a margin included.
bool may_miss_pairs(const SceneDescription& scene, const Geometry& geometry, double dt_s, BodyId id,
                    const BodyState& before, const BodyState& now) {
  const double width_m = shape_of(scene, geometry, id).min_extent_m;
  const double fallen_m = scene.gravity_m_s2.norm() * dt_s * dt_s;
  const Vec3 foreseen = before.position_m + dt_s * before.linear_velocity_m_s;
  const double most_m = kContactMargin * width_m + fallen_m;
  return (now.position_m - foreseen).squaredNorm() > most_m * most_m;
}

// From where the step began, such that it ends with the velocities it has.
BodyState start_of(const SceneDescription& scene, double dt_s, const BodyState& before,
                   const BodyState& now) {
  BodyState start;
  start.broken_joints = before.broken_joints;
  start.position_m = before.position_m;
  start.orientation = before.orientation;
  start.linear_velocity_m_s = now.linear_velocity_m_s - scene.gravity_m_s2 * dt_s;
  start.angular_velocity_rad_s = now.angular_velocity_rad_s;
  return start;
}

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

}  // namespace

Need unseen_statics_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (scene.statics.empty()) return {false, "there is no static"};
  return need_of(bodies_that(scene, can_be_unjointed) > 0,
                 "contacts can send bodies to other statics", "joints hold every body");
}

void stop_at_unseen_statics(const IslandStep& island, std::span<const BodyState> before,
                            std::span<BodyState> states, IslandReport& report,
                            StageCounters& counters) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  std::vector<IndexPair> pairs;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!is_unjointed(scene.bodies[index_of(ids[i])], states[i]) || is_kinematic(scene, ids[i]))
      continue;
    if (!may_miss_pairs(scene, geometry, dt_s, ids[i], before[i], states[i])) continue;
    const BodyState start = start_of(scene, dt_s, before[i], states[i]);
    const Aabb box = swept_aabb(scene, geometry, ids[i], start);
    find_static_pairs(geometry, {&box, 1}, pairs, counters);
    std::optional<Impact> first;
    for (const IndexPair& pair : pairs) {
      const BodyId other = static_id(pair.second);
      if (!groups_touch(scene, ids[i], other)) continue;
      if (!meets_in_parts(scene, ids[i], other) && have_met(manifolds, ids[i], other)) continue;
      const std::optional<Impact> impact =
          time_of_unmet_impact({scene, geometry, dt_s, ids[i], start, other, nullptr}, manifolds);
      ++counters.unseen_searches;
      if (impact && (!first || impact->time_s < first->time_s)) first = impact;
    }
    if (!first) continue;
    const BodyState there = flown(scene, ids[i], start, first->time_s);
    // The way that it did not come had a share of its energy.
    const std::span<const BodyId> id(&ids[i], 1);
    const double had = kinetic_joule(scene, id, {&there, 1});
    const double gain = gain_joule(scene, id, {&states[i], 1}, {&there, 1});
    if (gain > had) continue;
    const double share = gain > 0.0 ? std::sqrt(1.0 - gain / had) : 1.0;
    const BodyState missed = states[i];
    states[i].position_m = there.position_m;
    states[i].orientation = there.orientation;
    states[i].linear_velocity_m_s = share * there.linear_velocity_m_s;
    states[i].angular_velocity_rad_s = share * there.angular_velocity_rad_s;
    add_static_impulse(scene, ids[i], missed, states[i], report);
  }
}

namespace {

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
      scene.bodies[index_of(stop.id)].mass_kg * lift_m * scene.gravity_m_s2.dot(floor.normal);
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
  const Aabb way{from.cwiseMin(to) - Vec3::Constant(stop.enough_m),
                 from.cwiseMax(to) + Vec3::Constant(stop.enough_m)};
  std::vector<IndexPair> near;
  StageCounters unused;
  find_static_pairs(geometry, {&way, 1}, near, unused);
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
