#include "physics/math/envelope_matrix.hpp"

#include <algorithm>

namespace soda::physics {
namespace {

// Below this part of the diagonal, what elimination has left of it is rounding.
constexpr double kDependent = 1e-11;

}  // namespace

void EnvelopeMatrix::reset(std::span<const std::uint32_t> first) {
  first_.assign(first.begin(), first.end());
  begin_.resize(first.size() + 1);
  begin_[0] = 0;
  for (std::size_t i = 0; i < first.size(); ++i) begin_[i + 1] = begin_[i] + i + 1 - first[i];
  values_.assign(begin_.back(), 0.0);
}

void EnvelopeMatrix::factor() {
  inverse_pivots_.assign(first_.size(), 0.0);
  for (std::size_t i = 0; i < first_.size(); ++i) {
    double* const row = row_of(i);
    const std::size_t first = first_[i];
    const double diagonal = row[i];
    for (std::size_t j = first; j < i; ++j) {
      const double* const other = row_of(j);
      double sum = row[j];
      for (std::size_t k = std::max<std::size_t>(first, first_[j]); k < j; ++k)
        sum -= row[k] * other[k];
      row[j] = sum;
    }
    double pivot = diagonal;
    for (std::size_t j = first; j < i; ++j) {
      const double scaled = row[j] * inverse_pivots_[j];
      pivot -= row[j] * scaled;
      row[j] = scaled;
    }
    if (pivot > kDependent * diagonal) inverse_pivots_[i] = 1.0 / pivot;
  }
}

std::uint64_t EnvelopeMatrix::factor_multiplications(std::span<const std::uint32_t> first) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < first.size(); ++i)
    for (std::size_t j = first[i]; j < i; ++j)
      sum += 2 + j - std::max<std::size_t>(first[i], first[j]);
  return sum;
}

void EnvelopeMatrix::solve(std::span<double> unknowns) const {
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const double* const row = row_of(i);
    double sum = unknowns[i];
    for (std::size_t j = first_[i]; j < i; ++j) sum -= row[j] * unknowns[j];
    unknowns[i] = sum;
  }
  for (std::size_t i = 0; i < unknowns.size(); ++i) unknowns[i] *= inverse_pivots_[i];
  for (std::size_t i = unknowns.size(); i-- > 0;) {
    const double* const row = row_of(i);
    const double known = unknowns[i];
    for (std::size_t j = first_[i]; j < i; ++j) unknowns[j] -= row[j] * known;
  }
}

}  // namespace soda::physics
