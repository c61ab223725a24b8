// Sparse Cholesky factorisation of symmetric matrices of 6 x 6 blocks, one block row per body.
// Every sum has one order, that of the elimination, so that the bits do not depend on compiler
// options or on the width of vectors.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace soda::physics {

inline constexpr int kBlockRows = 6;
using Block = std::array<double, kBlockRows * kBlockRows>;  // by columns
using BlockVector = std::array<double, kBlockRows>;

// The order in which bodies are eliminated (least number of neighbours first, the lowest index
// among equals) and the pattern of the factor.
struct Elimination {
  std::vector<std::uint32_t> place_of;  // of each body: its place in the order
  // Column k of the factor: blocks [column_begin[k], column_begin[k+1]). The first is the diagonal
  // one, those after it lie in rows rows[...], ascending.
  std::vector<std::uint32_t> column_begin, rows;
  double multiplications = 0.0;  // of one factorisation, roughly

  std::size_t count() const { return place_of.size(); }
  // Index of the block of these two bodies in the lower triangle; they must be joined by an edge
  // or be equal.
  std::uint32_t block_of(std::uint32_t body_a, std::uint32_t body_b) const;
};

// `edges` join two different bodies below `bodies`; any order, repetitions allowed. Empty if a
// factorisation would take more than `most_multiplications`. Takes a bit of memory for each two
// bodies meanwhile.
std::optional<Elimination> plan_elimination(std::uint32_t bodies,
                                            std::span<const std::array<std::uint32_t, 2>> edges,
                                            double most_multiplications);

// Factorises in place: `blocks` holds the lower triangle (of the diagonal blocks too) in the
// pattern's order. Off-diagonal block (i, j): row i comes later in the order than column j. False
// if a pivot is not positive.
bool factorise(const Elimination& elimination, std::vector<Block>& blocks);

// Solves for one right-hand side, in the order of the elimination, in place.
void solve(const Elimination& elimination, std::span<const Block> factor,
           std::span<BlockVector> values);

}  // namespace soda::physics
