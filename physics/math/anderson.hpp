// Anderson's acceleration of a fixed-point iteration x <- g(x) (D. G. Anderson, J. ACM 12, 1965;
// type II of Walker and Ni, SIAM J. Numer. Anal. 49, 2011): the next x is where the changes of the
// last iterations say that g(x) - x vanishes. A linear g of one or few slow directions takes few
// iterations then, however slow it is by itself.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace soda::physics {

class AndersonAcceleration {
 public:
  // `found` = g(x), of the same length as `x` and as in earlier calls. Overwritten with the x to go
  // on from. A function of this call and of those since the last restart.
  void accelerate(std::span<const double> x, std::span<double> found);

  // The same without acceleration: `found` stays as it is, and later calls know of it.
  void remember(std::span<const double> x, std::span<const double> found);

  // For another g, or one that is far from linear.
  void restart() { known_ = 0; }

 private:
  static constexpr std::size_t kDepth = 3;
  struct Iteration {
    std::vector<double> found, left;  // g(x); g(x) - x
  };
  std::array<double, kDepth> weights(std::span<const double> left) const;

  std::array<Iteration, kDepth> past_;  // the newest first
  std::size_t known_ = 0;               // of these
};

}  // namespace soda::physics
