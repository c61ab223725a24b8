#include "physics/math/block_lu.hpp"

#include <cmath>

#include "physics/math/block_products.hpp"

namespace soda::physics {
namespace {

// L with a unit diagonal, and U, in one block.
bool eliminate_diagonal(Block& block) {
  for (int k = 0; k < kBlockRows; ++k) {
    const double pivot = block[7 * k];
    if (pivot == 0.0 || !std::isfinite(pivot)) return false;
    const double inverse = 1.0 / pivot;
    for (int r = k + 1; r < kBlockRows; ++r) block[6 * k + r] *= inverse;
    for (int c = k + 1; c < kBlockRows; ++c)
      for (int r = k + 1; r < kBlockRows; ++r)
        block[6 * c + r] -= block[6 * k + r] * block[6 * c + k];
  }
  return true;
}

}  // namespace

bool factorise(const Elimination& plan, BlockMatrix& blocks) {
  auto& [lower, upper] = blocks;
  for (std::size_t k = 0; k < plan.count(); ++k) {
    const std::uint32_t begin = plan.column_begin[k], end = plan.column_begin[k + 1];
    if (!eliminate_diagonal(lower[begin])) return false;
    for (std::uint32_t i = begin + 1; i < end; ++i) {
      divide_by_triangle<Triangle::kUpper, false>(lower[begin], lower[i]);
      divide_by_triangle<Triangle::kLowerTransposed, true>(lower[begin], upper[i]);
    }
    for (std::uint32_t j = begin + 1; j < end; ++j) {
      std::uint32_t at = plan.column_begin[plan.rows[j]];
      subtract_product(lower[j], upper[j], lower[at]);
      for (std::uint32_t i = j + 1; i < end; ++i) {
        while (plan.rows[at] != plan.rows[i]) ++at;
        subtract_product(lower[i], upper[j], lower[at]);
        subtract_product(upper[i], lower[j], upper[at]);
      }
    }
  }
  return true;
}

void solve(const Elimination& plan, const BlockMatrix& factor, std::span<BlockVector> values) {
  const std::size_t count = plan.count();
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t begin = plan.column_begin[k], end = plan.column_begin[k + 1];
    const Block& diagonal = factor.lower[begin];
    BlockVector& x = values[k];
    for (int c = 0; c < kBlockRows; ++c)
      for (int r = c + 1; r < kBlockRows; ++r) x[r] -= diagonal[6 * c + r] * x[c];
    for (std::uint32_t i = begin + 1; i < end; ++i)
      subtract_image(factor.lower[i], x, values[plan.rows[i]]);
  }
  for (std::size_t k = count; k-- > 0;) {
    const std::uint32_t begin = plan.column_begin[k], end = plan.column_begin[k + 1];
    BlockVector& x = values[k];
    for (std::uint32_t i = begin + 1; i < end; ++i)
      subtract_transposed_image(factor.upper[i], values[plan.rows[i]], x);
    const Block& diagonal = factor.lower[begin];
    for (int c = kBlockRows - 1; c >= 0; --c) {
      for (int r = c + 1; r < kBlockRows; ++r) x[c] -= diagonal[6 * r + c] * x[r];
      x[c] /= diagonal[7 * c];
    }
  }
}

}  // namespace soda::physics
