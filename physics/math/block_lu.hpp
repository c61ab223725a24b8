// Sparse L U factorisation of matrices of 6 x 6 blocks whose pattern is symmetric and whose numbers
// are not: block_cholesky.hpp tells of the pattern. No pivoting, so a factorisation can fail, or
// lose digits, where the matrix is far from positive. Every sum has one order.
#pragma once

#include <span>
#include <vector>

#include "physics/math/block_cholesky.hpp"

namespace soda::physics {

// Both in the pattern's order. `lower`: whole diagonal blocks, and blocks (i, j) with row i later
// in the order than column j; `upper`: of (j, i), transposed.
struct BlockMatrix {
  std::vector<Block> lower, upper;
};

// Factorises in place. False if a pivot is zero, or not finite.
bool factorise(const Elimination& elimination, BlockMatrix& blocks);

// Solves for one right-hand side, in the order of the elimination, in place.
void solve(const Elimination& elimination, const BlockMatrix& factor,
           std::span<BlockVector> values);

}  // namespace soda::physics
