#include "analysis/event_log/motion_bounds.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

namespace soda::analysis {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::size_t kBoundBytes = 3, kBodyBytes = 6 * kBoundBytes;

// The upper 24 bits of a float that is no less, or no more.
std::uint32_t rounded_outwards(double value, bool up) {
  float number = static_cast<float>(value);
  if (up ? number < value : number > value)
    number = std::nextafter(number, up ? std::numeric_limits<float>::infinity()
                                       : -std::numeric_limits<float>::infinity());
  const auto bits = std::bit_cast<std::uint32_t>(number);
  const bool grows = std::signbit(number) != up && std::isfinite(number);
  return (bits + (grows ? 0xffu : 0u)) >> 8;
}

void put_bound(ByteBuffer& out, double value, bool up) {
  const std::uint32_t bits = rounded_outwards(value, up);
  for (std::size_t byte = 0; byte < kBoundBytes; ++byte)
    out.push_back(static_cast<unsigned char>(bits >> 8 * byte));
}

float bound_at(const unsigned char* bytes) {
  return std::bit_cast<float>(std::uint32_t{bytes[0]} << 8 | std::uint32_t{bytes[1]} << 16 |
                              std::uint32_t{bytes[2]} << 24);
}

}  // namespace

void GatheredBounds::begin(std::size_t bodies, double dt_s) {
  dt_s_ = dt_s;
  bodies_.resize(bodies);
  first_step_ = last_step_ = -1;
  restart();
}

void GatheredBounds::restart() {
  first_step_ = -1;
  speed2_ = spin2_ = 0.0;
  finite_ = true;
  for (Bounds& bounds : bodies_) {
    bounds.low.fill(kInfinite);
    bounds.high.fill(-kInfinite);
  }
}

void GatheredBounds::add(std::int64_t step, std::span<const physics::BodyId> ids,
                         std::span<const physics::BodyState> states) {
  if (first_step_ < 0) first_step_ = step;
  last_step_ = step;
  double most_speed2 = speed2_, most_spin2 = spin2_;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (physics::index_of(ids[i]) >= bodies_.size()) continue;
    Bounds& bounds = bodies_[physics::index_of(ids[i])];
    const physics::BodyState& state = states[i];
    double sum = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      const double here = state.position_m[k];
      const double there = here + dt_s_ * state.linear_velocity_m_s[k];
      bounds.low[axis] = std::min(bounds.low[axis], std::min(here, there));
      bounds.high[axis] = std::max(bounds.high[axis], std::max(here, there));
      sum += here * here;
    }
    const double speed2 = state.linear_velocity_m_s.squaredNorm(),
                 spin2 = state.angular_velocity_rad_s.squaredNorm();
    finite_ = finite_ && sum + speed2 + spin2 < kInfinite;
    most_speed2 = std::max(most_speed2, speed2);
    most_spin2 = std::max(most_spin2, spin2);
  }
  speed2_ = most_speed2;
  spin2_ = most_spin2;
}

ByteBuffer GatheredBounds::encoded() const {
  constexpr double kWider = 1.0 + 1e-12;  // covers the rounding of roots
  ByteBuffer out;
  out.reserve(48 + kBodyBytes * bodies_.size());
  put(out, first_step_);
  put(out, last_step_);
  put(out, finite_ ? std::sqrt(speed2_) * kWider : kInfinite);
  put(out, finite_ ? std::sqrt(spin2_) * kWider : kInfinite);
  put(out, static_cast<std::uint64_t>(bodies_.size()));
  for (const Bounds& bounds : bodies_) {
    for (const double low : bounds.low) put_bound(out, low, false);
    for (const double high : bounds.high) put_bound(out, high, true);
  }
  return out;
}

MotionBounds decode_bounds(std::span<const unsigned char> bytes, std::size_t bodies) {
  ByteReader in(bytes);
  MotionBounds bounds;
  bounds.first_step = in.take<std::int64_t>();
  bounds.last_step = in.take<std::int64_t>();
  bounds.most_speed_m_s = in.take_double();
  bounds.most_spin_rad_s = in.take_double();
  if (!(bounds.most_speed_m_s >= 0.0) || !(bounds.most_spin_rad_s >= 0.0))
    throw DecodeError("holds a speed that is none");
  bounds.bodies.resize(in.take_count(kBodyBytes));
  if (bounds.bodies.size() != bodies)
    throw DecodeError("holds bounds of " + std::to_string(bounds.bodies.size()) + " bodies, not " +
                      std::to_string(bodies));
  const unsigned char* next = in.take_span(kBodyBytes * bodies).data();
  const auto take = [&next](std::array<float, 3>& corner) {
    for (float& bound : corner) {
      bound = bound_at(next);
      next += kBoundBytes;
    }
  };
  for (CentreBounds& body : bounds.bodies) {
    take(body.low_m);
    take(body.high_m);
  }
  in.expect_end();
  return bounds;
}

}  // namespace soda::analysis
