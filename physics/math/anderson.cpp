#include "physics/math/anderson.hpp"

#include <algorithm>

namespace soda::physics {

// Least squares of left - sum of weight * (left - left of then), by normal equations. A trace of
// regularisation decides where iterations repeat each other.
std::array<double, AndersonAcceleration::kDepth> AndersonAcceleration::weights(
    std::span<const double> left) const {
  constexpr double kTrace = 1e-12, kLeast = 1e-300;
  std::array<std::array<double, kDepth>, kDepth> a{};
  std::array<double, kDepth> w{};
  double trace = 0.0;
  for (std::size_t r = 0; r < known_; ++r) {
    const std::vector<double>& past = past_[r].left;
    for (std::size_t c = 0; c <= r; ++c) {
      const std::vector<double>& other = past_[c].left;
      for (std::size_t k = 0; k < left.size(); ++k)
        a[r][c] += (left[k] - past[k]) * (left[k] - other[k]);
      a[c][r] = a[r][c];
    }
    for (std::size_t k = 0; k < left.size(); ++k) w[r] += (left[k] - past[k]) * left[k];
    trace += a[r][r];
  }
  for (std::size_t r = 0; r < known_; ++r) a[r][r] += kTrace * trace + kLeast;
  for (std::size_t r = 0; r < known_; ++r)
    for (std::size_t below = r + 1; below < known_; ++below) {
      const double factor = a[below][r] / a[r][r];
      for (std::size_t c = r; c < known_; ++c) a[below][c] -= factor * a[r][c];
      w[below] -= factor * w[r];
    }
  for (std::size_t r = known_; r-- > 0;) {
    for (std::size_t c = r + 1; c < known_; ++c) w[r] -= a[r][c] * w[c];
    w[r] /= a[r][r];
  }
  return w;
}

void AndersonAcceleration::remember(std::span<const double> x, std::span<const double> found) {
  std::rotate(past_.begin(), past_.end() - 1, past_.end());
  Iteration& newest = past_.front();
  newest.found.assign(found.begin(), found.end());
  newest.left.resize(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) newest.left[k] = found[k] - x[k];
  known_ = std::min(known_ + 1, kDepth);
}

void AndersonAcceleration::accelerate(std::span<const double> x, std::span<double> found) {
  std::vector<double> left(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) left[k] = found[k] - x[k];
  const std::array<double, kDepth> w = weights(left);
  std::vector<double> next(found.begin(), found.end());
  for (std::size_t r = 0; r < known_; ++r)
    for (std::size_t k = 0; k < next.size(); ++k) next[k] -= w[r] * (found[k] - past_[r].found[k]);
  remember(x, found);
  std::ranges::copy(next, found.begin());
}

}  // namespace soda::physics
