// Linkages: RATTLE, composed to the fourth order.
#include "physics/linkage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "physics/forces.hpp"
#include "physics/joint_bounds.hpp"
#include "physics/joint_motion.hpp"
#include "physics/joint_work.hpp"
#include "physics/rigid_motion.hpp"
#include "physics/springs.hpp"

namespace soda::physics {
namespace {

constexpr int kMostCorrections = 20;
constexpr int kMostParts = 256;  // of a step
// With springs, where more take longer than is worth it: times bodies, but these are granted.
constexpr double kMostSpringWork = 128.0, kLeastSpringParts = 32.0;

void push(const SceneDescription& scene, std::span<const BodyId> ids,
          std::span<const BodyState> states, double dt_s, std::span<SolverBody> bodies) {
  for (std::size_t i = 0; i < ids.size(); ++i)
    apply_external(scene, dt_s, 0.0, ids[i], states[i], bodies[i]);
}

// Stages of the composition of a symmetric method of second order that is of fourth order (Suzuki):
// parts of the step, the middle one backwards.
constexpr double kOuter = 0.41449077179437574;  // 1 / (4 - cbrt(4))
constexpr std::array kStages{kOuter, kOuter, 1.0 - 4.0 * kOuter, kOuter, kOuter};

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

// What drives, forces and damping gave in a linkage and push_impulse_newton_s did not foresee.
Vec3 unforeseen_newton_s(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                         std::span<const BodyState> before, std::span<const BodyState> after,
                         const Vec3& by_world_newton_s) {
  Vec3 rest = -by_world_newton_s;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const double mass = scene.bodies[index_of(ids[i])].mass_kg;
    rest += (after[i].linear_velocity_m_s - before[i].linear_velocity_m_s) * mass;
    rest -= scene.gravity_m_s2 * (mass * dt_s);
    if (is_pushed(scene.bodies[index_of(ids[i])]))
      rest -= push_impulse_newton_s(scene, dt_s, ids[i], before[i]);
  }
  return rest;
}

// A joint under tension is a stiff spring for what turns across it: of a body that is held at an
// arm r with a force f, the rate is sqrt(f r / (I + m r^2)). The explicit step is stable up to
// twice its inverse, and accurate well below. 0 where no number would do.
int substeps_of(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                std::span<const BodyState> states, bool fourth, JointSystem& joints) {
  // Of a swing about a taut joint, and of a spin, which has farther to go.
  const double most_swing_rad = fourth ? 0.5 : 0.25, most_spin_rad = fourth ? 0.2 : 0.25;
  constexpr int kMost = 100;
  constexpr double kHopeless = 1000.0;
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  push(scene, ids, states, dt_s, bodies);
  build_joint_rows(scene, dt_s, ids, states, false, joints);
  bound_velocities(dt_s, rounding_of(states), joints);
  stop_joint_velocities(ids.size(), bodies, joints);
  std::vector<double> squared(ids.size() + 1, 0.0);
  const auto stiffen = [&](std::uint32_t body, const JointRow& row, const Vec3& turn) {
    if (body >= ids.size() || row.linear == Vec3::Zero()) return;
    const double force = std::abs(row.impulse_newton_s) / dt_s, arm = turn.norm();
    const double mass = scene.bodies[index_of(ids[body])].mass_kg;
    squared[body] += force * arm / (1.0 / bodies[body].inverse_inertia.norm() + mass * arm * arm);
  };
  for (const JointRow& row : joints.rows) {
    stiffen(row.a, row, row.turn_a);
    stiffen(row.b, row, row.turn_b);
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    largest = std::max({largest, std::sqrt(squared[i]) / most_swing_rad,
                        states[i].angular_velocity_rad_s.norm() / most_spin_rad});
  double parts = largest * dt_s;
  if (!(parts < kHopeless)) return 0;
  if (const std::vector<SpringRow> springs = spring_rows(scene, ids, states, joints);
      !springs.empty()) {
    parts = std::max(parts, parts_for(rates_of(springs, bodies), dt_s));
    const double most = kMostSpringWork / static_cast<double>(ids.size());
    if (!(parts < std::max(most, kLeastSpringParts))) return 0;
  }
  return parts < kMost ? 1 + static_cast<int>(parts) : kMost;
}

// Limits this many roundings away are reached.
constexpr double kReached = 1e3;

// Before places are corrected: no limit holds yet, motors have done what they could.
void start_corrections(std::size_t body_count, std::span<const SolverBody> bodies,
                       JointSystem& joints) {
  if (!joints.bounded) return;
  rest_bounds(joints);
  factor_joint_rows(body_count, bodies, joints);
}

// What bounded rows and velocities that the joints do not allow did to the energy.
struct LinkageWork {
  double motors_joule = 0.0;
  bool loses = false;  // a limit has pushed, or started to
};

// After half a kick; `before`: the velocities until then, without external forces. A constant push
// over a constant acceleration does exactly its work.
void add_work(std::span<const SolverBody> before, std::span<const SolverBody> after,
              const JointSystem& joints, LinkageWork& work) {
  if (!joints.bounded) return;
  for (const JointRow& row : joints.rows) {
    if (row.kind == JointRowKind::kMotor)
      work.motors_joule +=
          0.5 * row.impulse_newton_s * (velocity_of(row, before) + velocity_of(row, after));
    work.loses = work.loses || (row.kind == JointRowKind::kLimit && row.impulse_newton_s != 0.0);
  }
}

// False if the joints do not hold at its end.
bool advance_linkage_once(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                          JointSystem& joints, std::vector<BodyState>& states, IslandReport& report,
                          LinkageWork& work) {
  const double enough = rounding_of(states);
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  const std::vector<SolverBody> start = bodies;
  push(scene, ids, states, 0.5 * dt_s, bodies);
  kick(spring_rows(scene, ids, states, joints), 0.5 * dt_s, false, states, bodies, report);
  build_joint_rows(scene, dt_s, ids, states, false, joints);
  bound_velocities(0.5 * dt_s, kReached * enough, joints);
  stop_joint_velocities(ids.size(), bodies, joints);
  add_work(start, bodies, joints, work);
  std::vector<BodyState> next = drifted(scene, ids, states, bodies, dt_s);
  // Impulses act at the start of the step: along its rows, until the joints hold at its end.
  JointSystem end = joints;
  build_joint_rows(scene, dt_s, ids, next, false, end);
  start_corrections(ids.size(), bodies, joints);
  hold_same_limits(joints, end);
  double error = largest_error(end);
  for (int i = 0; i < kMostCorrections && error > enough; ++i) {
    const bool more = hold_passed_limits(enough, end);
    if (more) {
      work.loses = true;
      hold_same_limits(end, joints);
      factor_joint_rows(ids.size(), bodies, joints);
    }
    for (std::size_t r = 0; r < joints.rows.size(); ++r)
      joints.rows[r].error = end.rows[r].error / dt_s;
    add_joint_impulses(joints, bodies);
    next = drifted(scene, ids, states, bodies, dt_s);
    build_joint_rows(scene, dt_s, ids, next, false, end);
    hold_same_limits(joints, end);
    const double before = std::exchange(error, largest_error(end));
    ++report.iterations;
    if (error > 2.0 * before && !more) return false;
  }
  if (error > 1e6 * enough) return false;
  report_joints(states, joints, report);
  bodies = bodies_at(scene, ids, next);
  const std::vector<SolverBody> arrived = bodies;
  kick(spring_rows(scene, ids, next, joints), 0.5 * dt_s, true, next, bodies, report);
  push(scene, ids, states, 0.5 * dt_s, bodies);
  rest_bounds(end);
  bound_velocities(0.5 * dt_s, kReached * enough, end);
  stop_joint_velocities(ids.size(), bodies, end);
  add_work(arrived, bodies, end, work);
  report_joints(next, end, report);
  report.constraint_residual_m_s = std::max(report.constraint_residual_m_s, error / std::abs(dt_s));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].linear_velocity_m_s = bodies[i].linear;
    next[i].angular_velocity_rad_s = bodies[i].angular;
  }
  states = std::move(next);
  return true;
}

// Whether velocities go against the joints, as those that contacts left: then energy is lost.
bool goes_against(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const BodyState> states, JointSystem& joints) {
  constexpr double kRounding = 1e-10;
  const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  build_joint_rows(scene, scene.dt_s, ids, states, false, joints);
  double most = 0.0, largest = 0.0;
  for (const JointRow& row : joints.rows) {
    const SolverBody &a = bodies[row.a], &b = bodies[row.b];
    largest =
        std::max(largest, a.linear.norm() + b.linear.norm() + row.turn_a.norm() * a.angular.norm() +
                              row.turn_b.norm() * b.angular.norm());
    if (row.kind == JointRowKind::kHolds) most = std::max(most, std::abs(velocity_of(row, bodies)));
  }
  return most > kRounding * largest;
}

// Of an island with springs. At the ends of a swing there is no motion to take an error from, nor
// does the composition, symmetric in time, leave one there. False if it errs by more than a trace.
bool keep_sprung_energy(const SceneDescription& scene, double part_s, std::span<const BodyId> ids,
                        std::span<const BodyState> from, const JointSystem& joints, bool afloat,
                        std::span<BodyState> states, IslandReport& report) {
  constexpr double kTrace = 1e-3;
  const std::vector<SpringRow> before = spring_rows(scene, ids, from, joints);
  const std::vector<SpringRow> after = spring_rows(scene, ids, states, joints);
  const double lent = elastic_joule(before), kept = elastic_joule(after);
  const EnergyExcess excess = energy_excess(scene, part_s, ids, from, states, lent - kept);
  const double gain = excess.gain_joule;
  const bool damped = std::ranges::any_of(
      after, [](const SpringRow& spring) { return spring.damping_newton_s_m > 0.0; });
  if (gain > 0.0 || !damped) take_trace(scene, ids, excess, kTrace, afloat, states, report);
  return damped ? gain <= kTrace * (excess.moving_joule + lent + kept)
                : std::abs(gain) <= kTrace * (excess.moving_joule + lent + kept);
}

// Of a number of equal parts of the step. Its energy is kept, or may fall where something is
// stopped. False if joints do not hold, or the energy errs by more than a trace; of a loss not
// where there are to be no `more_parts`.
bool advance_parts(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                   int parts, bool fourth, bool more_parts, JointSystem& joints,
                   std::vector<BodyState>& states, IslandReport& report) {
  constexpr double kTrace = 1e-3, kMostGiven = 0.1;
  const double part_s = dt_s / parts;
  const bool pushed = std::ranges::any_of(
      ids, [&scene](BodyId id) { return is_pushed(scene.bodies[index_of(id)]); });
  const bool sprung = has_springs(scene, joints);
  LinkageWork work;
  work.loses = goes_against(scene, ids, states, joints);
  const bool afloat = is_afloat(ids.size(), joints, nullptr);
  for (int i = 0; i < parts; ++i) {
    const std::vector<BodyState> from = states;
    if (!fourth && !advance_linkage_once(scene, part_s, ids, joints, states, report, work))
      return false;
    for (std::size_t k = 0; fourth && k < kStages.size(); ++k)
      if (!advance_linkage_once(scene, kStages[k] * part_s, ids, joints, states, report, work))
        return false;
    if (pushed) continue;
    if (sprung) {
      if (!keep_sprung_energy(scene, part_s, ids, from, joints, afloat, states, report))
        return false;
      continue;
    }
    const EnergyExcess excess = energy_excess(scene, part_s, ids, from, states, work.motors_joule);
    if (!excess.is_trace(kTrace)) return false;
    const bool lost = excess.gain_joule < 0.0 && !work.loses;
    const bool little = -excess.gain_joule <= kTrace * excess.moving_joule;
    if (!fourth && lost && !little && more_parts) return false;
    if (excess.gain_joule > 0.0 ||
        (lost && -excess.gain_joule <= (fourth ? kTrace : kMostGiven) * excess.moving_joule))
      take_excess(scene, ids, excess, afloat, states, report);
    // A motor that pushes what rests works on its rounding: then the bodies know better.
    if (excess.gain_joule == 0.0 && work.motors_joule != 0.0)
      work.motors_joule = std::max(work.motors_joule, gain_joule(scene, ids, from, states));
    report.motor_work_joule += work.motors_joule;
    work = {};
  }
  return true;
}

}  // namespace

bool advance_linkage(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     JointSystem& joints, std::span<BodyState> states, IslandReport& report,
                     std::vector<AdvanceFault>& faults) {
  const bool fourth = is_reversible(scene, ids, joints);
  if (!fourth && has_springs(scene, joints)) return false;
  const int substeps = substeps_of(scene, dt_s, ids, states, fourth, joints);
  if (substeps == 0) return false;
  std::vector<BodyState> next;
  IslandReport linked = report;
  bool holds = false;
  for (int parts = substeps; !holds && parts <= kMostParts; parts *= 4) {
    next.assign(states.begin(), states.end());
    linked = report;
    const bool more = 4 * parts <= kMostParts;
    holds = advance_parts(scene, dt_s, ids, parts, fourth, more, joints, next, linked);
  }
  if (!holds) return false;
  if (!fourth) {
    const Vec3 by_world = linked.static_impulse_newton_s - report.static_impulse_newton_s;
    linked.static_impulse_newton_s += unforeseen_newton_s(scene, dt_s, ids, states, next, by_world);
  }
  report = linked;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].impulses.clear();
    const char* fault = fault_of(next[i]);
    if (*fault)
      faults.push_back({ids[i], fault});
    else
      states[i] = std::move(next[i]);
  }
  return true;
}

}  // namespace soda::physics
