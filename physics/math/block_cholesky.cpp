#include "physics/math/block_cholesky.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "physics/math/block_products.hpp"

namespace soda::physics {
namespace {

constexpr double kBlockProduct = kBlockRows * kBlockRows * kBlockRows;

// Who is joined to whom: a row of bits for each body.
class Graph {
 public:
  Graph(std::uint32_t bodies, std::span<const std::array<std::uint32_t, 2>> edges)
      : words_((bodies + 63) / 64), bits_(std::size_t{words_} * bodies), degrees_(bodies, 0) {
    for (const auto& [a, b] : edges) {
      row(a)[b / 64] |= std::uint64_t{1} << b % 64;
      row(b)[a / 64] |= std::uint64_t{1} << a % 64;
    }
    for (std::uint32_t i = 0; i < bodies; ++i) count(i);
  }

  std::uint32_t degree(std::uint32_t body) const { return degrees_[body]; }

  template <class Do>
  void for_each_neighbour(std::uint32_t body, Do do_with) const {
    for (std::uint32_t word = 0; word < words_; ++word)
      for (std::uint64_t left = row(body)[word]; left != 0; left &= left - 1)
        do_with(64 * word + static_cast<std::uint32_t>(std::countr_zero(left)));
  }

  // Of those that were not eliminated; the first of several.
  std::uint32_t least_joined() const {
    return static_cast<std::uint32_t>(std::min_element(degrees_.begin(), degrees_.end()) -
                                      degrees_.begin());
  }

  // Its neighbours become neighbours of each other, and lose it. It keeps them.
  void eliminate(std::uint32_t body) {
    for_each_neighbour(body, [&](std::uint32_t other) {
      for (std::uint32_t word = 0; word < words_; ++word) row(other)[word] |= row(body)[word];
      for (const std::uint32_t gone : {body, other})
        row(other)[gone / 64] &= ~(std::uint64_t{1} << gone % 64);
      count(other);
    });
    degrees_[body] = ~std::uint32_t{0};
  }

 private:
  std::uint64_t* row(std::uint32_t body) { return &bits_[std::size_t{words_} * body]; }
  const std::uint64_t* row(std::uint32_t body) const { return &bits_[std::size_t{words_} * body]; }
  void count(std::uint32_t body) {
    degrees_[body] = 0;
    for (std::uint32_t word = 0; word < words_; ++word)
      degrees_[body] += static_cast<std::uint32_t>(std::popcount(row(body)[word]));
  }

  std::uint32_t words_;  // of a row
  std::vector<std::uint64_t> bits_;
  std::vector<std::uint32_t> degrees_;  // the largest number: eliminated
};

}  // namespace

std::uint32_t Elimination::block_of(std::uint32_t body_a, std::uint32_t body_b) const {
  const std::uint32_t column = std::min(place_of[body_a], place_of[body_b]);
  const std::uint32_t row = std::max(place_of[body_a], place_of[body_b]);
  if (row == column) return column_begin[column];
  const auto begin = rows.begin() + column_begin[column] + 1;
  const auto end = rows.begin() + column_begin[column + 1];
  return static_cast<std::uint32_t>(std::lower_bound(begin, end, row) - rows.begin());
}

std::optional<Elimination> plan_elimination(std::uint32_t bodies,
                                            std::span<const std::array<std::uint32_t, 2>> edges,
                                            double most_multiplications) {
  Graph graph(bodies, edges);
  std::vector<std::uint32_t> order;
  order.reserve(bodies);
  Elimination plan;
  plan.place_of.resize(bodies);
  std::size_t blocks = bodies;
  for (std::uint32_t k = 0; k < bodies; ++k) {
    const std::uint32_t body = graph.least_joined();
    const double degree = graph.degree(body);
    plan.multiplications += kBlockProduct * (0.2 + 0.5 * degree + 0.5 * degree * (degree + 1.0));
    if (plan.multiplications > most_multiplications) return std::nullopt;
    blocks += graph.degree(body);
    plan.place_of[body] = k;
    order.push_back(body);
    graph.eliminate(body);
  }
  // A column's pattern: those that were eliminated later.
  plan.column_begin.reserve(bodies + 1);
  plan.rows.reserve(blocks);
  for (const std::uint32_t body : order) {
    plan.column_begin.push_back(static_cast<std::uint32_t>(plan.rows.size()));
    plan.rows.push_back(plan.place_of[body]);
    graph.for_each_neighbour(
        body, [&](std::uint32_t other) { plan.rows.push_back(plan.place_of[other]); });
    std::sort(plan.rows.begin() + plan.column_begin.back(), plan.rows.end());
  }
  plan.column_begin.push_back(static_cast<std::uint32_t>(plan.rows.size()));
  return plan;
}

namespace {

// Lower triangle; what lies above the diagonal is neither read nor written.
bool factorise_diagonal(Block& block) {
  for (int c = 0; c < kBlockRows; ++c) {
    double pivot = block[7 * c];
    for (int m = 0; m < c; ++m) pivot -= block[6 * m + c] * block[6 * m + c];
    if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
    const double root = std::sqrt(pivot);
    block[7 * c] = root;
    for (int r = c + 1; r < kBlockRows; ++r) {
      double value = block[6 * c + r];
      for (int m = 0; m < c; ++m) value -= block[6 * m + r] * block[6 * m + c];
      block[6 * c + r] = value / root;
    }
  }
  return true;
}

}  // namespace

bool factorise(const Elimination& plan, std::vector<Block>& blocks) {
  for (std::size_t k = 0; k < plan.count(); ++k) {
    const std::uint32_t begin = plan.column_begin[k], end = plan.column_begin[k + 1];
    if (!factorise_diagonal(blocks[begin])) return false;
    for (std::uint32_t i = begin + 1; i < end; ++i)
      divide_by_triangle<Triangle::kLowerTransposed, false>(blocks[begin], blocks[i]);
    for (std::uint32_t j = begin + 1; j < end; ++j) {
      // The later rows of this column are all in column rows[j]: one walk finds them.
      std::uint32_t at = plan.column_begin[plan.rows[j]];
      for (std::uint32_t i = j; i < end; ++i) {
        while (plan.rows[at] != plan.rows[i]) ++at;
        subtract_product(blocks[i], blocks[j], blocks[at]);
      }
    }
  }
  return true;
}

void solve(const Elimination& plan, std::span<const Block> factor, std::span<BlockVector> values) {
  const std::size_t count = plan.count();
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t begin = plan.column_begin[k], end = plan.column_begin[k + 1];
    const Block& diagonal = factor[begin];
    BlockVector& x = values[k];
    for (int c = 0; c < kBlockRows; ++c) {
      x[c] /= diagonal[7 * c];
      for (int r = c + 1; r < kBlockRows; ++r) x[r] -= diagonal[6 * c + r] * x[c];
    }
    for (std::uint32_t i = begin + 1; i < end; ++i)
      subtract_image(factor[i], x, values[plan.rows[i]]);
  }
  for (std::size_t k = count; k-- > 0;) {
    const std::uint32_t begin = plan.column_begin[k], end = plan.column_begin[k + 1];
    BlockVector& x = values[k];
    for (std::uint32_t i = begin + 1; i < end; ++i)
      subtract_transposed_image(factor[i], values[plan.rows[i]], x);
    const Block& diagonal = factor[begin];
    for (int c = kBlockRows - 1; c >= 0; --c) {
      for (int r = c + 1; r < kBlockRows; ++r) x[c] -= diagonal[6 * c + r] * x[r];
      x[c] /= diagonal[7 * c];
    }
  }
}

}  // namespace soda::physics
