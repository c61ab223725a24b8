#include "physics/math/block_lu.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <random>

namespace soda::physics {
namespace {

using Edge = std::array<std::uint32_t, 2>;

std::vector<Edge> random_edges(std::uint32_t bodies, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Edge> edges;
  for (std::uint32_t i = 0; i < 2 * bodies; ++i) {
    const auto a = static_cast<std::uint32_t>(random() % bodies);
    const auto b = static_cast<std::uint32_t>(random() % bodies);
    if (a != b) edges.push_back({std::min(a, b), std::max(a, b)});
  }
  return edges;
}

// Unsymmetric numbers in a symmetric pattern.
struct Matrix {
  Eigen::MatrixXd dense;
  BlockMatrix blocks;
};

Matrix matrix_of(std::uint32_t bodies, const std::vector<Edge>& edges, const Elimination& plan,
                 double diagonal) {
  std::mt19937_64 random(7);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  const auto block = [&] {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(6, 6, [&](auto, auto) { return unit(); }));
  };
  Matrix out{Eigen::MatrixXd::Zero(6 * bodies, 6 * bodies), {}};
  out.blocks.lower.resize(plan.rows.size());
  out.blocks.upper.resize(plan.rows.size());
  const auto store = [](const Eigen::MatrixXd& from, Block& to) {
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) to[6 * c + r] = from(r, c);
  };
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const Eigen::MatrixXd own = diagonal * Eigen::MatrixXd::Identity(6, 6) + block();
    out.dense.block<6, 6>(6 * i, 6 * i) = own;
    store(own, out.blocks.lower[plan.block_of(i, i)]);
  }
  for (const auto& [a, b] : edges) {
    const bool row_is_a = plan.place_of[a] > plan.place_of[b];
    const std::uint32_t row = row_is_a ? a : b, column = row_is_a ? b : a;
    const Eigen::MatrixXd lower = block(), upper = block();
    out.dense.block<6, 6>(6 * row, 6 * column) = lower;
    out.dense.block<6, 6>(6 * column, 6 * row) = upper;
    store(lower, out.blocks.lower[plan.block_of(a, b)]);
    store(upper.transpose(), out.blocks.upper[plan.block_of(a, b)]);
  }
  return out;
}

TEST(BlockLu, SolvesWhatADenseFactorisationSolves) {
  for (const std::uint32_t bodies : {1u, 2u, 7u, 40u}) {
    SCOPED_TRACE(bodies);
    const std::vector<Edge> edges = random_edges(bodies, bodies);
    const auto plan = plan_elimination(bodies, edges, 1e9);
    ASSERT_TRUE(plan);
    Matrix matrix = matrix_of(bodies, edges, *plan, 60.0);
    const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(6 * bodies, -1.0, 2.0);
    std::vector<BlockVector> values(bodies);
    for (std::uint32_t i = 0; i < bodies; ++i)
      for (int r = 0; r < 6; ++r) values[plan->place_of[i]][r] = right[6 * i + r];
    ASSERT_TRUE(factorise(*plan, matrix.blocks));
    solve(*plan, matrix.blocks, values);
    const Eigen::VectorXd exact = matrix.dense.partialPivLu().solve(right);
    for (std::uint32_t i = 0; i < bodies; ++i)
      for (int r = 0; r < 6; ++r)
        EXPECT_NEAR(values[plan->place_of[i]][r], exact[6 * i + r], 1e-14);
  }
}

TEST(BlockLu, APivotOfZeroIsTold) {
  const auto plan = plan_elimination(1, {}, 1e9);
  ASSERT_TRUE(plan);
  BlockMatrix matrix{{Block{}}, {Block{}}};
  EXPECT_FALSE(factorise(*plan, matrix));
}

}  // namespace
}  // namespace soda::physics
