// Random numbers that roll back: a generator that is part of an LP's state.
#pragma once

#include <cstdint>

#include "kernel/api/hash_mix.hpp"

namespace soda::kernel {

// A value of 8 bytes, to be kept in the state of an LP: saved and restored with it, so that an
// execution that is repeated draws what it drew. Of one seed, each LP takes a stream of its own.
// Integers and exact operations only: the same numbers on every machine.
class Random {
 public:
  constexpr Random() = default;
  constexpr Random(std::uint64_t seed, std::uint64_t stream) : counter_(append(seed, stream)) {}

  constexpr std::uint64_t next() { return mix64(counter_ += 0x9e3779b97f4a7c15ull); }
  // Uniform over 0 .. bound - 1 up to a bias of bound / 2^64; bound >= 1.
  constexpr std::uint64_t below(std::uint64_t bound) { return next() % bound; }
  // Uniform over [0, 1): a multiple of 2^-53.
  constexpr double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  // Exponential with mean 1, without a logarithm, whose last bits differ between machines: of
  // uniform numbers, runs that fall are counted (J. von Neumann 1951).
  constexpr double exponential() {
    for (double whole = 0.0;; whole += 1.0) {
      const double first = uniform();
      double last = first;
      bool is_odd = true;  // numbers of the run
      for (double next = uniform(); next < last; next = uniform()) {
        last = next;
        is_odd = !is_odd;
      }
      if (is_odd) return whole + first;
    }
  }

 private:
  std::uint64_t counter_ = 0;
};

}  // namespace soda::kernel
