#include "physics/integrators/articulated_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/constraints/springs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/island_report.hpp"
#include "physics/solvers/joint_work.hpp"

namespace soda::physics {
namespace {

// With springs, where more parts take longer than is worth it: times bodies, but these are granted.
constexpr double kMostSpringWork = 128.0, kLeastSpringParts = 32.0;

// Stages of the composition of a symmetric method of second order that is of fourth order (Suzuki):
// parts of the step, the middle one backwards.
constexpr double kOuter = 0.41449077179437574;  // 1 / (4 - cbrt(4))
constexpr std::array kStages{kOuter, kOuter, 1.0 - 4.0 * kOuter, kOuter, kOuter};

double fastest_rad_s(std::span<const BodyState> states) {
  double fastest = 0.0;
  for (const BodyState& state : states)
    fastest = std::max(fastest, state.angular_velocity_rad_s.norm());
  return fastest;
}

// Of an island with springs, after a part. At the ends of a swing there is no motion to take an
// error from, nor does the composition, symmetric in time, leave one there. False if it errs by
// more than a trace.
bool keep_sprung_energy(const ArticulatedIsland& articulated, double part_s,
                        std::span<const BodyState> from, bool isolated, IslandReport& report) {
  constexpr double kTrace = 1e-3;
  const auto& [island, joints, motion] = articulated;
  const SceneDescription& scene = island.scene;
  const std::span<BodyState> states = motion.states();
  const std::vector<SpringRow> before = spring_rows(scene, from, joints);
  const std::vector<SpringRow> after = spring_rows(scene, states, joints);
  const double lent = elastic_joule(before), kept = elastic_joule(after);
  const EnergyExcess excess = energy_excess(scene, part_s, island.ids, from, states, lent - kept);
  const double gain = excess.gain_joule;
  const bool damped = std::ranges::any_of(
      after, [](const SpringRow& spring) { return spring.damping_newton_s_m > 0.0; });
  if (gain > 0.0 || !damped) take_trace(scene, island.ids, excess, isolated, states, report);
  return damped ? gain <= kTrace * (excess.moving_joule + lent + kept)
                : std::abs(gain) <= kTrace * (excess.moving_joule + lent + kept);
}

// By which share of themselves velocities change for it.
double scaled_by(const EnergyExcess& excess) {
  return excess.moving_joule > 0.0 ? 0.5 * std::abs(excess.gain_joule) / excess.moving_joule : 0.0;
}

}  // namespace

int most_parts(JointSystem& joints) {
  constexpr double kMostWork = 4e7, kOfPart = 50.0;  // multiplications; factorisations
  constexpr double kLeast = 16.0, kMost = 256.0;
  const double once = factor_multiplications(std::numeric_limits<double>::infinity(), joints);
  return static_cast<int>(std::clamp(kMostWork / (kOfPart * once), kLeast, kMost));
}

int substeps_of(const ArticulatedIsland& articulated, const PartBounds& bounds) {
  constexpr int kMost = 100;
  constexpr double kHopeless = 1000.0;
  const auto& [island, joints, motion] = articulated;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const std::span<const BodyState> states = motion.states();
  double parts = dt_s * std::max(motion.swing_rad_s(dt_s) / bounds.swing_rad,
                                 fastest_rad_s(states) / bounds.rotation_rad);
  if (!(parts < kHopeless)) return 0;
  if (has_springs(scene, joints)) {
    const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
    parts = std::max(parts, parts_for(rates_of(spring_rows(scene, states, joints), bodies), dt_s));
    const double most = kMostSpringWork / static_cast<double>(ids.size());
    if (!(parts < std::max(most, kLeastSpringParts))) return 0;
  }
  return parts < kMost ? 1 + static_cast<int>(parts) : kMost;
}

void KickErrors::add(double part_s, std::span<const KickChange> changes, double scaled,
                     std::span<const BodyState> states) {
  constexpr double kOfDisplacement = 1.0 / 3.0, kOfVelocity = 1.0 / 6.0;
  differences_.clear();
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const auto& [linear, angular] = changes[i];
    const double displacement_s = kOfDisplacement * part_s;
    differences_.push_back({linear * displacement_s, angular * displacement_s,
                            linear * kOfVelocity + states[i].linear_velocity_m_s * scaled,
                            angular * kOfVelocity + states[i].angular_velocity_rad_s * scaled});
  }
  const StepError error = largest_of(sizes_, differences_);
  sum_ += error.relative_error;
  if (!(error.relative_error > largest_)) return;
  largest_ = error.relative_error;
  worst_ = ids_[error.body];
}

PartsEnd advance_parts(const ArticulatedIsland& articulated, const Parts& parts, KickErrors* errors,
                       IslandReport& report) {
  const auto& [island, joints, motion] = articulated;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  constexpr double kTrace = 1e-3, kMostGiven = 0.1;
  const bool fourth = parts.fourth;
  const double part_s = dt_s / parts.count;
  const bool pushed = std::ranges::any_of(
      ids, [&scene = scene](BodyId id) { return is_pushed(scene.bodies[index_of(id)]); });
  const bool sprung = has_springs(scene, joints);
  ArticulatedWork& work = motion.work;
  work.loses = motion.goes_against_joints();
  const bool isolated = motion.is_isolated();
  std::vector<BodyState> from;
  for (int i = 0; i < parts.count; ++i) {
    if (!pushed) from.assign(motion.states().begin(), motion.states().end());
    if (!fourth && !motion.advance(part_s, report)) return PartsEnd::kOpen;
    for (std::size_t k = 0; fourth && k < kStages.size(); ++k)
      if (!motion.advance(kStages[k] * part_s, report)) return PartsEnd::kOpen;
    if (pushed) continue;
    const std::span<BodyState> states = motion.states();
    if (sprung) {
      if (!keep_sprung_energy(articulated, part_s, from, isolated, report))
        return PartsEnd::kEnergy;
      continue;
    }
    const EnergyExcess excess = energy_excess(scene, part_s, ids, from, states, work.motors_joule);
    if (!excess.is_trace(kTrace) && !excess.is_rounding(excess.gain_joule))
      return PartsEnd::kEnergy;
    const bool lost = excess.gain_joule < 0.0 && !work.loses;
    const bool little = -excess.gain_joule <= kTrace * excess.moving_joule;
    if (!fourth && lost && !little && parts.more) return PartsEnd::kEnergy;
    if (excess.gain_joule > 0.0 ||
        (lost && -excess.gain_joule <= (fourth ? kTrace : kMostGiven) * excess.moving_joule))
      report.push_out_work_joule += take_excess(scene, ids, excess, isolated, states, report);
    if (errors != nullptr) errors->add(part_s, motion.kick_changes(), scaled_by(excess), states);
    // A motor that pushes what rests works on its rounding: then the bodies know better.
    if (excess.gain_joule == 0.0 && work.motors_joule != 0.0)
      work.motors_joule = std::max(work.motors_joule, gain_joule(scene, ids, from, states));
    report.motor_work_joule += work.motors_joule;
    work = {};
  }
  return PartsEnd::kHolds;
}

void take_states(const ArticulatedIsland& articulated, std::span<BodyState> states,
                 std::vector<AdvanceFault>& faults) {
  const std::span<const BodyId> ids = articulated.island.ids;
  const std::span<BodyState> next = articulated.motion.states();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].impulses.clear();
    const char* fault = fault_of(next[i]);
    if (*fault)
      faults.push_back({ids[i], fault});
    else {
      next[i].broken_joints = std::move(states[i].broken_joints);
      states[i] = std::move(next[i]);
    }
  }
}

}  // namespace soda::physics
