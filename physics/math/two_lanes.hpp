// Two numbers side by side, each by itself: the bits are those of single numbers. Compilers do not
// find this by themselves at -O2.
#pragma once

#include <cstring>

namespace soda::physics {

using Two [[gnu::vector_size(16)]] = double;

inline Two both(double value) { return Two{value, value}; }

inline Two load(const double* from) {
  Two out;
  std::memcpy(&out, from, sizeof out);
  return out;
}

inline void store(Two value, double* to) { std::memcpy(to, &value, sizeof value); }

}  // namespace soda::physics
