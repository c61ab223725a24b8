#include "physics/integrators/free_flight.hpp"

#include <cmath>

#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/two_lanes.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry_impl.hpp"

// Two bodies fly side by side, one in each lane of a vector. Every lane does what flown() does, in
// its order, so the bits are the same. What the common case does not cover (fast rotation, states
// near their bounds, bodies of unequal moments) is left to the function for one body.
namespace soda::physics {
namespace {

struct Two3 {
  Two x, y, z;
};
struct Two4 {
  Two w, x, y, z;
};

using physics::both;
inline Two3 both(const Vec3& v) { return {both(v.x()), both(v.y()), both(v.z())}; }
inline Two3 load(const Vec3& a, const Vec3& b) {
  return {Two{a.x(), b.x()}, Two{a.y(), b.y()}, Two{a.z(), b.z()}};
}
inline Two4 load(const Quat& a, const Quat& b) {
  return {Two{a.w(), b.w()}, Two{a.x(), b.x()}, Two{a.y(), b.y()}, Two{a.z(), b.z()}};
}
inline void store(const Two3& v, Vec3& a, Vec3& b) {
  a = Vec3(v.x[0], v.y[0], v.z[0]);
  b = Vec3(v.x[1], v.y[1], v.z[1]);
}
inline Two3 operator+(const Two3& a, const Two3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Two3 operator*(const Two3& v, Two s) { return {v.x * s, v.y * s, v.z * s}; }
// In the order of Eigen's sum of three.
inline Two squared_norm(const Two3& v) { return v.x * v.x + v.y * v.y + v.z * v.z; }
inline bool both_true(decltype(Two{} < Two{}) mask) { return (mask[0] & mask[1]) != 0; }

// rotation_by() of an angle whose halved square is small enough for its series.
inline Two4 short_rotation(const Two3& half, Two s) {
  const Two one = both(1.0);
  const Two sine_over_h =
      one - s * (1.0 / 6.0) *
                (one - s * (1.0 / 20.0) *
                           (one - s * (1.0 / 42.0) *
                                      (one - s * (1.0 / 72.0) * (one - s * (1.0 / 110.0)))));
  const Two cosine =
      one - s * (1.0 / 2.0) *
                (one - s * (1.0 / 12.0) *
                           (one - s * (1.0 / 30.0) *
                                      (one - s * (1.0 / 56.0) * (one - s * (1.0 / 90.0)))));
  const Two3 v = half * sine_over_h;
  return {cosine, v.x, v.y, v.z};
}

// First `o`, then `r`.
inline Two4 composed(const Two4& r, const Two4& o) {
  const Two w = r.w * o.w - r.x * o.x - r.y * o.y - r.z * o.z;
  const Two x = r.w * o.x + r.x * o.w + r.y * o.z - r.z * o.y;
  const Two y = r.w * o.y - r.x * o.z + r.y * o.w + r.z * o.x;
  const Two z = r.w * o.z + r.x * o.y - r.y * o.x + r.z * o.w;
  const Two squared = w * w + x * x + y * y + z * z;
  const Two inverse = both(1.0) / Two{std::sqrt(squared[0]), std::sqrt(squared[1])};
  return {w * inverse, x * inverse, y * inverse, z * inverse};
}

inline Two magnitude(Two v) { return v < both(0.0) ? -v : v; }

// That no bound is near; a fault needs an exact look.
inline bool is_harmless(const Two3& position, const Two3& velocity, Two3 angular_velocity) {
  constexpr double kNear = 0.5;
  const Two far = both(kNear * kLargestPosition_m);
  const auto inside =
      (magnitude(position.x) < far) & (magnitude(position.y) < far) & (magnitude(position.z) < far);
  const auto slow = (squared_norm(velocity) < both(kNear * kLargestSpeed_m_s * kLargestSpeed_m_s)) &
                    (squared_norm(angular_velocity) <
                     both(kNear * kLargestAngularSpeed_rad_s * kLargestAngularSpeed_rad_s));
  return both_true(inside & slow);
}

struct Flight2 {
  Two3 gravity;  // change of velocity
  Two3 fall;     // displacement of a body that starts at rest
  Two time_s;
};

// False: not a case for this function; nothing has happened.
bool fly_two(const Flight2& flight, BodyState& a, BodyState& b) {
  constexpr double kLongestHalf_rad = 0.25;  // as in rotation_by()
  constexpr double kUnit = 1e-7;
  const Two3 angular_velocity = load(a.angular_velocity_rad_s, b.angular_velocity_rad_s);
  const Two3 angle = angular_velocity * flight.time_s;
  const auto at_rest = (angle.x == both(0.0)) & (angle.y == both(0.0)) & (angle.z == both(0.0));
  const Two3 half = angle * both(0.5);
  const Two squared = squared_norm(half);
  if (!both_true(squared <= both(kLongestHalf_rad * kLongestHalf_rad))) return false;
  const Two3 velocity = load(a.linear_velocity_m_s, b.linear_velocity_m_s);
  const Two3 position = load(a.position_m, b.position_m) + velocity * flight.time_s + flight.fall;
  const Two3 faster = velocity + flight.gravity;
  if (!is_harmless(position, faster, angular_velocity)) return false;
  const Two4 before = load(a.orientation, b.orientation);
  const Two4 turned = composed(short_rotation(half, squared), before);
  // What does not turn keeps its bits.
  const Two4 q{at_rest ? before.w : turned.w, at_rest ? before.x : turned.x,
               at_rest ? before.y : turned.y, at_rest ? before.z : turned.z};
  const Two unit = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - both(1.0);
  if (!both_true(magnitude(unit) < both(kUnit))) return false;
  a.orientation = Quat(q.w[0], q.x[0], q.y[0], q.z[0]);
  b.orientation = Quat(q.w[1], q.x[1], q.y[1], q.z[1]);
  store(position, a.position_m, b.position_m);
  store(faster, a.linear_velocity_m_s, b.linear_velocity_m_s);
  a.impulses.clear();
  b.impulses.clear();
  return true;
}

}  // namespace

void advance_free_bodies(const IslandStep& step, std::span<const std::uint32_t> free,
                         std::span<BodyState> states, StageCounters& counters,
                         std::vector<AdvanceFault>& faults) {
  const SceneDescription& scene = step.scene;
  const std::span<const BodyId> ids = step.ids;
  const double dt_s = step.dt_s;
  const std::vector<bool>& simple = step.geometry.impl().flies_simply;
  const Flight2 flight{both(scene.gravity_m_s2 * dt_s),
                       both(scene.gravity_m_s2 * (0.5 * dt_s * dt_s)), both(dt_s)};
  const auto is_simple = [&](std::size_t i) { return simple[index_of(ids[free[i]])]; };
  std::size_t i = 0;
  while (i < free.size()) {
    if (i + 1 < free.size() && is_simple(i) && is_simple(i + 1) &&
        fly_two(flight, states[free[i]], states[free[i + 1]])) {
      counters.free_bodies_advanced += 2;
      i += 2;
      continue;
    }
    advance_free_body(scene, dt_s, ids[free[i]], states[free[i]], counters, faults);
    counters.kinematic_bodies += scene.bodies[index_of(ids[free[i]])].kinematic;
    ++i;
  }
}

}  // namespace soda::physics
