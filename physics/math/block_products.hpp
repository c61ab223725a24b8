// Products of 6 x 6 blocks, two rows at a time. Each element's sum has one order.
#pragma once

#include "physics/math/block_cholesky.hpp"
#include "physics/math/two_lanes.hpp"

namespace soda::physics {

// Which triangle of a factorised diagonal block: the upper one, or the transpose of the lower one.
enum class Triangle { kUpper, kLowerTransposed };

// block * triangle^-1; `kUnit`: with ones on its diagonal, whatever is stored there.
template <Triangle kWhich, bool kUnit>
inline void divide_by_triangle(const Block& diagonal, Block& block) {
  for (int c = 0; c < kBlockRows; ++c) {
    double* column = &block[6 * c];
    for (int m = 0; m < c; ++m) {
      const double factor = diagonal[kWhich == Triangle::kUpper ? 6 * c + m : 6 * m + c];
      const double* known = &block[6 * m];
      for (int r = 0; r < kBlockRows; ++r) column[r] -= known[r] * factor;
    }
    if (kUnit) continue;
    const double inverse = 1.0 / diagonal[7 * c];
    for (int r = 0; r < kBlockRows; ++r) column[r] *= inverse;
  }
}

// target -= a b^T
inline void subtract_product(const Block& a, const Block& b, Block& target) {
  for (int c = 0; c < kBlockRows; ++c) {
    Two top = both(0.0), middle = top, bottom = top;
    for (int m = 0; m < kBlockRows; ++m) {
      const Two factor = both(b[6 * m + c]);
      top += load(&a[6 * m]) * factor;
      middle += load(&a[6 * m + 2]) * factor;
      bottom += load(&a[6 * m + 4]) * factor;
    }
    store(load(&target[6 * c]) - top, &target[6 * c]);
    store(load(&target[6 * c + 2]) - middle, &target[6 * c + 2]);
    store(load(&target[6 * c + 4]) - bottom, &target[6 * c + 4]);
  }
}

// target -= block * x
inline void subtract_image(const Block& block, const BlockVector& x, BlockVector& target) {
  Two top = both(0.0), middle = top, bottom = top;
  for (int c = 0; c < kBlockRows; ++c) {
    const Two factor = both(x[c]);
    top += load(&block[6 * c]) * factor;
    middle += load(&block[6 * c + 2]) * factor;
    bottom += load(&block[6 * c + 4]) * factor;
  }
  store(load(&target[0]) - top, &target[0]);
  store(load(&target[2]) - middle, &target[2]);
  store(load(&target[4]) - bottom, &target[4]);
}

// target -= block^T * y
inline void subtract_transposed_image(const Block& block, const BlockVector& y,
                                      BlockVector& target) {
  const Two top = load(&y[0]), middle = load(&y[2]), bottom = load(&y[4]);
  for (int c = 0; c < kBlockRows; ++c) {
    const Two sum = load(&block[6 * c]) * top + load(&block[6 * c + 2]) * middle +
                    load(&block[6 * c + 4]) * bottom;
    target[c] -= sum[0] + sum[1];
  }
}

}  // namespace soda::physics
