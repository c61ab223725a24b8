// Bodies of an island before and after its contacts are solved.
#include "physics/solvers/island_motion.hpp"

#include <algorithm>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {

// Velocities after external forces, and the inertia that contacts meet.
void load_bodies(const SolveStep& step, std::vector<SolverBody>& bodies, StageCounters& counters) {
  const auto& [scene, dt_s, ids, states] = step;
  bodies.resize(ids.size() + 1);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    bodies[i] = solver_body(params, states[i]);
    if (params.kinematic) continue;
    apply_external(scene, dt_s, 0.5 * dt_s, ids[i], states[i], bodies[i]);
    counters.driven_bodies += params.drive != kNoDrive;
    counters.forced_bodies += is_forced(params);
  }
}

Vec3 impulse_on_b(const ContactProblem& problem, std::size_t row) {
  const NormalRow& normal = problem.normals[row];
  Vec3 impulse = normal.normal * normal.impulse_newton_s;
  if (problem.contacts[row].friction_row >= 0) {
    const FrictionRow& f = problem.frictions[problem.contacts[row].friction_row];
    impulse += f.tangent[0] * f.impulse_newton_s[0] + f.tangent[1] * f.impulse_newton_s[1];
  }
  return impulse;
}

ContactImpulse stored_impulse(const IndexedSpan<ContactManifold>& manifolds,
                              const ContactProblem& problem, std::size_t row) {
  const NormalRow& normal = problem.normals[row];
  const RowContact& contact = problem.contacts[row];
  const ContactManifold& m = manifolds[contact.manifold];
  const Vec3 along = normal.normal * normal.impulse_newton_s;
  return {m.b, m.part, m.points[contact.point].feature, normal.impulse_newton_s,
          impulse_on_b(problem, row) - along};
}

Flights find_flights(const ContactProblem& problem) {
  constexpr std::uint32_t kNowhere = ~std::uint32_t{0};
  // What nothing moves flies on, whatever it carries.
  const auto moves = [&](std::size_t body) { return problem.bodies[body].inverse_mass > 0.0; };
  Flights flights(problem.bodies.size());
  ShortList<std::uint32_t, 4> bounced_off;  // a manifold
  if (problem.restitution_rows > 0) bounced_off.assign(problem.bodies.size(), kNowhere);
  const auto note_bounce = [&](std::size_t body, std::uint32_t manifold) {
    if (!moves(body)) return;
    if (bounced_off[body] == kNowhere) bounced_off[body] = manifold;
    if (bounced_off[body] != manifold) flights[body].supported = true;
  };
  // Friction acts, too, where the normal impulse ended at zero: see report_contacts.
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    const RowContact& contact = problem.contacts[i];
    if (impulse_on_b(problem, i) == Vec3::Zero()) continue;
    if (!contact.bounces) {
      if (moves(row.a)) flights[row.a].supported = true;
      if (moves(row.b)) flights[row.b].supported = true;
    } else {
      // Between two, it bounced again and again: the sums of the impulses have no time each.
      note_bounce(row.a, contact.manifold);
      note_bounce(row.b, contact.manifold);
    }
  }
  if (problem.restitution_rows == 0) return flights;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    Flight& a = flights[row.a];
    Flight& b = flights[row.b];
    // Both or neither: an impact in which one came later moves the centre of mass.
    if (!problem.contacts[i].bounces || a.supported || b.supported) continue;
    const Vec3 delayed = impulse_on_b(problem, i) * problem.contacts[i].impact_time_s;
    a.not_yet_m -= delayed * problem.bodies[row.a].inverse_mass;
    b.not_yet_m += delayed * problem.bodies[row.b].inverse_mass;
  }
  return flights;
}

namespace {

BodyState moved(const BodyMove& move, const BodyState& state) {
  const auto& [scene, dt_s, id, body, flight, correction] = move;
  BodyState next;
  next.position_m = state.position_m + body.linear * dt_s;
  if (!flight.supported) next.position_m -= flight_lag_m(scene, dt_s, id, state) + flight.not_yet_m;
  next.linear_velocity_m_s = body.linear;
  next.angular_velocity_rad_s = body.angular;
  next.orientation = state.orientation;
  rotate_freely(scene.bodies[index_of(id)], dt_s, next);
  if (correction != nullptr) {
    next.position_m += correction->linear * dt_s;
    rotate_by(scene.bodies[index_of(id)], correction->angular * dt_s, next);
  }
  return next;
}

}  // namespace

bool move_body(const BodyMove& move, BodyState& state, std::vector<AdvanceFault>& faults) {
  BodyState next = moved(move, state);
  const char* const fault = fault_of(next);
  if (*fault) {
    faults.push_back({move.id, fault});
    return false;
  }
  next.impulses = std::move(state.impulses);
  next.broken_joints = std::move(state.broken_joints);
  state = std::move(next);
  return true;
}

double push_out_work_joule(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                           std::span<const PositionCorrection> correction) {
  double work = 0.0;
  if (correction.empty()) return work;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (falls(scene, ids[i]))
      work -= scene.bodies[index_of(ids[i])].mass_kg *
              field_of(scene, ids[i]).dot(correction[i].linear);
  return work * dt_s;
}

void report_contacts(const IndexedSpan<BodyState>& states, const ContactProblem& problem,
                     IslandReport& report) {
  const std::uint32_t statics = static_cast<std::uint32_t>(states.size());
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const RowContact& contact = problem.contacts[i];
    report.max_penetration_m = std::max(report.max_penetration_m, -contact.separation_m);
    const NormalRow& row = problem.normals[i];
    // Kinematic bodies take and give as statics do.
    const bool from_a = problem.bodies[row.a].inverse_mass == 0.0;
    if (row.b != statics && !from_a && problem.bodies[row.b].inverse_mass > 0.0) continue;
    // Friction counts even where the normal impulse ended at zero: after the last iteration it may
    // not have been taken back to its disc yet (a constraint residual, but an impulse all the
    // same).
    const Vec3 on_b = impulse_on_b(problem, i), impulse = from_a ? on_b : Vec3(-on_b);
    if (impulse == Vec3::Zero()) continue;
    report.static_impulse_newton_s += impulse;
    report.static_angular_impulse_newton_m_s +=
        (states[row.a].position_m + contact.arm_a).cross(impulse);
  }
  for (const RollingRow& row : problem.rollings)
    if (row.b == statics) report.static_angular_impulse_newton_m_s -= torque_impulse(row);
}

}  // namespace soda::physics
