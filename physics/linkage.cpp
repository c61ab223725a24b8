// Linkages: RATTLE, composed to the fourth order.
#include "physics/linkage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "physics/ball_motion.hpp"
#include "physics/forces.hpp"
#include "physics/joint_bounds.hpp"
#include "physics/joint_motion.hpp"
#include "physics/joint_work.hpp"
#include "physics/linkage_motion.hpp"
#include "physics/rigid_motion.hpp"
#include "physics/springs.hpp"

namespace soda::physics {
namespace {

constexpr int kMostParts = 256;  // of a step
// With springs, where more take longer than is worth it: times bodies, but these are granted.
constexpr double kMostSpringWork = 128.0, kLeastSpringParts = 32.0;

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

// By how much bodies may swing about taut joints and turn in a part.
struct PartBounds {
  double swing_rad = 0.0, spin_rad = 0.0;
};
// A spin has farther to go than a swing.
constexpr PartBounds kOfFourthOrder{0.5, 0.2}, kOfSecondOrder{0.25, 0.25};
// Where an estimate tells what longer parts are off by: well below what is unstable.
constexpr PartBounds kEstimated{1.0, 1.0};

double fastest_rad_s(std::span<const BodyState> states) {
  double fastest = 0.0;
  for (const BodyState& state : states)
    fastest = std::max(fastest, state.angular_velocity_rad_s.norm());
  return fastest;
}

// How many parts keep to the bounds, and are short enough to kick springs. 0 where no number would
// do.
template <class Motion>
int substeps_of(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                const JointSystem& joints, const PartBounds& bounds, Motion& motion) {
  constexpr int kMost = 100;
  constexpr double kHopeless = 1000.0;
  const std::span<const BodyState> states = std::as_const(motion).states();
  double parts = dt_s * std::max(motion.swing_rad_s(dt_s) / bounds.swing_rad,
                                 fastest_rad_s(states) / bounds.spin_rad);
  if (!(parts < kHopeless)) return 0;
  if (has_springs(scene, joints)) {
    const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
    parts = std::max(parts, parts_for(rates_of(spring_rows(scene, states, joints), bodies), dt_s));
    const double most = kMostSpringWork / static_cast<double>(ids.size());
    if (!(parts < std::max(most, kLeastSpringParts))) return 0;
  }
  return parts < kMost ? 1 + static_cast<int>(parts) : kMost;
}

// Of an island with springs. At the ends of a swing there is no motion to take an error from, nor
// does the composition, symmetric in time, leave one there. False if it errs by more than a trace.
bool keep_sprung_energy(const SceneDescription& scene, double part_s, std::span<const BodyId> ids,
                        std::span<const BodyState> from, const JointSystem& joints, bool afloat,
                        std::span<BodyState> states, IslandReport& report) {
  constexpr double kTrace = 1e-3;
  const std::vector<SpringRow> before = spring_rows(scene, from, joints);
  const std::vector<SpringRow> after = spring_rows(scene, states, joints);
  const double lent = elastic_joule(before), kept = elastic_joule(after);
  const EnergyExcess excess = energy_excess(scene, part_s, ids, from, states, lent - kept);
  const double gain = excess.gain_joule;
  const bool damped = std::ranges::any_of(
      after, [](const SpringRow& spring) { return spring.damping_newton_s_m > 0.0; });
  if (gain > 0.0 || !damped) take_trace(scene, ids, excess, kTrace, afloat, states, report);
  return damped ? gain <= kTrace * (excess.moving_joule + lent + kept)
                : std::abs(gain) <= kTrace * (excess.moving_joule + lent + kept);
}

// What parts of second order are off by, as far as their kicks tell.
class KickErrors {
 public:
  KickErrors(const BodySizes& sizes, std::span<const BodyId> ids) : sizes_(sizes), ids_(ids) {}

  void restart() { sum_ = largest_ = 0.0; }

  // A part that kicks at both ends only sees a force that changes evenly in between as if it had
  // its first half too long: of the change of velocity between both kicks, places are off by a
  // third of the time. Velocities are only by what the force bends in the part, a sixth of that for
  // as much as a radian of it. `scaled`: what energy took of velocities.
  void add(double part_s, std::span<const KickChange> changes, double scaled,
           std::span<const BodyState> states) {
    constexpr double kOfWay = 1.0 / 3.0, kOfVelocity = 1.0 / 6.0;
    differences_.clear();
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const auto& [linear, angular] = changes[i];
      const double way_s = kOfWay * part_s;
      differences_.push_back({linear * way_s, angular * way_s,
                              linear * kOfVelocity + states[i].linear_velocity_m_s * scaled,
                              angular * kOfVelocity + states[i].angular_velocity_rad_s * scaled});
    }
    const StepError error = largest_of(sizes_, differences_);
    sum_ += error.widths;
    if (!(error.widths > largest_)) return;
    largest_ = error.widths;
    worst_ = ids_[error.body];
  }

  double widths() const { return sum_; }
  void tell(IslandReport& report) const {
    report.error_estimate = sum_;
    report.worst_body = worst_;
  }

 private:
  const BodySizes& sizes_;
  std::span<const BodyId> ids_;
  std::vector<BodyDifference> differences_;
  double sum_ = 0.0, largest_ = 0.0;
  BodyId worst_{};
};

// By which share of themselves velocities change for it.
double scaled_by(const EnergyExcess& excess) {
  return excess.moving_joule > 0.0 ? 0.5 * std::abs(excess.gain_joule) / excess.moving_joule : 0.0;
}

// Equal parts of a step.
struct Parts {
  int count = 1;
  bool fourth = false;
  bool more = false;  // whether there can be
};

// Its energy is kept, or may fall where something is stopped. False if joints do not hold, or the
// energy errs by more than a trace; of a loss not where there are to be no more parts. `errors`:
// of parts of second order, where somebody asks.
template <class Motion>
bool advance_parts(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                   const JointSystem& joints, const Parts& parts, Motion& motion,
                   KickErrors* errors, IslandReport& report) {
  constexpr double kTrace = 1e-3, kMostGiven = 0.1;
  const bool fourth = parts.fourth;
  const double part_s = dt_s / parts.count;
  const bool pushed = std::ranges::any_of(
      ids, [&scene](BodyId id) { return is_pushed(scene.bodies[index_of(id)]); });
  const bool sprung = has_springs(scene, joints);
  LinkageWork& work = motion.work;
  work.loses = motion.goes_against_joints();
  const bool afloat = motion.is_afloat();
  std::vector<BodyState> from;
  for (int i = 0; i < parts.count; ++i) {
    if (!pushed) from.assign(motion.states().begin(), motion.states().end());
    if (!fourth && !motion.advance(part_s, report)) return false;
    for (std::size_t k = 0; fourth && k < kStages.size(); ++k)
      if (!motion.advance(kStages[k] * part_s, report)) return false;
    if (pushed) continue;
    const std::span<BodyState> states = motion.states();
    if (sprung) {
      if (!keep_sprung_energy(scene, part_s, ids, from, joints, afloat, states, report))
        return false;
      continue;
    }
    const EnergyExcess excess = energy_excess(scene, part_s, ids, from, states, work.motors_joule);
    if (!excess.is_trace(kTrace)) return false;
    const bool lost = excess.gain_joule < 0.0 && !work.loses;
    const bool little = -excess.gain_joule <= kTrace * excess.moving_joule;
    if (!fourth && lost && !little && parts.more) return false;
    if (excess.gain_joule > 0.0 ||
        (lost && -excess.gain_joule <= (fourth ? kTrace : kMostGiven) * excess.moving_joule))
      take_excess(scene, ids, excess, afloat, states, report);
    if (errors != nullptr) errors->add(part_s, motion.kick_changes(), scaled_by(excess), states);
    // A motor that pushes what rests works on its rounding: then the bodies know better.
    if (excess.gain_joule == 0.0 && work.motors_joule != 0.0)
      work.motors_joule = std::max(work.motors_joule, gain_joule(scene, ids, from, states));
    report.motor_work_joule += work.motors_joule;
    work = {};
  }
  return true;
}

void take_states(std::span<const BodyId> ids, std::span<BodyState> next,
                 std::span<BodyState> states, std::vector<AdvanceFault>& faults) {
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].impulses.clear();
    const char* fault = fault_of(next[i]);
    if (*fault)
      faults.push_back({ids[i], fault});
    else
      states[i] = std::move(next[i]);
  }
}

// As advance_linkage, for islands that move like this.
template <class Motion>
bool advance_as(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                const JointSystem& joints, Motion& motion, std::span<BodyState> states,
                IslandReport& report, std::vector<AdvanceFault>& faults) {
  const bool fourth = is_reversible(scene, ids, joints);
  if (!fourth && has_springs(scene, joints)) return false;
  const PartBounds bounds = scene.tolerance > 0.0 ? kEstimated
                            : fourth              ? kOfFourthOrder
                                                  : kOfSecondOrder;
  motion.start(states);
  const int substeps = substeps_of(scene, dt_s, ids, joints, bounds, motion);
  if (substeps == 0) return false;
  IslandReport linked = report;
  bool holds = false;
  for (int parts = substeps; !holds && parts <= kMostParts; parts *= 4) {
    if (parts > substeps) motion.start(states);
    linked = report;
    const bool more = 4 * parts <= kMostParts;
    holds = advance_parts(scene, dt_s, ids, joints, {parts, fourth, more}, motion, nullptr, linked);
  }
  if (!holds) return false;
  const std::span<BodyState> next = motion.states();
  if (!fourth) {
    const Vec3 by_world = linked.static_impulse_newton_s - report.static_impulse_newton_s;
    linked.static_impulse_newton_s += unforeseen_newton_s(scene, dt_s, ids, states, next, by_world);
  }
  report = linked;
  take_states(ids, next, states, faults);
  return true;
}

// How many parts there have to be where `parts` are off by some widths, to be off by no more than
// are wanted; infinite numbers included. What ways are taken to be off by falls with the square of
// the number, what velocities are with the number.
double parts_for(double widths, double wanted_widths, int parts) {
  constexpr double kOfWays = 2.0 / 3.0;  // of one part that takes the whole step
  const double ways = kOfWays / parts / (kOfWays / parts + (1.0 - kOfWays));
  const double half = 0.5 * (1.0 - ways) * widths / wanted_widths;
  return parts * (half + std::sqrt(half * half + ways * widths / wanted_widths));
}

// As advance_linkage_within, for islands that move like this.
template <class Motion>
bool advance_within(double most_widths, const BodySizes& sizes, const SceneDescription& scene,
                    double dt_s, std::span<const BodyId> ids, const JointSystem& joints,
                    Motion& motion, std::span<BodyState> states, IslandReport& report,
                    std::vector<AdvanceFault>& faults) {
  constexpr int kMost = 32;  // more take as long as those of a higher order
  constexpr int kMostTries = 3;
  constexpr double kWanted = 0.7;
  motion.start(states);
  KickErrors errors(sizes, ids);
  double wanted = substeps_of(scene, dt_s, ids, joints, kEstimated, motion);
  for (int tries = 0; tries < kMostTries && wanted >= 1.0 && wanted <= kMost; ++tries) {
    if (tries > 0) motion.start(states);
    errors.restart();
    IslandReport linked = report;
    const Parts parts{static_cast<int>(wanted), false, true};
    const bool holds = advance_parts(scene, dt_s, ids, joints, parts, motion, &errors, linked);
    if (holds && errors.widths() <= most_widths) {
      report = linked;
      errors.tell(report);
      take_states(ids, motion.states(), states, faults);
      return true;
    }
    wanted = holds ? parts_for(errors.widths(), kWanted * most_widths, parts.count) + 1.0
                   : 2.0 * parts.count;
  }
  return false;
}

}  // namespace

bool advance_linkage(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     JointSystem& joints, std::span<BodyState> states, IslandReport& report,
                     std::vector<AdvanceFault>& faults) {
  if (const Joint* ball = BallMotion::joint_of(scene, ids, joints)) {
    BallMotion motion(scene, ids.front(), *ball);
    return advance_as(scene, dt_s, ids, joints, motion, states, report, faults);
  }
  LinkageMotion motion(scene, ids, joints);
  return advance_as(scene, dt_s, ids, joints, motion, states, report, faults);
}

bool advance_linkage_within(double most_widths, const BodySizes& sizes,
                            const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                            JointSystem& joints, std::span<BodyState> states, IslandReport& report,
                            std::vector<AdvanceFault>& faults) {
  for (const BodyId id : ids)
    if (is_pushed(scene.bodies[index_of(id)])) return false;
  if (joints.bounded || has_springs(scene, joints)) return false;
  if (const Joint* ball = BallMotion::joint_of(scene, ids, joints)) {
    BallMotion motion(scene, ids.front(), *ball);
    return advance_within(most_widths, sizes, scene, dt_s, ids, joints, motion, states, report,
                          faults);
  }
  LinkageMotion motion(scene, ids, joints);
  return advance_within(most_widths, sizes, scene, dt_s, ids, joints, motion, states, report,
                        faults);
}

}  // namespace soda::physics
