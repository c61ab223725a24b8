// Articulated islands: RATTLE, composed to the fourth order.
#include "physics/integrators/articulated_island.hpp"

#include <algorithm>

#include "physics/forces/forces.hpp"
#include "physics/integrators/articulated_parts.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {
namespace {

// A rotation has farther to go than a swing.
constexpr PartBounds kOfFourthOrder{0.5, 0.2}, kOfSecondOrder{0.25, 0.25};

// Whether time can run backwards for a while: nothing damps, stops or drives.
bool is_reversible(const SceneDescription& scene, std::span<const BodyId> ids,
                   const JointSystem& joints) {
  const auto keeps = [&scene](BodyId id) {
    const BodyParams& body = scene.bodies[index_of(id)];
    if (!is_pushed(body)) return true;
    if (body.drive != kNoDrive) return false;
    const BodyForces& forces = scene.forces[body.forces];
    return forces.linear_damping_1_s == 0.0 && forces.angular_damping_1_s == 0.0;
  };
  return !joints.bounded && std::ranges::all_of(ids, keeps);
}

// What drives, forces and damping gave in an articulated island and push_impulse_newton_s did not
// foresee.
Vec3 unforeseen_newton_s(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                         std::span<const BodyState> before, std::span<const BodyState> after,
                         const Vec3& by_world_newton_s) {
  Vec3 rest = -by_world_newton_s;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const double mass = scene.bodies[index_of(ids[i])].mass_kg;
    rest += (after[i].linear_velocity_m_s - before[i].linear_velocity_m_s) * mass;
    rest -= field_of(scene, ids[i]) * (mass * dt_s);
    if (is_pushed(scene.bodies[index_of(ids[i])]))
      rest -= push_impulse_newton_s(scene, dt_s, ids[i], before[i]);
  }
  return rest;
}

bool advance(const ArticulatedIsland& articulated, std::span<BodyState> states,
             IslandReport& report, std::vector<AdvanceFault>& faults) {
  const auto& [island, joints, motion] = articulated;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const bool fourth = is_reversible(scene, ids, joints);
  if (!fourth && has_springs(scene, joints)) return false;
  const PartBounds bounds = scene.tolerance > 0.0 ? kLongestParts
                            : fourth              ? kOfFourthOrder
                                                  : kOfSecondOrder;
  motion.start(states);
  const int substeps = substeps_of(articulated, bounds);
  if (substeps == 0) return false;
  IslandReport linked = report;
  // What stays open in four times as many parts stays open in more: loops that are all but taut.
  constexpr int kMostOpen = 2;
  PartsEnd end = PartsEnd::kOpen;
  int open = 0;
  const int most = std::max(substeps, most_parts(joints));
  for (int parts = substeps; end != PartsEnd::kHolds && open < kMostOpen && parts <= most;
       parts *= 4) {
    if (parts > substeps) motion.start(states);
    linked = report;
    end = advance_parts(articulated, {parts, fourth, 4 * parts <= most}, nullptr, linked);
    open += end == PartsEnd::kOpen;
  }
  if (end != PartsEnd::kHolds) return false;
  if (!fourth) {
    const Vec3 by_world = linked.static_impulse_newton_s - report.static_impulse_newton_s;
    linked.static_impulse_newton_s +=
        unforeseen_newton_s(scene, dt_s, ids, states, motion.states(), by_world);
  }
  report = linked;
  take_states(articulated, states, faults);
  return true;
}

}  // namespace

bool advance_articulated(const IslandStep& island, JointSystem& joints, std::span<BodyState> states,
                         IslandReport& report, std::vector<AdvanceFault>& faults) {
  return with_articulated(island, joints, [&](const ArticulatedIsland& articulated) {
    return advance(articulated, states, report, faults);
  });
}

}  // namespace soda::physics
