// Sparse direct solution of symmetric systems whose rows come in groups.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/math/short_list.hpp"

namespace soda::physics {

// Which blocks the factor has. Groups are in the order of their elimination.
struct LdlPattern {
  // Column k: blocks [column_begin[k], column_begin[k+1]), of the groups below[...], ascending; the
  // first is k itself.
  std::vector<std::uint32_t> column_begin{0}, below;

  std::size_t count() const { return column_begin.size() - 1; }
  // Of two groups that are joined, or of one; `row` is not eliminated before `column`.
  std::uint32_t block_of(std::uint32_t row, std::uint32_t column) const;
};

// `joined`: of each group those after it that its elimination changes. They contain, in turn, all
// of these that come after them. Sorted here; repetitions allowed.
LdlPattern ldl_pattern(std::span<std::vector<std::uint32_t>> joined);

// A symmetric matrix, factored into L D L^T; every sum has one order. A group can have any number
// of rows, also none. A pivot has the sign of its row's scale; where elimination leaves next to
// nothing of it (the row depends on earlier ones), its unknown is 0.
class SparseLdl {
 public:
  // All zero. `sizes`: of each group, its rows.
  void reset(const LdlPattern& pattern, std::span<const std::uint32_t> sizes);
  std::size_t rows() const { return first_row_.back(); }
  std::uint32_t first_row(std::uint32_t group) const { return first_row_[group]; }
  std::uint32_t width(std::uint32_t group) const {
    return first_row_[group + 1] - first_row_[group];
  }
  // A block of the lower triangle, row after row, each as wide as its column.
  double* block(std::uint32_t index, std::uint32_t column) {
    return values_.data() + values_begin_[column] + std::size_t{rows_above_[index]} * width(column);
  }
  // `scales`: of each row, what it has on its diagonal before anything that it gains.
  void factor(const LdlPattern& pattern, std::span<const double> scales);
  // Overwrites the right-hand side with the solution.
  void solve(const LdlPattern& pattern, std::span<double> unknowns) const;

 private:
  void factor_column(std::uint32_t column, std::span<const double> scales,
                     ShortList<double, 64>& unscaled);
  void eliminate(const LdlPattern& pattern, std::uint32_t column, std::span<const double> unscaled);

  ShortList<std::uint32_t, 4> first_row_;   // of each group, and the end
  ShortList<std::uint32_t, 4> rows_above_;  // of each block, in its column
  ShortList<std::size_t, 4> values_begin_;  // of each column, and the end
  ShortList<double, 64> values_;
  ShortList<double, 16> inverse_pivots_;
};

}  // namespace soda::physics
