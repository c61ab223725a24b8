#include "physics/events/linked_step.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "physics/constraints/joint_rows.hpp"
#include "physics/events/linked_encounters.hpp"
#include "physics/events/linked_impacts.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/refinement/advance_resting.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/solvers/substeps.hpp"

namespace soda::physics {
namespace {

// The rotation vector that leads from one orientation to another, up to half a turn. To a
// hundredth: it says where to look, not where things are.
Vec3 rotation_between(const Quat& from, const Quat& to) {
  const Quat rotation = to * from.conjugate();
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const double quarter = rotation.vec().norm() / (1.0 + sign * rotation.w());  // its tangent
  if (!(quarter > 0.0)) return Vec3::Zero();
  const double squared = quarter * quarter;
  const double angle = 4.0 * quarter * (15.0 + 4.0 * squared) / (15.0 + 9.0 * squared);
  return rotation.vec() * (sign * angle / rotation.vec().norm());
}

// Free flight from where a part began to where it ended.
BodyState motion_between(const Vec3& field_m_s2, double time_s, const BodyState& before,
                         const BodyState& after) {
  BodyState start;
  start.broken_joints = before.broken_joints;
  start.position_m = before.position_m;
  start.orientation = before.orientation;
  start.linear_velocity_m_s =
      (after.position_m - before.position_m) / time_s - field_m_s2 * (0.5 * time_s);
  start.angular_velocity_rad_s = rotation_between(before.orientation, after.orientation) / time_s;
  return start;
}

struct LinkedPart {
  IslandReport report;
  std::vector<AdvanceFault> faults;
  std::vector<BodyState> motions;  // that the bodies made
  bool swept = false;              // its joints were
  double relative_depth = 0.0;
};

// What a part begins with.
struct PartStart {
  std::span<const ContactManifold> manifolds;
  std::span<const BodyState> states;
};

LinkedPart advance_part(const LinkedIsland& island, double time_s, const PartStart& start,
                        std::span<BodyState> states) {
  LinkedPart part;
  std::copy(start.states.begin(), start.states.end(), states.begin());
  const std::uint64_t sweeps = island.counters.joint_sweeps;
  const IslandEffects effects{island.scratch, island.counters, part.faults};
  const IslandStep over = island.over(time_s, start.manifolds);
  if (time_s > 0.0)
    part.report = island.in_substeps ? advance_substep(over, states, effects)
                                     : advance_resting(over, states, effects);
  part.swept = island.counters.joint_sweeps > sweeps;
  for (std::size_t i = 0; i < states.size(); ++i)
    part.motions.push_back(motion_between(field_of(island.scene, island.ids[i]),
                                          std::max(time_s, 1e-300), start.states[i], states[i]));
  part.relative_depth =
      relative_depth(island, start.manifolds, start.states, states, part.motions, time_s);
  return part;
}

constexpr int kMostPartsOfStep = 12;

// What parts may sink in by: a little is worth shorter parts, where much is worth more. A substep
// is short.
double allowed_depth(const LinkedIsland& island) {
  return island.wedged || island.in_substeps ? kTooDeep : kVisible;
}

// What is left after so many parts, in equal ones.
double equal_s(int parts, double left_s) { return left_s / std::max(1, kMostPartsOfStep - parts); }

// What a part sinks by is of second order in its length: how much longer the next may be, or has to
// be made itself.
double next_length(const LinkedIsland& island, const LinkedPart& part) {
  constexpr double kOfAllowed = 0.5;
  constexpr double kLeast = 1.0 / 8.0, kMost = 2.0;
  const double wanted = kOfAllowed * allowed_depth(island);
  if (!(part.relative_depth > 0.0)) return kMost;
  return std::clamp(std::sqrt(wanted / part.relative_depth), kLeast, kMost);
}

// How long a part that sank in, and was to take `whole_s`, has to be instead; none, where it is to
// be taken. A little is not worth parts that would leave none for the rest of the step, so then it
// is no shorter than `even_s`.
std::optional<double> shorter_s(const LinkedIsland& island, const LinkedPart& part, double time_s,
                                double whole_s, double even_s) {
  constexpr double kShortest = 1.0 / 256.0;
  if (!(part.relative_depth > allowed_depth(island))) return {};
  const double least_s = part.relative_depth > kTooDeep ? kShortest * whole_s : even_s;
  if (!(time_s > least_s)) return {};
  return std::max(least_s, time_s * std::min(0.5, next_length(island, part)));
}

constexpr double kNoTime = 1e-9;  // of what is left of a step: no part of its own

// How far the part after so many goes: as far as it can, and not much farther than one before it
// that had to be shortened, or a substep. Then nothing is left for after the last.
double reach_s(const LinkedIsland& island, int parts, double left_s) {
  const double longest_s =
      island.in_substeps ? island.dt_s / substeps_of(island.scene.solver) : island.longest_s;
  const double reach_s = std::max(longest_s, equal_s(parts, left_s));
  return reach_s < (1.0 - kNoTime) * left_s ? reach_s : left_s;
}

// Whether the part after so many can end early, and others follow for the rest.
bool can_be_cut(const LinkedIsland& island, int parts, double left_s) {
  const int after = kMostPartsOfStep - parts - 1;
  if (!island.in_substeps) return after > 0;
  return after * island.dt_s >= left_s * substeps_of(island.scene.solver);
}

// As before, but for the velocities: they are those found, with no more energy than there was.
void stay_at(const LinkedIsland& island, std::span<const BodyState> before,
             std::span<BodyState> states, IslandReport& report) {
  report.push_out_work_joule = report.motor_work_joule = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    states[i].position_m = before[i].position_m;
    states[i].orientation = before[i].orientation;
  }
  const double had = kinetic_joule(island.scene, island.ids, before);
  const double has = kinetic_joule(island.scene, island.ids, states);
  if (!(has > had)) return;
  // What it waits at takes the rest.
  const double share = std::sqrt(had / has);
  const IslandMomentum whole = momentum_of(island.scene, island.ids, states);
  const Vec3 taken = whole.linear_newton_s * (share - 1.0);
  report.static_impulse_newton_s += taken;
  report.static_angular_impulse_newton_m_s +=
      whole.centre_m.cross(taken) + whole.angular_newton_m_s * (share - 1.0);
  for (BodyState& state : states) {
    state.linear_velocity_m_s *= share;
    state.angular_velocity_rad_s *= share;
  }
}

// Adds a part to what the step reports. Whether it sank in so far that it is not made.
bool take(const LinkedIsland& island, std::span<const BodyState> before,
          std::span<BodyState> states, LinkedPart& part, IslandReport& report) {
  const bool sunk = part.relative_depth > kTooDeep;
  if (sunk) stay_at(island, before, states, part.report);
  add_part(part.report, report);
  return sunk;
}

// The time that is not used takes no weight away: what the island waits at bears it.
void wait_for(double time_s, const LinkedIsland& island, IslandReport& report) {
  report.beyond_tolerance = island.scene.tolerance > 0.0;
  for (const BodyId id : island.ids)
    if (falls(island.scene, id))
      report.static_impulse_newton_s -=
          field_of(island.scene, id) * (island.scene.bodies[index_of(id)].mass_kg * time_s);
}

// What drives, thrusters and damping give the bodies, as measures know it of a whole step.
Vec3 pushed_newton_s(const LinkedIsland& island, double time_s, std::span<const BodyState> states) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < states.size(); ++i)
    if (is_pushed(island.scene.bodies[index_of(island.ids[i])]))
      sum += push_impulse_newton_s(island.scene, time_s, island.ids[i], states[i]);
  return sum;
}

// A part that ends sooner, as often as it sank in and can be shorter. Returns how long it is; it
// was to take `time_s`, and is not made shorter than `even_s` for a little.
double shorten(const LinkedIsland& island, const PartStart& start, double time_s, double even_s,
               std::span<BodyState> states, LinkedPart& part) {
  const double whole_s = time_s;
  while (const auto shorter = shorter_s(island, part, time_s, whole_s, even_s)) {
    time_s = *shorter;
    part = advance_part(island, time_s, start, states);
  }
  return time_s;
}

// What the parts of a step add up to.
struct SumOfParts {
  IslandReport report, bounces;
  std::vector<AdvanceFault>& faults;
  Vec3 pushed_newton_s = Vec3::Zero();
};

// Advances by the whole step, in parts that end where something touches or would sink in.
void advance_in_parts(LinkedIsland& island, std::span<BodyState> states, SumOfParts& sum) {
  constexpr int kMostPartsThatBounce = 5;
  std::vector<ContactManifold> found;
  std::span<const ContactManifold> met = island.manifolds;
  std::vector<Touching> held;
  const bool can_bounce = !island.wedged && bounce_in_time(island, states);
  double left_s = island.dt_s;
  int number = 0;
  const auto look = [&](std::span<const BodyState> motions) {
    met = found = contacts_now(island, reach_s(island, number, left_s), met, states,
                               island.in_substeps ? std::span<const BodyState>{} : motions);
  };
  for (;; ++number) {
    if (can_bounce && resolve_linked_impacts(island, met, states, sum.bounces, island.counters))
      look({});
    const BouncesInTime located = can_bounce && number < kMostPartsThatBounce
                                      ? find_bounces_in_time(island, met, held, states)
                                      : BouncesInTime{};
    if (!located.pairs.empty()) met = located.others;
    const std::vector<BodyState> before(states.begin(), states.end());
    const double part_s = reach_s(island, number, left_s);
    LinkedPart part = advance_part(island, part_s, {met, before}, states);
    const std::optional<double> touch_s = first_bounce_s(
        island, part_s, located, first_unseen_s(island, part_s, met, before, part.motions),
        part.motions, held);
    const std::vector<BodyState> motions = part.motions;
    if (!island.in_substeps && part.swept && (touch_s || part.relative_depth > kVisible)) {
      island.in_substeps = true;
      std::copy(before.begin(), before.end(), states.begin());
      if (!located.pairs.empty()) look(motions);
      continue;
    }
    const bool is_cut = touch_s && can_be_cut(island, number, left_s);
    const double whole_s = is_cut ? *touch_s : part_s;
    if (touch_s && !is_cut) met = found = contacts_now(island, part_s, met, before, motions);
    if (touch_s) part = advance_part(island, whole_s, {met, before}, states);
    const double time_s =
        shorten(island, {met, before}, whole_s, equal_s(number, left_s), states, part);
    if (time_s < whole_s || !touch_s) island.longest_s = time_s * next_length(island, part);
    if (have_missed_one(island, located.pairs, before, states)) {
      held.insert(held.end(), located.pairs.begin(), located.pairs.end());
      std::copy(before.begin(), before.end(), states.begin());
      look(motions);
      continue;
    }
    const bool sunk = take(island, before, states, part, sum.report);
    sum.faults.insert(sum.faults.end(), part.faults.begin(), part.faults.end());
    sum.pushed_newton_s += pushed_newton_s(island, time_s, before);
    left_s -= time_s;
    const bool waits = left_s > 0.0 && (sunk || number + 1 >= kMostPartsOfStep);
    if (waits) wait_for(left_s, island, sum.report);
    if (waits || !(left_s > 0.0)) return;
    look(motions);
  }
}

}  // namespace

Need linked_impacts_needed(const SceneDescription& scene) {
  const Need joints = joint_rows_needed(scene), contacts = contacts_needed(scene);
  if (!joints) return joints;
  if (!contacts) return contacts;
  return need_of(scene.bodies.size() > 1 || solid_statics(scene) > 0,
                 "joints can draw bodies into others",
                 "one body hangs on joints, and there is nothing solid to be drawn into");
}

bool is_linked(std::span<const ContactManifold> manifolds) {
  return std::any_of(manifolds.begin(), manifolds.end(), is_joint);
}

IslandReport advance_linked(const IslandStep& step, std::span<BodyState> states,
                            const IslandEffects& effects) {
  if (step.ids.size() == 1 && step.scene.statics.empty())  // there is nothing to come to
    return advance_resting(step, states, effects);
  LinkedIsland island{step, effects.scratch, effects.counters};
  island.wedged = is_wedged(island);
  const Vec3 foreseen = pushed_newton_s(island, step.dt_s, states);
  SumOfParts sum{report_of(step.ids, {}), {}, effects.faults};
  advance_in_parts(island, states, sum);
  sum.report.static_impulse_newton_s += sum.pushed_newton_s - foreseen;
  add_bounces(sum.bounces, sum.report);
  return std::move(sum.report);
}

}  // namespace soda::physics
