#include "physics/refined_trials.hpp"

#include <algorithm>
#include <cmath>

#include "physics/contact_solver.hpp"
#include "physics/forces.hpp"
#include "physics/geometry.hpp"
#include "physics/rigid_motion.hpp"

namespace soda::physics {
namespace {

// Stored impulses are those of a whole step, whatever the length of the last part.
void scale_impulses(double factor, std::vector<BodyState>& states) {
  if (factor == 1.0) return;
  for (BodyState& state : states) {
    for (ContactImpulse& impulse : state.impulses) {
      impulse.normal_newton_s *= factor;
      impulse.friction_newton_s *= factor;
    }
  }
}

std::size_t place_of(const RefinedIsland& island, BodyId id) {
  return static_cast<std::size_t>(std::lower_bound(island.ids.begin(), island.ids.end(), id) -
                                  island.ids.begin());
}

bool pressed(const BodyState& state, const ContactManifold& m, std::uint32_t feature) {
  return std::any_of(state.impulses.begin(), state.impulses.end(), [&](const ContactImpulse& i) {
    return i.feature == feature && i.other == m.b && i.part == m.part && i.normal_newton_s > 0.0;
  });
}

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
    const std::size_t a = place_of(island, m.a);
    for (std::uint32_t i = 0; i < m.count; ++i) {
      ContactPoint& point = m.points[i];
      const bool apart = point.separation_m > 0.0;
      if (!apart || point.separation_m > kInTouch * island.sizes.widths_m[a]) continue;
      if (!pressed(states[a], m, point.feature)) continue;
      point.separation_m = gap_m(start, m, point.feature) * (dt_s / island.scene.dt_s);
    }
  }
}

// 8/3 T4 - 2 T2 + 1/3 T1: free of the first and second power of the step.
Vec3 limit_of(const Vec3& one, const Vec3& two, const Vec3& four) {
  return four + ((four - two) * 5.0 + (one - two)) * (1.0 / 3.0);
}

bool has_other_source(const RefinedIsland& island) {
  for (const BodyId id : island.ids)
    if (is_pushed(island.scene.bodies[index_of(id)])) return true;
  for (const ContactManifold& m : island.pairs) {
    if (is_joint(m)) {
      const Joint& joint = island.scene.joints[joint_of(m)];
      if (joint.kind == JointKind::kSpring || joint.motor) return true;
    } else if (is_static(m.b) &&
               island.scene.statics[static_index_of(m.b)].surface_velocity_m_s != Vec3::Zero()) {
      return true;
    }
  }
  return false;
}

bool is_supported(const RefinedIsland& island) {
  return std::any_of(island.pairs.begin(), island.pairs.end(),
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

}  // namespace

std::vector<ContactManifold> contacts_at(const RefinedIsland& island, double time_s,
                                         std::span<const BodyState> states) {
  std::vector<ContactManifold> found;
  const ContactManifold* before = nullptr;
  for (const ContactManifold& m : island.pairs) {
    const bool again = before != nullptr && before->a == m.a && before->b == m.b;
    before = &m;
    if (again || m.b == kWorldBody) continue;
    collide(island.scene, island.geometry, time_s, m.a, states[place_of(island, m.a)], m.b,
            is_static(m.b) ? nullptr : &states[place_of(island, m.b)], found, island.counters);
  }
  append_world_joints(island.scene, island.ids, found);
  return found;
}

Trial try_steps(RefinedIsland& island, std::span<const BodyState> from,
                std::span<const ContactManifold> start, double time_s, int steps) {
  Trial trial{{from.begin(), from.end()}, {}, false, {}};
  const double dt_s = time_s / steps, share = dt_s / island.scene.dt_s;
  std::vector<AdvanceFault> faults;
  for (int i = 0; i < steps; ++i) {
    std::vector<ContactManifold> now =
        i == 0 ? std::vector<ContactManifold>(start.begin(), start.end())
               : contacts_at(island, dt_s, trial.states);
    keep_in_touch(island, dt_s, trial.states, start, now);
    scale_impulses(share, trial.states);
    const IslandReport part =
        advance_once(island.scene, dt_s, island.ids, now, trial.states, island.counters, faults);
    scale_impulses(1.0 / share, trial.states);
    if (i == 0)
      trial.report = part;
    else
      add_part(part, trial.report);
    for (const BodyState& state : trial.states) {
      trial.path.linear.push_back(state.linear_velocity_m_s);
      trial.path.angular.push_back(state.angular_velocity_rad_s);
    }
    ++island.solves;
  }
  trial.failed = !faults.empty();
  return trial;
}

Trial extrapolated(const Trial& one, const Trial& two, const Trial& four) {
  Trial limit = four;
  for (std::size_t i = 0; i < limit.states.size(); ++i) {
    const BodyState &a = one.states[i], &b = two.states[i];
    BodyState& c = limit.states[i];
    c.position_m = limit_of(a.position_m, b.position_m, c.position_m);
    c.linear_velocity_m_s =
        limit_of(a.linear_velocity_m_s, b.linear_velocity_m_s, c.linear_velocity_m_s);
    c.angular_velocity_rad_s =
        limit_of(a.angular_velocity_rad_s, b.angular_velocity_rad_s, c.angular_velocity_rad_s);
    const Vec3 turn = (5.0 * turn_between(b.orientation, c.orientation) +
                       turn_between(b.orientation, a.orientation)) *
                      (1.0 / 3.0);
    c.orientation = turned(turn, c.orientation);
  }
  const auto extrapolate = [&](Vec3 IslandReport::*sum) {
    limit.report.*sum = limit_of(one.report.*sum, two.report.*sum, four.report.*sum);
  };
  extrapolate(&IslandReport::static_impulse_newton_s);
  extrapolate(&IslandReport::static_angular_impulse_newton_m_s);
  const auto work = [](const Trial& trial) {
    return Vec3(trial.report.push_out_work_joule, 0.0, 0.0);
  };
  limit.report.push_out_work_joule = limit_of(work(one), work(two), work(four)).x();
  return limit;
}

double take_back_gain(const RefinedIsland& island, std::span<const BodyState> from, Trial& trial) {
  constexpr double kTrace = 1e-3, kTooMuch = 2.0;
  if (has_other_source(island)) return 0.0;
  const double gain =
      gain_joule(island.scene, island.ids, from, trial.states) - trial.report.push_out_work_joule;
  if (!(gain > 0.0)) return 0.0;
  double mass_kg = 0.0;
  const Vec3 common = common_velocity(island, trial.states, mass_kg);
  const double moving =
      kinetic_joule(island.scene, island.ids, trial.states) - 0.5 * mass_kg * common.squaredNorm();
  if (!(gain <= kTrace * moving)) return kTooMuch;
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
