// How numbers of states stand in a log, and what they are compared with: shared by what writes and
// what reads them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <tuple>
#include <vector>

#include "analysis/event_log/log_states.hpp"
#include "physics/model/body_state.hpp"

namespace soda::analysis {

// Velocity, angular velocity, orientation, position: what the next ones are predicted from comes
// first.
inline constexpr std::size_t kNumbers = 13;
using Numbers = std::array<double, kNumbers>;
// Numbers of a vector have one length.
struct NumberVector {
  std::size_t begin, end;
};
inline constexpr std::array<NumberVector, 4> kVectors{{{0, 3}, {3, 6}, {6, 10}, {10, 13}}};

static_assert(std::endian::native == std::endian::little, "bytes of numbers, the lowest first");

inline Numbers numbers_of(const physics::BodyState& state) {
  const physics::Vec3 &v = state.linear_velocity_m_s, &w = state.angular_velocity_rad_s,
                      &x = state.position_m;
  const physics::Quat& q = state.orientation;
  return {v.x(), v.y(), v.z(), w.x(), w.y(), w.z(), q.w(),
          q.x(), q.y(), q.z(), x.x(), x.y(), x.z()};
}

inline void set_numbers(const Numbers& n, physics::BodyState& state) {
  state.linear_velocity_m_s = {n[0], n[1], n[2]};
  state.angular_velocity_rad_s = {n[3], n[4], n[5]};
  state.orientation = physics::Quat(n[6], n[7], n[8], n[9]);
  state.position_m = {n[10], n[11], n[12]};
}

// Velocities are taken to stay; where they have led to is known when they are.
inline constexpr std::size_t kVelocityVectors = 2;

// What the numbers behind the velocities may be, when those are `now`'s. Only sums and products, in
// a fixed order: it must come out alike wherever the log is read.
inline void predict_rest(const Numbers& before, const Numbers& now, double dt_s, Numbers& guess) {
  const double x = 0.5 * dt_s * now[3], y = 0.5 * dt_s * now[4], z = 0.5 * dt_s * now[5];
  const double square = x * x + y * y + z * z;
  const double c = 1.0 - square * (0.5 - square * (1.0 / 24.0));
  const double s = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0));
  const double qw = before[6], qx = before[7], qy = before[8], qz = before[9];
  guess[6] = c * qw - s * (x * qx + y * qy + z * qz);
  guess[7] = c * qx + s * (x * qw + y * qz - z * qy);
  guess[8] = c * qy + s * (y * qw + z * qx - x * qz);
  guess[9] = c * qz + s * (z * qw + x * qy - y * qx);
  for (std::size_t axis = 0; axis < 3; ++axis)
    guess[10 + axis] = before[10 + axis] + dt_s * now[axis];
}

// How many bytes a number has. Behind the eight stand the codes of 4 to 8 bytes of which the three
// lowest are zero, and left out: so are differences of what is rounded to floats.
inline constexpr unsigned kFirstRounded = 9, kMostCode = 13, kZeroBits = 24;

inline unsigned code_of(std::uint64_t bits) {
  const auto length = static_cast<unsigned>(8 - std::countl_zero(bits) / 8);
  const bool rounded = (bits & ((1u << kZeroBits) - 1)) == 0 && length > 3;
  return rounded ? length - 4 + kFirstRounded : length;
}
constexpr bool is_rounded(unsigned code) { return code >= kFirstRounded; }
constexpr unsigned bytes_of(unsigned code) { return is_rounded(code) ? code - 8 : code; }

inline auto contact_key_of(const physics::ContactImpulse& impulse) {
  return std::tuple(impulse.other, impulse.part, impulse.feature);
}

// Of the same contact point before; of a new one nothing. A step has them in the order of keys.
inline physics::ContactImpulse found_in(const std::vector<physics::ContactImpulse>& impulses,
                                        const physics::ContactImpulse& key) {
  const auto found = std::ranges::lower_bound(impulses, contact_key_of(key), {}, contact_key_of);
  const bool is_there = found != impulses.end() && contact_key_of(*found) == contact_key_of(key);
  return is_there ? *found : physics::ContactImpulse{};
}

inline std::uint64_t changed_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) ^ std::bit_cast<std::uint64_t>(b);
}

// What of contacts has changed; bits of a byte.
inline constexpr unsigned kImpulsesChanged = 1, kBrokenChanged = 2;

// Null if it was not there.
inline const physics::BodyState* state_of(physics::BodyId id, const LoggedStates& before) {
  const auto found = std::ranges::lower_bound(before.ids, id);
  if (found == before.ids.end() || *found != id) return nullptr;
  return &before.states[static_cast<std::size_t>(found - before.ids.begin())];
}

}  // namespace soda::analysis
