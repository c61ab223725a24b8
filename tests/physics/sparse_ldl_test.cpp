// Sparse L D L^T beside a dense solution.
#include "physics/math/sparse_ldl.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace soda::physics {
namespace {

struct Sparse {
  LdlPattern pattern;
  std::vector<std::uint32_t> sizes;
  Eigen::MatrixXd dense;
  std::vector<double> scales;
  SparseLdl matrix;
};

// Groups of 0 to 8 rows in any graph; some have a negative definite block of their own, as unknowns
// have that are no impulses.
Sparse any_matrix(std::mt19937_64& random, std::uint32_t groups) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<std::vector<std::uint32_t>> joined(groups);
  std::vector<std::vector<bool>> own(groups, std::vector<bool>(groups, false));
  for (std::uint32_t k = 1; k < groups; ++k)
    for (int i = 0; i < 2; ++i) {
      const auto other = static_cast<std::uint32_t>(random() % k);
      joined[other].push_back(k);
      own[k][other] = true;
    }
  for (std::uint32_t k = 0; k < groups; ++k) {  // what it changes is joined from then on
    std::sort(joined[k].begin(), joined[k].end());
    joined[k].erase(std::unique(joined[k].begin(), joined[k].end()), joined[k].end());
    for (std::size_t i = 0; i < joined[k].size(); ++i)
      for (std::size_t j = i + 1; j < joined[k].size(); ++j)
        joined[joined[k][i]].push_back(joined[k][j]);
  }
  Sparse made;
  made.pattern = ldl_pattern(joined);
  for (std::uint32_t k = 0; k < groups; ++k)
    made.sizes.push_back(static_cast<std::uint32_t>(random() % 9));
  made.matrix.reset(made.pattern, made.sizes);
  const auto rows = static_cast<Eigen::Index>(made.matrix.rows());
  made.dense = Eigen::MatrixXd::Zero(rows, rows);
  for (std::uint32_t k = 0; k < groups; ++k)
    for (std::uint32_t g = k; g < groups; ++g) {
      if (g != k && !own[g][k]) continue;
      const bool negative = k % 5 == 4;
      double* const block = made.matrix.block(made.pattern.block_of(g, k), k);
      for (std::uint32_t r = 0; r < made.sizes[g]; ++r)
        for (std::uint32_t c = 0; c < made.sizes[k] && (g != k || c <= r); ++c) {
          const double value = g == k && r == c ? (negative ? -40.0 : 40.0) : unit(random);
          block[made.sizes[k] * r + c] = value;
          const auto row = made.matrix.first_row(g) + r, column = made.matrix.first_row(k) + c;
          made.dense(row, column) = made.dense(column, row) = value;
        }
    }
  for (Eigen::Index i = 0; i < rows; ++i) made.scales.push_back(made.dense(i, i));
  return made;
}

TEST(SparseLdl, SolvesAsADenseSolutionDoes) {
  std::mt19937_64 random(11);
  for (std::uint32_t groups = 1; groups < 40; ++groups) {
    Sparse made = any_matrix(random, groups);
    const auto rows = static_cast<Eigen::Index>(made.matrix.rows());
    Eigen::VectorXd wanted(rows);
    for (Eigen::Index i = 0; i < rows; ++i) wanted[i] = std::sin(1.0 + static_cast<double>(i));
    std::vector<double> right(static_cast<std::size_t>(rows));
    Eigen::Map<Eigen::VectorXd>(right.data(), rows) = made.dense * wanted;
    made.matrix.factor(made.pattern, made.scales);
    made.matrix.solve(made.pattern, right);
    for (Eigen::Index i = 0; i < rows; ++i)
      ASSERT_NEAR(right[static_cast<std::size_t>(i)], wanted[i], 1e-12) << groups << ", row " << i;
  }
}

// A row, the same but for rounding, and their sum: the first bears all.
TEST(SparseLdl, GivesRowsThatDependOnOthersNothing) {
  std::vector<std::vector<std::uint32_t>> joined{{1}, {}};
  const LdlPattern pattern = ldl_pattern(joined);
  const std::vector<std::uint32_t> sizes{2, 1};
  SparseLdl matrix;
  matrix.reset(pattern, sizes);
  double* const own = matrix.block(pattern.block_of(0, 0), 0);
  own[0] = 1.0, own[2] = 1.0, own[3] = 1.0 + 1e-13;
  double* const between = matrix.block(pattern.block_of(1, 0), 0);
  between[0] = between[1] = 2.0;
  *matrix.block(pattern.block_of(1, 1), 1) = 4.0;
  const std::vector<double> scales{1.0, 1.0, 4.0};
  matrix.factor(pattern, scales);
  std::vector<double> unknowns{3.0, 3.0 + 1e-12, 6.0};
  matrix.solve(pattern, unknowns);
  EXPECT_EQ(unknowns, (std::vector<double>{3.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace soda::physics
