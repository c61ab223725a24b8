#include "physics/math/block_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <random>

namespace soda::physics {
namespace {

using Edge = std::array<std::uint32_t, 2>;

struct Graph {
  std::uint32_t bodies;
  std::vector<Edge> edges;
};

Graph random_graph(std::uint32_t bodies, int edges, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Graph graph{bodies, {}};
  for (int i = 0; i < edges; ++i) {
    const auto a = static_cast<std::uint32_t>(random() % bodies);
    const auto b = static_cast<std::uint32_t>(random() % bodies);
    if (a != b) graph.edges.push_back({std::min(a, b), std::max(a, b)});
  }
  return graph;
}

// A positive definite matrix with this pattern, and the same in the plan's order.
struct Matrix {
  Eigen::MatrixXd dense;
  std::vector<Block> blocks;
};

Matrix matrix_of(const Graph& graph, const Elimination& plan, double diagonal) {
  std::mt19937_64 random(7);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  Matrix out{Eigen::MatrixXd::Zero(6 * graph.bodies, 6 * graph.bodies), {}};
  out.blocks.resize(plan.rows.size());
  const auto place = [&](std::uint32_t a, std::uint32_t b, const Eigen::MatrixXd& block) {
    out.dense.block<6, 6>(6 * a, 6 * b) = block;
    out.dense.block<6, 6>(6 * b, 6 * a) = block.transpose();
    const bool row_is_a = plan.place_of[a] >= plan.place_of[b];
    Block& target = out.blocks[plan.block_of(a, b)];
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) target[6 * c + r] = row_is_a ? block(r, c) : block(c, r);
  };
  for (std::uint32_t i = 0; i < graph.bodies; ++i)
    place(i, i, diagonal * Eigen::MatrixXd::Identity(6, 6));
  for (const auto& [a, b] : graph.edges)
    place(a, b, Eigen::MatrixXd::NullaryExpr(6, 6, [&](auto, auto) { return unit(); }));
  return out;
}

TEST(BlockCholesky, SolvesWhatADenseFactorisationSolves) {
  for (const std::uint32_t bodies : {1u, 2u, 7u, 40u}) {
    SCOPED_TRACE(bodies);
    const Graph graph = random_graph(bodies, 2 * static_cast<int>(bodies), bodies);
    const auto plan = plan_elimination(graph.bodies, graph.edges, 1e9);
    ASSERT_TRUE(plan);
    // Rows have at most ~30 entries of .5 beside the diagonal: 60 dominates them.
    Matrix matrix = matrix_of(graph, *plan, 60.0);
    Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(6 * bodies, -1.0, 2.0);
    std::vector<BlockVector> values(bodies);
    for (std::uint32_t i = 0; i < bodies; ++i)
      for (int r = 0; r < 6; ++r) values[plan->place_of[i]][r] = right[6 * i + r];
    ASSERT_TRUE(factorise(*plan, matrix.blocks));
    solve(*plan, matrix.blocks, values);
    const Eigen::VectorXd exact = matrix.dense.ldlt().solve(right);
    for (std::uint32_t i = 0; i < bodies; ++i)
      for (int r = 0; r < 6; ++r)
        EXPECT_NEAR(values[plan->place_of[i]][r], exact[6 * i + r], 1e-14);
  }
}

TEST(BlockCholesky, TheOrderDependsOnTheGraphOnly) {
  Graph graph = random_graph(30, 60, 3);
  const auto plan = plan_elimination(graph.bodies, graph.edges, 1e9);
  std::reverse(graph.edges.begin(), graph.edges.end());
  const std::vector<Edge> once = graph.edges;
  graph.edges.insert(graph.edges.end(), once.begin(), once.end());
  const auto again = plan_elimination(graph.bodies, graph.edges, 1e9);
  ASSERT_TRUE(plan && again);
  EXPECT_EQ(plan->place_of, again->place_of);
  EXPECT_EQ(plan->rows, again->rows);
}

TEST(BlockCholesky, AChainHasNoFill) {
  Graph chain{100, {}};
  for (std::uint32_t i = 0; i + 1 < chain.bodies; ++i) chain.edges.push_back({i, i + 1});
  const auto plan = plan_elimination(chain.bodies, chain.edges, 1e9);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->rows.size(), 199u);
}

TEST(BlockCholesky, RefusesWhatWouldCostTooMuch) {
  const Graph graph = random_graph(60, 600, 5);
  const auto plan = plan_elimination(graph.bodies, graph.edges, 1e9);
  ASSERT_TRUE(plan);
  EXPECT_TRUE(plan_elimination(graph.bodies, graph.edges, 1.001 * plan->multiplications));
  EXPECT_FALSE(plan_elimination(graph.bodies, graph.edges, 0.999 * plan->multiplications));
}

TEST(BlockCholesky, SaysWhereAMatrixIsNotPositive) {
  const Graph graph = random_graph(10, 20, 9);
  const auto plan = plan_elimination(graph.bodies, graph.edges, 1e9);
  ASSERT_TRUE(plan);
  Matrix matrix = matrix_of(graph, *plan, 0.1);
  EXPECT_LT(matrix.dense.ldlt().vectorD().minCoeff(), 0.0);
  EXPECT_FALSE(factorise(*plan, matrix.blocks));
}

}  // namespace
}  // namespace soda::physics
