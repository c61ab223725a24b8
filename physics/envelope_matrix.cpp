#include "physics/envelope_matrix.hpp"

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
    const double diagonal = at(i, i);
    for (std::size_t j = first_[i]; j < i; ++j) {
      double sum = at(i, j);
      for (std::size_t k = std::max(first_[i], first_[j]); k < j; ++k) sum -= at(i, k) * at(j, k);
      at(i, j) = sum;
    }
    double pivot = diagonal;
    for (std::size_t j = first_[i]; j < i; ++j) {
      const double scaled = at(i, j) * inverse_pivots_[j];
      pivot -= at(i, j) * scaled;
      at(i, j) = scaled;
    }
    if (pivot > kDependent * diagonal) inverse_pivots_[i] = 1.0 / pivot;
  }
}

void EnvelopeMatrix::solve(std::span<double> unknowns) const {
  const auto entry = [this](std::size_t row, std::size_t column) {
    return values_[begin_[row] + column - first_[row]];
  };
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    for (std::size_t j = first_[i]; j < i; ++j) unknowns[i] -= entry(i, j) * unknowns[j];
  for (std::size_t i = 0; i < unknowns.size(); ++i) unknowns[i] *= inverse_pivots_[i];
  for (std::size_t i = unknowns.size(); i-- > 0;)
    for (std::size_t j = first_[i]; j < i; ++j) unknowns[j] -= entry(i, j) * unknowns[i];
}

}  // namespace soda::physics
