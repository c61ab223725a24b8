#include "physics/math/sparse_ldl.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace soda::physics {
namespace {

// Below this part of the scale, what elimination has left of a pivot is rounding.
constexpr double kDependent = 1e-11;

struct Rows {
  const double* values;
  std::uint32_t count, width;
};

// target -= x y^T. The width is known where it is 1 to 6, as of most joints.
template <std::uint32_t kWidth>
void subtract_products(const Rows& x, const Rows& y, std::uint32_t stride, double* target) {
  const std::uint32_t width = kWidth > 0 ? kWidth : x.width;
  for (std::uint32_t i = 0; i < x.count; ++i)
    for (std::uint32_t j = 0; j < y.count; ++j) {
      const double* const of_x = x.values + std::size_t{width} * i;
      const double* const of_y = y.values + std::size_t{width} * j;
      double sum = 0.0;
      for (std::uint32_t t = 0; t < width; ++t) sum += of_x[t] * of_y[t];
      target[std::size_t{stride} * i + j] -= sum;
    }
}

void subtract(const Rows& x, const Rows& y, std::uint32_t stride, double* target) {
  using Subtract = void (*)(const Rows&, const Rows&, std::uint32_t, double*);
  constexpr Subtract kByWidth[] = {subtract_products<0>, subtract_products<1>, subtract_products<2>,
                                   subtract_products<3>, subtract_products<4>, subtract_products<5>,
                                   subtract_products<6>};
  kByWidth[x.width < std::size(kByWidth) ? x.width : 0](x, y, stride, target);
}

}  // namespace

std::uint32_t LdlPattern::block_of(std::uint32_t row, std::uint32_t column) const {
  const auto at = std::lower_bound(below.begin() + column_begin[column],
                                   below.begin() + column_begin[column + 1], row);
  return static_cast<std::uint32_t>(at - below.begin());
}

LdlPattern ldl_pattern(std::span<std::vector<std::uint32_t>> joined) {
  LdlPattern pattern;
  for (std::uint32_t k = 0; k < joined.size(); ++k) {
    std::vector<std::uint32_t>& groups = joined[k];
    groups.push_back(k);
    std::sort(groups.begin(), groups.end());
    const auto end = std::unique(groups.begin(), groups.end());
    pattern.below.insert(pattern.below.end(), groups.begin(), end);
    pattern.column_begin.push_back(static_cast<std::uint32_t>(pattern.below.size()));
  }
  return pattern;
}

void SparseLdl::reset(const LdlPattern& pattern, std::span<const std::uint32_t> sizes) {
  first_row_.assign(1, 0);
  for (const std::uint32_t size : sizes) first_row_.push_back(first_row_.back() + size);
  rows_above_.clear();
  values_begin_.assign(1, 0);
  for (std::uint32_t k = 0; k < pattern.count(); ++k) {
    std::uint32_t above = 0;
    for (std::uint32_t i = pattern.column_begin[k]; i < pattern.column_begin[k + 1]; ++i) {
      rows_above_.push_back(above);
      above += sizes[pattern.below[i]];
    }
    values_begin_.push_back(values_begin_.back() + std::size_t{above} * sizes[k]);
  }
  values_.assign(values_begin_.back(), 0.0);
}

// A column of blocks by its own rows. `unscaled`: L D.
void SparseLdl::factor_column(std::uint32_t column, std::span<const double> scales,
                              ShortList<double, 64>& unscaled) {
  const std::uint32_t m = width(column), first = first_row_[column];
  double* const values = values_.data() + values_begin_[column];
  const std::size_t count = values_begin_[column + 1] - values_begin_[column];
  unscaled.resize(count);
  for (std::uint32_t r = 0; r * std::size_t{m} < count; ++r) {
    double* const row = values + std::size_t{m} * r;
    double* const unscaled_row = unscaled.data() + std::size_t{m} * r;
    double pivot = r < m ? row[r] : 0.0;
    for (std::uint32_t c = 0; c < std::min(r, m); ++c) {
      double sum = row[c];
      for (std::uint32_t t = 0; t < c; ++t) sum -= unscaled_row[t] * values[m * c + t];
      unscaled_row[c] = sum;
      row[c] = sum * inverse_pivots_[first + c];
      pivot -= sum * row[c];
    }
    if (r >= m) continue;
    const double scale = scales[first + r], left = scale < 0.0 ? -pivot : pivot;
    if (left > kDependent * std::abs(scale)) inverse_pivots_[first + r] = 1.0 / pivot;
  }
}

// What the rows of this column take from those of later ones.
void SparseLdl::eliminate(const LdlPattern& pattern, std::uint32_t column,
                          std::span<const double> unscaled) {
  const std::uint32_t m = width(column);
  const double* const scaled = values_.data() + values_begin_[column];
  const std::uint32_t end = pattern.column_begin[column + 1];
  for (std::uint32_t j = pattern.column_begin[column] + 1; j < end; ++j) {
    const std::uint32_t later = pattern.below[j], stride = width(later);
    const Rows of_j{scaled + std::size_t{m} * rows_above_[j], stride, m};
    double* const target = values_.data() + values_begin_[later];
    // The rows of this column are all in that one: one walk finds them.
    std::uint32_t at = pattern.column_begin[later];
    for (std::uint32_t i = j; i < end && stride > 0; ++i) {
      while (pattern.below[at] != pattern.below[i]) ++at;
      const Rows of_i{unscaled.data() + std::size_t{m} * rows_above_[i], width(pattern.below[i]),
                      m};
      subtract(of_i, of_j, stride, target + std::size_t{stride} * rows_above_[at]);
    }
  }
}

void SparseLdl::factor(const LdlPattern& pattern, std::span<const double> scales) {
  inverse_pivots_.assign(rows(), 0.0);
  ShortList<double, 64> unscaled;
  for (std::uint32_t k = 0; k < pattern.count(); ++k) {
    if (width(k) == 0) continue;
    factor_column(k, scales, unscaled);
    eliminate(pattern, k, as_span(unscaled));
  }
}

void SparseLdl::solve(const LdlPattern& pattern, std::span<double> unknowns) const {
  const auto columns = static_cast<std::uint32_t>(pattern.count());
  const auto for_each_row_below = [&](std::uint32_t k, const auto& visit) {
    const std::uint32_t m = width(k);
    const double* row = values_.data() + values_begin_[k] + std::size_t{m} * m;
    for (std::uint32_t i = pattern.column_begin[k] + 1; i < pattern.column_begin[k + 1]; ++i) {
      const std::uint32_t group = pattern.below[i];
      for (std::uint32_t r = first_row_[group]; r < first_row_[group + 1]; ++r, row += m)
        visit(row, m, unknowns[r]);
    }
  };
  for (std::uint32_t k = 0; k < columns; ++k) {
    const std::uint32_t m = width(k);
    if (m == 0) continue;
    const double* const values = values_.data() + values_begin_[k];
    double* const x = unknowns.data() + first_row_[k];
    for (std::uint32_t r = 1; r < m; ++r)
      for (std::uint32_t c = 0; c < r; ++c) x[r] -= values[m * r + c] * x[c];
    for_each_row_below(k, [x](const double* row, std::uint32_t w, double& value) {
      double sum = 0.0;
      for (std::uint32_t c = 0; c < w; ++c) sum += row[c] * x[c];
      value -= sum;
    });
  }
  for (std::size_t i = 0; i < unknowns.size(); ++i) unknowns[i] *= inverse_pivots_[i];
  for (std::uint32_t k = columns; k-- > 0;) {
    const std::uint32_t m = width(k);
    if (m == 0) continue;
    const double* const values = values_.data() + values_begin_[k];
    double* const x = unknowns.data() + first_row_[k];
    for_each_row_below(k, [x](const double* row, std::uint32_t w, double& value) {
      for (std::uint32_t c = 0; c < w; ++c) x[c] -= row[c] * value;
    });
    for (std::uint32_t r = m; r-- > 1;)
      for (std::uint32_t c = 0; c < r; ++c) x[c] -= values[m * r + c] * x[r];
  }
}

}  // namespace soda::physics
