// Direct solution of linear systems whose entries lie near the diagonal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace soda::physics {

// A symmetric positive matrix, factored into L D L^T. Of each row, what comes before its first
// entry stays zero. Rows that depend on earlier ones get no pivot: their unknown is 0.
class EnvelopeMatrix {
 public:
  // `first[i]` <= i: column of the first entry of row i. All zero.
  void reset(std::span<const std::uint32_t> first);
  double& at(std::size_t row, std::size_t column) {
    return values_[begin_[row] + column - first_[row]];
  }
  void factor();
  // That factor() does for a matrix with these first columns.
  static std::uint64_t factor_multiplications(std::span<const std::uint32_t> first);
  // Overwrites the right-hand side with the solution.
  void solve(std::span<double> unknowns) const;

 private:
  // Such that an entry's place is its column, from the row's first one on.
  double* row_of(std::size_t row) { return values_.data() + row_start(row); }
  const double* row_of(std::size_t row) const { return values_.data() + row_start(row); }
  std::ptrdiff_t row_start(std::size_t row) const {
    return static_cast<std::ptrdiff_t>(begin_[row]) - static_cast<std::ptrdiff_t>(first_[row]);
  }

  std::vector<std::uint32_t> first_;
  std::vector<std::size_t> begin_;  // of each row in values_; ends with its diagonal
  std::vector<double> values_;
  std::vector<double> inverse_pivots_;
};

}  // namespace soda::physics
