// Numbers, vectors and states as bytes: what message payloads and ranks' results are made of.
#pragma once

#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <type_traits>

#include "kernel/api/payload.hpp"
#include "models/territory/territory.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"

namespace soda::models {

static_assert(std::endian::native == std::endian::little,
              "the wire format is little-endian: big-endian machines need byte swaps here");

// Of the number of a state's impulses: broken joints follow them.
inline constexpr std::uint32_t kHasBroken = 0x80000000u;
// Of an island's report. An error of joints follows the other errors, if there is any.
inline constexpr std::uint32_t kRests = 1u, kHasJointError = 2u;

// Appends to `out`, which outlives it.
class Writer {
 public:
  explicit Writer(kernel::Bytes& out) : out_(out) {}

  template <class T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    together(value);
  }
  // All of a struct of numbers without padding.
  template <class T>
  void plain(const T& value) {
    static_assert(std::has_unique_object_representations_v<T>);
    together(value);
  }
  void id(physics::BodyId value) { number(physics::index_of(value)); }
  void world(WorldId value) { number(index_of(value)); }
  void vector(const physics::Vec3& value) { together(value); }
  void impulse(const physics::ContactImpulse& value) {
    together(value.other, value.part, value.feature, value.normal_newton_s,
             value.friction_newton_s);
  }
  void state(const physics::BodyState& value) {
    const physics::Vec3 &x = value.position_m, &v = value.linear_velocity_m_s,
                        &w = value.angular_velocity_rad_s;
    const physics::Quat& q = value.orientation;
    together(x, q.w(), q.x(), q.y(), q.z(), v, w);
    const bool breaks = !value.broken_joints.empty();
    number(static_cast<std::uint32_t>(value.impulses.size()) | (breaks ? kHasBroken : 0u));
    for (const physics::ContactImpulse& item : value.impulses) impulse(item);
    if (!breaks) return;
    number(static_cast<std::uint32_t>(value.broken_joints.size()));
    for (const std::uint32_t joint : value.broken_joints) number(joint);
  }
  void manifold(const physics::ContactManifold& value) {
    together(value.a, value.b, value.part, value.count, value.normal, value.impact_s);
    for (std::uint32_t i = 0; i < value.count; ++i)
      together(value.points[i].position_m, value.points[i].separation_m, value.points[i].feature);
  }
  void island(const physics::IslandReport& value) {
    id(value.label);
    number(value.bodies);
    number(value.contact_points);
    number(static_cast<std::uint32_t>(value.direct));
    number((value.rests ? kRests : 0u) | (value.joint_error > 0.0 ? kHasJointError : 0u));
    number(value.iterations);
    number(value.multiplications);
    number(value.max_penetration_m);
    number(value.constraint_residual_m_s);
    if (value.joint_error > 0.0) number(value.joint_error);
    number(value.push_out_work_joule);
    number(value.error_estimate);
    id(value.worst_body);
    number(static_cast<std::uint32_t>(value.beyond_tolerance));
    number(value.motor_work_joule);
    vector(value.static_impulse_newton_s);
    vector(value.static_angular_impulse_newton_m_s);
  }

 private:
  template <class T>
  static const T& flat(const T& value) {
    return value;
  }
  static std::array<double, 3> flat(const physics::Vec3& value) {
    return {value.x(), value.y(), value.z()};
  }
  // Growing by a number at a time took 7 % of a run with many messages.
  template <class... Values>
  void together(const Values&... values) {
    std::array<std::byte, (sizeof(flat(values)) + ...)> bytes;
    std::size_t at = 0;
    const auto put = [&bytes, &at](const auto& value) {
      std::memcpy(bytes.data() + at, &value, sizeof value);
      at += sizeof value;
    };
    (put(flat(values)), ...);
    out_.insert(out_.end(), bytes.begin(), bytes.end());
  }

  kernel::Bytes& out_;
};

// Takes from `in`. Bytes that end early are a broken program: aborts.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> in) : in_(in) {}

  template <class T>
  T number() {
    static_assert(std::is_arithmetic_v<T>);
    return take<T>();
  }
  template <class T>
  T plain() {
    static_assert(std::has_unique_object_representations_v<T>);
    return take<T>();
  }
  physics::BodyId id() { return physics::BodyId{number<std::uint32_t>()}; }
  WorldId world() { return WorldId{number<std::uint32_t>()}; }
  physics::Vec3 vector() {
    const double x = number<double>(), y = number<double>(), z = number<double>();
    return {x, y, z};
  }
  physics::ContactImpulse impulse() {
    physics::ContactImpulse value;
    value.other = id();
    value.part = number<std::uint32_t>();
    value.feature = number<std::uint32_t>();
    value.normal_newton_s = number<double>();
    value.friction_newton_s = vector();
    return value;
  }
  physics::BodyState state() {
    physics::BodyState value;
    value.position_m = vector();
    value.orientation.w() = number<double>();
    value.orientation.x() = number<double>();
    value.orientation.y() = number<double>();
    value.orientation.z() = number<double>();
    value.linear_velocity_m_s = vector();
    value.angular_velocity_rad_s = vector();
    const auto impulses = number<std::uint32_t>();
    value.impulses.resize(impulses & ~kHasBroken);
    for (physics::ContactImpulse& item : value.impulses) item = impulse();
    if ((impulses & kHasBroken) == 0) return value;
    value.broken_joints.resize(number<std::uint32_t>());
    for (std::uint32_t& joint : value.broken_joints) joint = number<std::uint32_t>();
    return value;
  }
  physics::ContactManifold manifold() {
    physics::ContactManifold value;
    value.a = id();
    value.b = id();
    value.part = number<std::uint32_t>();
    value.count = number<std::uint32_t>();
    value.normal = vector();
    value.impact_s = number<double>();
    for (std::uint32_t i = 0; i < value.count; ++i) {
      value.points[i].position_m = vector();
      value.points[i].separation_m = number<double>();
      value.points[i].feature = number<std::uint32_t>();
    }
    return value;
  }
  physics::IslandReport island() {
    physics::IslandReport value;
    value.label = id();
    value.bodies = number<std::uint32_t>();
    value.contact_points = number<std::uint32_t>();
    value.direct = number<std::uint32_t>() != 0;
    const auto flags = number<std::uint32_t>();
    value.rests = (flags & kRests) != 0;
    value.iterations = number<std::uint32_t>();
    value.multiplications = number<std::uint64_t>();
    value.max_penetration_m = number<double>();
    value.constraint_residual_m_s = number<double>();
    if ((flags & kHasJointError) != 0) value.joint_error = number<double>();
    value.push_out_work_joule = number<double>();
    value.error_estimate = number<double>();
    value.worst_body = id();
    value.beyond_tolerance = number<std::uint32_t>() != 0;
    value.motor_work_joule = number<double>();
    value.static_impulse_newton_s = vector();
    value.static_angular_impulse_newton_m_s = vector();
    return value;
  }
  bool at_end() const { return in_.empty(); }

 private:
  template <class T>
  T take() {
    if (in_.size() < sizeof(T)) {
      std::fprintf(stderr, "soda: message payload ends early\n");
      std::abort();
    }
    T value;
    std::memcpy(&value, in_.data(), sizeof value);
    in_ = in_.subspan(sizeof value);
    return value;
  }

  std::span<const std::byte> in_;
};

}  // namespace soda::models
