// Some elements of an array, in place.
#pragma once

#include <cstdint>
#include <span>

namespace soda::physics {

// All of `from`, or its elements at `places`. Refers to both.
template <typename T>
class IndexedSpan {
 public:
  IndexedSpan() = default;
  IndexedSpan(std::span<const T> all) : from_(all), size_(all.size()) {}  // NOLINT: a whole is one
  IndexedSpan(std::span<const T> from, std::span<const std::uint32_t> places)
      : from_(from), places_(places.data()), size_(places.size()) {}

  std::size_t size() const { return size_; }
  const T& operator[](std::size_t i) const {
    return from_[places_ == nullptr ? i : static_cast<std::size_t>(places_[i])];
  }

 private:
  std::span<const T> from_;
  const std::uint32_t* places_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace soda::physics
