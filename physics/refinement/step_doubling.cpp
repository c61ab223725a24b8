#include "physics/refinement/step_doubling.hpp"

#include <algorithm>
#include <cmath>

#include "physics/broadphase/swept_pair_query.hpp"
#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/explicit_springs.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {
namespace {

double gap_m(std::span<const ContactManifold> contacts, const ContactManifold& m,
             std::uint32_t feature) {
  for (const ContactManifold& other : contacts) {
    if (other.a != m.a || other.b != m.b || other.part != m.part) continue;
    for (std::uint32_t i = 0; i < other.count; ++i)
      if (other.points[i].feature == feature) return std::max(0.0, other.points[i].separation_m);
  }
  return 0.0;
}

void keep_in_touch(const RefinedIsland& island, double dt_s, std::span<const BodyState> states,
                   std::span<const ContactManifold> start, std::vector<ContactManifold>& now) {
  constexpr double kInTouch = 5e-3;  // of the width; half of what is kept though it does not close
  for (ContactManifold& m : now) {
    const std::size_t a = place_of(island.ids, m.a);
    for (std::uint32_t i = 0; i < m.count; ++i) {
      ContactPoint& point = m.points[i];
      const bool apart = point.separation_m > 0.0;
      if (!apart || point.separation_m > kInTouch * island.sizes.bodies[a].width_m) continue;
      if (!pressed(states[a], m, point.feature)) continue;
      point.separation_m = gap_m(start, m, point.feature) * (dt_s / island.scene.dt_s);
    }
  }
}

bool has_other_source(const RefinedIsland& island) {
  for (const BodyId id : island.ids)
    if (is_pushed(island.scene.bodies[index_of(id)])) return true;
  for (const ContactManifold& m : island.manifolds) {
    if (is_joint(m)) {
      if (island.scene.joints[joint_of(m)].motor) return true;
    } else if (is_static(m.b) &&
               island.scene.statics[static_index_of(m.b)].surface_velocity_m_s != Vec3::Zero()) {
      return true;
    }
  }
  return false;
}

double elastic_of(const RefinedIsland& island, std::span<const BodyState> states) {
  const JointSystem joints = find_joints(island.scene, island.ids, island.manifolds);
  return elastic_joule(spring_rows(island.scene, states, joints));
}

// By how much springs hold more at `to`.
double elastic_gain_joule(const RefinedIsland& island, std::span<const BodyState> from,
                          std::span<const BodyState> to) {
  return std::ranges::none_of(island.manifolds, is_joint)
             ? 0.0
             : elastic_of(island, to) - elastic_of(island, from);
}

bool is_supported(const RefinedIsland& island) {
  return std::any_of(island.manifolds.begin(), island.manifolds.end(),
                     [](const ContactManifold& m) { return is_static(m.b); });
}

// Of the centre of mass; none where statics can take momentum.
Vec3 common_velocity(const RefinedIsland& island, std::span<const BodyState> states,
                     double& mass_kg) {
  Vec3 momentum = Vec3::Zero();
  mass_kg = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double mass = island.scene.bodies[index_of(island.ids[i])].mass_kg;
    mass_kg += mass;
    momentum += states[i].linear_velocity_m_s * mass;
  }
  return is_supported(island) ? Vec3(Vec3::Zero()) : Vec3(momentum / mass_kg);
}

// A step, or a part of one.
IslandReport advance_with_springs(RefinedIsland& island, double dt_s,
                                  std::span<const ContactManifold> contacts,
                                  std::span<BodyState> states, std::vector<AdvanceFault>& faults) {
  IslandReport of_springs;
  if (!island.springs.empty()) {
    apply_explicit_springs(island.scene, dt_s, island.ids, island.springs, states, of_springs);
    island.counters.joint_rows += island.springs.joints.size();
  }
  IslandReport report = advance_once(island.over(dt_s, contacts), island.how, states,
                                     {island.scratch, island.counters, faults});
  report.static_impulse_newton_s += of_springs.static_impulse_newton_s;
  report.static_angular_impulse_newton_m_s += of_springs.static_angular_impulse_newton_m_s;
  for (const JointLoad& load : of_springs.joint_loads) add_load(load, report);
  return report;
}

}  // namespace

void find_again(const IslandStep& island, std::span<const BodyState> states,
                StageCounters& counters, std::vector<ContactManifold>& found) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  found.clear();
  const ContactManifold* before = nullptr;
  for (const ContactManifold& m : manifolds) {
    const bool again = before != nullptr && before->a == m.a && before->b == m.b;
    before = &m;
    if (again || m.b == kWorldBody) continue;
    collide({scene, geometry, dt_s, m.a, states[place_of(ids, m.a)], m.b,
             is_static(m.b) ? nullptr : &states[place_of(ids, m.b)]},
            found, counters);
  }
  append_world_joints(scene, ids, states, found);
}

bool pressed(const BodyState& state, const ContactManifold& m, std::uint32_t feature) {
  return std::any_of(state.impulses.begin(), state.impulses.end(), [&](const ContactImpulse& i) {
    return i.feature == feature && i.other == m.b && i.part == m.part && i.normal_newton_s > 0.0;
  });
}

void scale_impulses(double factor, std::span<BodyState> states) {
  if (factor == 1.0) return;
  for (BodyState& state : states) {
    for (ContactImpulse& impulse : state.impulses) {
      impulse.normal_newton_s *= factor;
      impulse.friction_newton_s *= factor;
    }
  }
}

namespace {

// Those of them that connect two bodies without contact now.
void add_links(std::span<const ContactManifold> manifolds, std::vector<ContactManifold>& left) {
  for (const ContactManifold& m : manifolds) {
    if (!is_link(m)) continue;
    const auto at = std::ranges::lower_bound(left, m, canonical_before);
    if (at == left.end() || canonical_before(m, *at)) left.insert(at, m);
  }
}

}  // namespace

void find_all_again(const IslandStep& island, std::span<const BodyState> states,
                    StageCounters& counters, std::vector<ContactManifold>& found) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const std::vector<ContactManifold> pairs =
      pairs_to_look_at(scene, geometry, dt_s, ids, states, counters);
  find_again(island.over(dt_s, pairs), states, counters, found);
  add_links(manifolds, found);
}

void contacts_at(const RefinedIsland& island, double time_s, std::span<const BodyState> states,
                 std::vector<ContactManifold>& found) {
  find_again(island.over(time_s, island.manifolds), states, island.counters, found);
}

Trial try_steps(RefinedIsland& island, std::span<const BodyState> from,
                std::span<const ContactManifold> start, double time_s, int steps) {
  Trial trial{{from.begin(), from.end()}, {}, false, {}};
  const bool explicit_springs = !island.springs.empty();
  const int parts = explicit_springs ? parts_of_explicit_springs(island.scene, time_s, island.ids,
                                                                 island.springs, from)
                                     : 1;
  const double dt_s = time_s / (steps * parts), share = dt_s / island.scene.dt_s;
  std::vector<AdvanceFault> faults;
  trial.path.reserve(from.size() * static_cast<std::size_t>(steps));
  for (int i = 0; i < steps * parts; ++i) {
    std::vector<ContactManifold>& now = island.found;
    if (i == 0)
      now.assign(start.begin(), start.end());
    else
      contacts_at(island, dt_s, trial.states, now);
    keep_in_touch(island, dt_s, trial.states, start, now);
    if (explicit_springs) std::erase_if(now, is_joint);
    scale_impulses(share, trial.states);
    const Vec3 push = push_impulses_newton_s(island.scene, dt_s, island.ids, trial.states);
    IslandReport part = advance_with_springs(island, dt_s, now, trial.states, faults);
    part.static_impulse_newton_s += push;
    scale_impulses(1.0 / share, trial.states);
    if (i == 0)
      trial.report = part;
    else
      add_part(part, trial.report);
    if ((i + 1) % parts != 0) continue;
    ++island.solves;
    for (const BodyState& state : trial.states)
      trial.path.push_back({state.linear_velocity_m_s, state.angular_velocity_rad_s});
  }
  trial.failed = !faults.empty();
  return trial;
}

RichardsonExtrapolation::RichardsonExtrapolation(const Trial& one) : one_(one) {
  last_.push_back(against_first(one));
}

RichardsonExtrapolation::Row RichardsonExtrapolation::against_first(const Trial& trial) const {
  Row row;
  row.bodies.reserve(trial.states.size());
  for (std::size_t i = 0; i < trial.states.size(); ++i)
    row.bodies.push_back(difference_of(one_.states[i], trial.states[i]));
  const IslandReport &first = one_.report, &now = trial.report;
  row.impulse = now.static_impulse_newton_s - first.static_impulse_newton_s;
  row.angular_impulse =
      now.static_angular_impulse_newton_m_s - first.static_angular_impulse_newton_m_s;
  row.work.x() = now.push_out_work_joule - first.push_out_work_joule;
  row.work.y() = now.motor_work_joule - first.motor_work_joule;
  row.loads = now.joint_loads;
  return row;
}

void RichardsonExtrapolation::add(const Trial& next) {
  std::vector<Row> rows;
  rows.reserve(last_.size() + 1);
  rows.push_back(against_first(next));
  double halvings = 1.0;  // 2^order
  for (const Row& coarse : last_) {
    halvings *= 2.0;
    const Row& fine = rows.back();
    const auto further = [halvings](const Vec3& from, const Vec3& to) -> Vec3 {
      return to + (to - from) * (1.0 / (halvings - 1.0));
    };
    Row row;
    row.bodies.reserve(fine.bodies.size());
    for (std::size_t i = 0; i < fine.bodies.size(); ++i) {
      const BodyDifference &a = coarse.bodies[i], &b = fine.bodies[i];
      row.bodies.push_back({further(a.place_m, b.place_m), further(a.rotation_rad, b.rotation_rad),
                            further(a.velocity_m_s, b.velocity_m_s),
                            further(a.angular_velocity_rad_s, b.angular_velocity_rad_s)});
    }
    row.impulse = further(coarse.impulse, fine.impulse);
    row.angular_impulse = further(coarse.angular_impulse, fine.angular_impulse);
    row.work = further(coarse.work, fine.work);
    row.loads = fine.loads;
    for (std::size_t i = 0; i < row.loads.size(); ++i) {
      const JointLoad &a = coarse.loads[i], &b = fine.loads[i];
      row.loads[i].impulse_newton_s = further(a.impulse_newton_s, b.impulse_newton_s);
      row.loads[i].angular_impulse_newton_m_s =
          further(a.angular_impulse_newton_m_s, b.angular_impulse_newton_m_s);
    }
    rows.push_back(std::move(row));
  }
  before_ = std::move(last_.front());
  last_ = std::move(rows);
}

StepError RichardsonExtrapolation::apart(const BodySizes& sizes, const Row& a, const Row& b) const {
  return apart_of(sizes, as_span(a.bodies), as_span(b.bodies));
}

StepError RichardsonExtrapolation::error(const BodySizes& sizes) const {
  return apart(sizes, last_[last_.size() - 2], last_.back());
}

StepError RichardsonExtrapolation::change(const BodySizes& sizes) const {
  return apart(sizes, before_, last_.front());
}

Trial RichardsonExtrapolation::limit(const Trial& finest) const {
  Trial limit{finest.states, finest.report, false, {}};
  const Row& row = last_.back();
  for (std::size_t i = 0; i < limit.states.size(); ++i) {
    const BodyState& from = one_.states[i];
    const BodyDifference& d = row.bodies[i];
    BodyState& state = limit.states[i];
    state.position_m = from.position_m + d.place_m;
    state.linear_velocity_m_s = from.linear_velocity_m_s + d.velocity_m_s;
    state.angular_velocity_rad_s = from.angular_velocity_rad_s + d.angular_velocity_rad_s;
    const Vec3 half = 0.5 * d.rotation_rad;
    const Quat rotation(std::sqrt(std::max(0.0, 1.0 - half.squaredNorm())), half.x(), half.y(),
                        half.z());
    state.orientation = (rotation * from.orientation).normalized();
  }
  const IslandReport& first = one_.report;
  limit.report.static_impulse_newton_s = first.static_impulse_newton_s + row.impulse;
  limit.report.static_angular_impulse_newton_m_s =
      first.static_angular_impulse_newton_m_s + row.angular_impulse;
  limit.report.joint_loads = row.loads;
  limit.report.push_out_work_joule = first.push_out_work_joule + row.work.x();
  limit.report.motor_work_joule = first.motor_work_joule + row.work.y();
  return limit;
}

namespace {

double gained_joule(const RefinedIsland& island, std::span<const BodyState> from,
                    const Trial& trial) {
  return gain_joule(island.scene, island.ids, from, trial.states) +
         elastic_gain_joule(island, from, trial.states) - trial.report.push_out_work_joule;
}

// Where springs hold all the energy, at the ends of a swing, there is no velocity to take it from:
// bodies go a trace further the way that their velocities are changing, along which forces but
// those of contacts give what is too much. False, and no change, if that does not take it.
bool take_from_springs(const RefinedIsland& island, std::span<const BodyState> from, double gain,
                       Trial& trial) {
  constexpr double kLeft = 1e-3;  // of the gain
  const std::vector<BodyState> to = trial.states;
  const auto left_after = [&](double time_s) {
    for (std::size_t i = 0; i < to.size(); ++i) {
      trial.states[i].position_m =
          to[i].position_m + (to[i].linear_velocity_m_s - from[i].linear_velocity_m_s) * time_s;
      trial.states[i].orientation = to[i].orientation;
      trial.states[i].angular_velocity_rad_s = to[i].angular_velocity_rad_s;
      rotate_by(island.scene.bodies[index_of(island.ids[i])],
                (to[i].angular_velocity_rad_s - from[i].angular_velocity_rad_s) * time_s,
                trial.states[i]);
    }
    return gained_joule(island, from, trial);
  };
  constexpr double kFirst = 1e-6;  // of a step
  double time_s = kFirst * island.sizes.dt_s;
  const double taken = gain - left_after(time_s);
  if (taken > 0.0) {
    time_s *= gain / taken;
    if (std::abs(left_after(time_s)) <= kLeft * gain) return true;
  }
  trial.states = to;
  return false;
}

}  // namespace

double take_back_gain(const RefinedIsland& island, std::span<const BodyState> from, Trial& trial) {
  constexpr double kTrace = 1e-3, kTooMuch = 2.0;
  if (has_other_source(island)) return 0.0;
  const double gain = gained_joule(island, from, trial);
  if (!(gain > 0.0)) return 0.0;
  double mass_kg = 0.0;
  const Vec3 common = common_velocity(island, trial.states, mass_kg);
  const double moving =
      kinetic_joule(island.scene, island.ids, trial.states) - 0.5 * mass_kg * common.squaredNorm();
  if (!(gain <= kTrace * moving)) {
    const bool sprung = !island.springs.empty() &&
                        gain <= kTrace * (moving + elastic_of(island, trial.states)) &&
                        take_from_springs(island, from, gain, trial);
    return sprung ? 0.0 : kTooMuch;
  }
  const double share = std::sqrt(1.0 - gain / moving);
  for (std::size_t i = 0; i < from.size(); ++i) {
    BodyState& state = trial.states[i];
    const Vec3 less = (state.linear_velocity_m_s - common) * (share - 1.0);
    if (is_supported(island))
      trial.report.static_impulse_newton_s +=
          less * island.scene.bodies[index_of(island.ids[i])].mass_kg;
    state.linear_velocity_m_s += less;
    state.angular_velocity_rad_s *= share;
  }
  return 1.0 - share;
}

}  // namespace soda::physics
