// Search in ascending ranges for what is mostly near.
#pragma once

#include <algorithm>
#include <cstddef>

namespace soda::physics {

// The first that is not less than `value`, as std::lower_bound, in a time that grows with the
// logarithm of how far from `first` it is: by steps that double.
template <class Iterator, class Value>
Iterator gallop(Iterator first, Iterator last, const Value& value) {
  const std::ptrdiff_t left = last - first;
  std::ptrdiff_t reach = 1;
  while (reach < left && first[reach] < value) reach *= 2;
  return std::lower_bound(first + reach / 2, first + std::min(reach + 1, left), value);
}

}  // namespace soda::physics
