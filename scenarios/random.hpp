// Seeded random numbers whose bits depend on nothing but the seed: integer arithmetic, exact
// scaling and square roots only, no <random>.
#pragma once

#include <cmath>
#include <cstdint>

#include "physics/model/ids.hpp"

namespace soda::scenarios {

// SplitMix64 (Steele, Lea, Flood: Fast Splittable Pseudorandom Number Generators, 2014).
struct RandomStream {
  std::uint64_t state = 0;
};

constexpr std::uint64_t next_bits(RandomStream& stream) {
  std::uint64_t z = (stream.state += 0x9E3779B97F4A7C15u);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

// Independent streams for equal seeds: `stream_id` tells them apart.
constexpr RandomStream make_stream(std::uint64_t seed, std::uint64_t stream_id) {
  RandomStream stream{seed};
  stream.state = next_bits(stream) ^ (stream_id * 0xD1342543DE82EF95u);
  next_bits(stream);
  return stream;
}

// Uniform in [0, 1), a multiple of 2^-53.
constexpr double uniform_unit(RandomStream& stream) {
  return static_cast<double>(next_bits(stream) >> 11) * 0x1p-53;
}

constexpr double uniform(RandomStream& stream, double min, double max) {
  return min + (max - min) * uniform_unit(stream);
}

// Uniform in the unit ball, by rejection from the cube.
inline physics::Vec3 uniform_in_ball(RandomStream& stream) {
  for (;;) {
    const double x = uniform(stream, -1.0, 1.0);
    const double y = uniform(stream, -1.0, 1.0);
    const double z = uniform(stream, -1.0, 1.0);
    if (x * x + y * y + z * z <= 1.0) return physics::Vec3(x, y, z);
  }
}

// Uniform over rotations: Marsaglia's point on the 3-sphere from two points of the unit disc, which
// needs no trigonometry.
inline physics::Quat uniform_rotation(RandomStream& stream) {
  const auto disc = [&](double& x, double& y) {
    double r2;
    do {
      x = uniform(stream, -1.0, 1.0);
      y = uniform(stream, -1.0, 1.0);
      r2 = x * x + y * y;
    } while (r2 >= 1.0 || r2 == 0.0);
    return r2;
  };
  double a, b, c, d;
  const double s = disc(a, b);
  const double t = disc(c, d);
  const double scale = std::sqrt((1.0 - s) / t);
  return physics::Quat(a, b, c * scale, d * scale);
}

}  // namespace soda::scenarios
