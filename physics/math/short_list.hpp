// Lists that are short in most islands.
#pragma once

#include <boost/container/small_vector.hpp>
#include <cstddef>
#include <span>

namespace soda::physics {

// Takes memory of its own for more than `kFew` items only.
template <class T, std::size_t kFew>
using ShortList = boost::container::small_vector<T, kFew>;

// Its iterators do not say that they are contiguous (Boost 1.74).
template <class T, std::size_t kFew>
std::span<const T> as_span(const ShortList<T, kFew>& list) {
  return {list.data(), list.size()};
}

}  // namespace soda::physics
