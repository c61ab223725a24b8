#include "physics/refinement/friction_reversals.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"

namespace soda::physics {
namespace {

// A contact point, and with which velocity it slides in given states; the point stays on the
// bodies.
struct SlidingPoint {
  static constexpr std::size_t kNone = ~std::size_t{0};
  std::size_t a = 0;
  std::size_t b = kNone;  // of a static: none
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero(), normal = Vec3::Zero();
  Vec3 surface_m_s = Vec3::Zero();
  double rolling_arm_m = 0.0;  // > 0: the bodies' relative rotation, at this distance, instead

  Vec3 slip_m_s(std::span<const BodyState> states) const {
    if (rolling_arm_m > 0.0) {
      const Vec3 of_b = b == kNone ? Vec3(Vec3::Zero()) : states[b].angular_velocity_rad_s;
      return (of_b - states[a].angular_velocity_rad_s) * rolling_arm_m;
    }
    const auto speed_of = [&states](std::size_t body, const Vec3& arm) -> Vec3 {
      return states[body].linear_velocity_m_s + states[body].angular_velocity_rad_s.cross(arm);
    };
    const Vec3 velocity = (b == kNone ? surface_m_s : speed_of(b, arm_b)) - speed_of(a, arm_a);
    return velocity - normal * normal.dot(velocity);
  }
};

bool is_stopped(const Vec3& before, const Vec3& after) {
  constexpr double kTrace = 1e-3;
  return after.squaredNorm() <= kTrace * kTrace * before.squaredNorm();
}

SlidingPoint point_of(const RefinedIsland& island, const ContactManifold& m) {
  SlidingPoint point;
  point.a = place_of(island.ids, m.a);
  if (!is_static(m.b))
    point.b = place_of(island.ids, m.b);
  else
    point.surface_m_s = island.scene.statics[static_index_of(m.b)].surface_velocity_m_s;
  point.normal = m.normal;
  return point;
}

bool presses(const ContactManifold& m, const BodyState& a) {
  for (std::uint32_t i = 0; i < m.count; ++i)
    if (pressed(a, m, m.points[i].feature)) return true;
  return false;
}

// Calls `see` with each point that slides at `from`, and at `to` slides another way or does not,
// and with the slip at both; where there is rolling friction, the same with what turns.
template <class See>
void for_each_turned(const RefinedIsland& island, std::span<const ContactManifold> start,
                     std::span<const BodyState> from, std::span<const BodyState> to,
                     const See& see) {
  const auto look = [&](const SlidingPoint& point) {
    const Vec3 before = point.slip_m_s(from), after = point.slip_m_s(to);
    if (before.dot(after) < 0.0 || is_stopped(before, after)) see(point, before, after);
  };
  for (const ContactManifold& m : start) {
    if (is_joint(m)) continue;
    const Material &a = material_of(island.scene, m.a), &b = material_of(island.scene, m.b);
    const bool rubs = a.friction > 0.0 && b.friction > 0.0;
    const bool rolls = turns_back_rolling(a) || turns_back_rolling(b);
    if (!rubs && !rolls) continue;
    SlidingPoint point = point_of(island, m);
    for (std::uint32_t i = 0; rubs && i < m.count; ++i) {
      if (!pressed(to[point.a], m, m.points[i].feature)) continue;
      const Vec3& at = m.points[i].position_m;
      point.arm_a = at - from[point.a].position_m;
      if (point.b != SlidingPoint::kNone) point.arm_b = at - from[point.b].position_m;
      look(point);
    }
    if (!rolls || !presses(m, to[point.a])) continue;
    point.rolling_arm_m = island.sizes.bodies[point.a].radius_m;
    look(point);
  }
}

double relative_error_of(const RefinedIsland& island, std::size_t body, const Vec3& before,
                         const Vec3& after) {
  const double squared = is_stopped(before, after)
                             ? before.squaredNorm()
                             : std::min(before.squaredNorm(), after.squaredNorm());
  return std::sqrt(squared) * island.sizes.dt_s / island.sizes.bodies[body].width_m;
}

}  // namespace

StepError reversal_error(const RefinedIsland& island, std::span<const ContactManifold> start,
                         std::span<const BodyState> from, std::span<const BodyState> to) {
  StepError most;
  for_each_turned(
      island, start, from, to,
      [&](const SlidingPoint& point, const Vec3& before, const Vec3& after) {
        most = larger(most, {relative_error_of(island, point.a, before, after), point.a});
      });
  return most;
}

std::optional<double> share_before_reversal(RefinedIsland& island, double time_s,
                                            std::span<const ContactManifold> start,
                                            std::span<const BodyState> from,
                                            std::span<const BodyState> to) {
  constexpr double kShort = 1.0 / 1024.0;
  const Trial begun = try_steps(island, from, start, kShort * time_s, 1);
  if (begun.failed) return {};
  double first = 1.0;
  for_each_turned(island, start, from, to,
                  [&](const SlidingPoint& point, const Vec3& before, const Vec3& after) {
                    const double relative_error = relative_error_of(island, point.a, before, after);
                    const Vec3 change = point.slip_m_s(begun.states) - before;
                    const double slowed = -before.dot(change) / kShort;  // in all of the time
                    if (!(slowed > before.squaredNorm())) return;
                    const double share = before.squaredNorm() / slowed;
                    if (share < 2.0 * kShort) return;  // a jump
                    if (island.budget.allows(relative_error * (1.0 - share), time_s)) return;
                    first = std::min(first, share);
                  });
  if (!(first < 1.0)) return {};
  return first;
}

}  // namespace soda::physics
