// The impulses that hold an island are found to a share of what fields ask of them. By that share
// a body at rest still moves, now here, now there, or it creeps. No velocity at all obeys the laws
// of contact as well, to the same share. So where a step shows no more than that, rest is the
// better answer; and it costs next to nothing from then on, for the next step begins as this one.
//
// What is lost is an acceleration below that share of g: in a time t from rest, share g t^2 / 2.
#include "physics/events/sleeping.hpp"

#include <algorithm>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_impulses.hpp"
#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/limits_and_motors.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/joint_closing.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/island_blocks.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::physics {
namespace {

// Of the speed that fields give in a step. A body without joints and neighbours, and what has to
// keep a tolerance, is solved to rounding; what hangs on joints alone nearly so; others to 1e-9 or,
// where that is out of reach, 1e-8 (solve_directly): there, of what contacts press with.
constexpr double kOfExact = 1e-12, kOfHanging = 1e-10, kOfOthers = 1e-8;

bool is_touched(std::span<const ContactManifold> manifolds) {
  return std::ranges::any_of(manifolds, [](const ContactManifold& m) { return m.count > 0; });
}

// The speed that the largest impulses on a body would give the heaviest one: where like ones bear
// each other, impulses are found to a share of that. What is heavy by itself it does not slow down.
double pressed_m_s(const IslandStep& island, std::span<const BodyState> states) {
  std::vector<double> pressed(states.size(), 0.0);
  for (std::size_t i = 0; i < states.size(); ++i)
    for (const ContactImpulse& impulse : states[i].impulses) {
      if (impulse.part >= kFirstJointPart) continue;
      pressed[i] += impulse.normal_newton_s;
      if (is_static(impulse.other)) continue;
      const auto at = std::ranges::lower_bound(island.ids, impulse.other);
      if (at != island.ids.end() && *at == impulse.other)
        pressed[static_cast<std::size_t>(at - island.ids.begin())] += impulse.normal_newton_s;
    }
  double most = 0.0, heaviest_kg = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (is_kinematic(island.scene, island.ids[i])) continue;
    most = std::max(most, pressed[i]);
    heaviest_kg = std::max(heaviest_kg, island.scene.bodies[index_of(island.ids[i])].mass_kg);
  }
  return heaviest_kg > 0.0 ? most / heaviest_kg : 0.0;
}

double slow_m_s(const IslandStep& island, std::span<const BodyState> states) {
  const SceneDescription& scene = island.scene;
  const bool alone = island.ids.size() == 1 && std::ranges::none_of(island.manifolds, is_joint);
  const double pulled = strongest_field_m_s2(scene, island.ids) * scene.dt_s;
  if (alone || scene.tolerance > 0.0) return kOfExact * pulled;
  if (!is_touched(island.manifolds)) return kOfHanging * pulled;
  return kOfOthers * std::max(pulled, pressed_m_s(island, states));
}

double radius_of(const SceneDescription& scene, const Geometry& geometry, BodyId id) {
  return shape_of(scene, geometry, id).bounding_radius_m;
}

// Whether two lengths, or speeds, are at most `most`: one of the centre, one of a rotation.
bool are_within(double most, const Vec3& linear, double angular_squared, double radius_m) {
  return linear.squaredNorm() <= most * most &&
         angular_squared * (radius_m * radius_m) <= most * most;
}

bool is_slow(const IslandStep& island, std::span<const BodyState> states) {
  const double slow = slow_m_s(island, states);
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!are_within(slow, states[i].linear_velocity_m_s,
                    states[i].angular_velocity_rad_s.squaredNorm(),
                    radius_of(island.scene, island.geometry, island.ids[i])))
      return false;
  }
  return true;
}

bool is_in_place(const IslandStep& island, std::span<const BodyState> before,
                 std::span<const BodyState> states) {
  constexpr double kRounding = 1e-15;  // of an orientation that is made a unit again
  constexpr double kOfPlaces = 1e3;    // roundings of places that joints hold
  const double slow = slow_m_s(island, states) * island.scene.dt_s;
  double displacement = slow;
  if (!is_touched(island.manifolds)) {
    double widest_m = 0.0;
    for (const BodyId id : island.ids)
      widest_m = std::max(widest_m, radius_of(island.scene, island.geometry, id));
    displacement = std::max(slow, kOfPlaces * rounding_of(states, widest_m));
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto difference = states[i].orientation.coeffs() - before[i].orientation.coeffs();
    const double turned = 4.0 * difference.squaredNorm();
    if (!are_within(displacement, states[i].position_m - before[i].position_m,
                    turned > kRounding * kRounding ? turned : 0.0,
                    radius_of(island.scene, island.geometry, island.ids[i])))
      return false;
  }
  return true;
}

// What statics gave to bodies that have lost their velocities in their places.
void report_rest(const SceneDescription& scene, std::span<const BodyId> ids,
                 std::span<const BodyState> before, IslandReport& report) {
  const IslandMomentum lost = momentum_of(scene, ids, before);
  const Vec3 given = -(lost.linear_newton_s + lost.mass_kg * scene.dt_s * lost.field_m_s2 +
                       scene.dt_s * lost.other_newton);
  report.static_impulse_newton_s = given;
  report.static_angular_impulse_newton_m_s =
      lost.centre_m.cross(given) - lost.angular_newton_m_s - scene.dt_s * lost.other_newton_m;
  report.push_out_work_joule = 0.0;
}

// Large islands that are solved in blocks are never seen as a whole (split_solver.hpp).
bool is_solved_whole(const SceneDescription& scene, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds,
                     std::span<const BodyState> states) {
  return !is_large(manifolds) ||
         !choose_solve(scene, scene.dt_s, false, ids, manifolds, states).blocks;
}

// On a surface that slides along, friction has to pull, and what a body without velocity was left
// with need not.
bool lies_on_a_belt(const ContactProblem& problem) {
  return std::ranges::any_of(problem.frictions, [&](const FrictionRow& row) {
    const Vec3& surface = problem.bodies[row.b].linear;
    return row.b != problem.normals[row.normal_row].b &&
           (row.tangent[0].dot(surface) != 0.0 || row.tangent[1].dot(surface) != 0.0);
  });
}

// Velocities after fields and the impulses, and what these violate.
bool hold(const SceneDescription& scene, const Geometry& geometry, std::span<const BodyId> ids,
          double slow_m_s, const ContactProblem& problem) {
  if (problem.restitution_rows > 0 || lies_on_a_belt(problem)) return false;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const SolverBody& body = problem.bodies[i];
    if (!are_within(slow_m_s, body.linear, body.angular.squaredNorm(),
                    radius_of(scene, geometry, ids[i])))
      return false;
  }
  return residual_m_s(problem) <= slow_m_s;
}

// Springs pull as they are stretched. What other joints hold takes part if nothing drives it.
bool can_joints_rest(const IslandStep& island, std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (are_all_springs(scene, ids, manifolds, states)) return true;
  return std::ranges::none_of(manifolds, [&scene = scene](const ContactManifold& m) {
    return is_joint(m) && scene.joints[joint_of(m)].motor.has_value();
  });
}

// What hangs on joints alone is moved by other means than impulses of a whole step: those that hold
// it, from now on.
void store_what_holds(const IslandStep& island, std::span<BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (joints.empty() || has_springs(scene, joints)) return;
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (falls(scene, ids[i])) bodies[i].linear += field_of(scene, ids[i]) * scene.dt_s;
  build_joint_rows(scene, scene.dt_s, states, false, joints);
  bound_step(scene.dt_s, joints);
  stop_joint_velocities(bodies, joints);
  store_jointed_impulses(island, {}, joints, states);
}

// Gives the bodies what their joints give, by the impulses that there are.
void pull_by_joints(const SceneDescription& scene, std::span<const BodyState> states,
                    JointSystem& joints, std::span<SolverBody> bodies, IslandReport& report) {
  apply_spring_impulses(spring_rows(scene, states, joints), scene.dt_s, false, states, bodies,
                        report);
  build_joint_rows(scene, scene.dt_s, states, false, joints);
  load_joint_impulses(scene, states, joints);
  add_loads(joints, report);
  for (const JointRow& row : joints.rows) apply_joint_impulse(row, row.impulse_newton_s, bodies);
}

// Whether anything can bear a weight: what falls has no rest.
bool carries(const SceneDescription& scene) {
  return !scene.statics.empty() || scene.has_world_joints || scene.gravity_m_s2 == Vec3::Zero();
}

}  // namespace

Need sleeping_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene), joints = joint_rows_needed(scene);
  if (!contacts && !joints) return contacts;
  if (!scene.solver.rest) return {false, "switched off in the solver settings"};
  if (!carries(scene) && !kinematic_needed(scene)) return {false, "nothing carries what falls"};
  const std::size_t loose =
      bodies_that(scene, [](const BodyParams& body) { return !is_pushed(body); });
  if (loose == 0) return {false, "every body is driven or pushed"};
  return need_of(joints || can_meet(loose, scene.statics.size()), "known from the step before",
                 "one body alone is not driven or pushed");
}

bool has_no_velocity(const BodyState& state) {
  return state.linear_velocity_m_s == Vec3::Zero() && state.angular_velocity_rad_s == Vec3::Zero();
}

bool may_fall_asleep(const IslandStep& island, std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (!scene.solver.rest || !(carries(scene) || any_kinematic(scene, ids))) return false;
  if (!is_slow(island, states)) return false;
  if (any_carries(scene, ids, states)) return false;
  if (!scene.joints.empty() && !can_joints_rest(island, states)) return false;
  const auto pushed = [&island](BodyId id) { return is_pushed(island.scene.bodies[index_of(id)]); };
  return std::ranges::none_of(ids, pushed);
}

bool is_in_static_equilibrium(const IslandStep& island, std::span<const BodyState> states,
                              IslandReport& report, StageCounters& counters) {
  // Of the speed that fields give in a step: what iterations leave of the balance of an island
  // that they have brought to rest.
  constexpr double kOfSwept = 1e-3;
  constexpr int kRollingIterations = 1000;  // of rolling rows alone: one solve takes longer
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (!std::ranges::all_of(states, has_no_velocity)) return false;
  ContactProblem problem;
  const IndexedSpan<BodyState> bodies{states};
  load_bodies({scene, scene.dt_s, ids, bodies}, problem.bodies, counters);
  bool swept = false;
  if (std::ranges::any_of(manifolds, is_joint)) {
    JointSystem joints = find_joints(scene, ids, manifolds);
    swept = choose_jointed_solve(island, false, states, joints).swept;
    if (!swept && !are_closed(scene, scene.dt_s, states, joints)) return false;
    pull_by_joints(scene, states, joints, problem.bodies, report);
    report.joint_error = largest_error(joints);
  }
  build_rows({scene, scene.dt_s, ids, bodies}, manifolds, problem, counters);
  bear_rolling(kRollingIterations, problem);
  // Where iterations have found a place, what overlaps or is open there stays.
  if (!swept && needs_position_correction(problem)) return false;
  const double slow =
      swept ? kOfSwept * strongest_field_m_s2(scene, ids) * scene.dt_s : slow_m_s(island, states);
  if (!hold(scene, geometry, ids, slow, problem) || !is_solved_whole(scene, ids, manifolds, states))
    return false;
  report.constraint_residual_m_s = residual_m_s(problem);
  report_contacts(bodies, problem, report);
  report_rest(scene, ids, states, report);
  report.rests = true;
  return true;
}

void fall_asleep(const IslandStep& island, std::span<const BodyState> before,
                 std::span<BodyState> states, IslandReport& report) {
  if (!is_slow(island, states) || !is_in_place(island, before, states)) return;
  report_rest(island.scene, island.ids, before, report);
  for (std::size_t i = 0; i < states.size(); ++i) {
    states[i].position_m = before[i].position_m;
    states[i].orientation = before[i].orientation;
    states[i].linear_velocity_m_s = Vec3::Zero();
    states[i].angular_velocity_rad_s = Vec3::Zero();
  }
  if (!is_touched(island.manifolds)) store_what_holds(island, states);
  // From the same states the same follows, whatever the impulses hold.
  report.rests = std::ranges::equal(
      states, before, [](const BodyState& a, const BodyState& b) { return identical(a, b); });
}

}  // namespace soda::physics
