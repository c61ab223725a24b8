// How the joints of an island are eliminated: the pattern of their direct solution.
//
// The impulses of two joints are coupled by each body that both hold. A body with many joints
// would couple each with each: a star would take the cube of its arms. Where its arms hang on
// nothing else, the body's own velocity is an unknown instead (a hub), and a tree of any form takes
// work in proportion to its joints, after D. Baraff, "Linear-time dynamics using Lagrange
// multipliers", SIGGRAPH 1996, eq. 10. Other than there, bodies with few joints, and those in
// loops, are no unknowns: a matrix of impulses alone finds contradicting joints by its pivots.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/constraints/joint_tree.hpp"
#include "physics/math/sparse_ldl.hpp"

namespace soda::physics {

inline constexpr std::uint32_t kHubRows = 6;  // linear, angular

// Nodes: the joints in the system's order, then the hubs.
struct JointElimination {
  // Of the matrix before the elimination, what is not zero. The node of the rows comes later, or is
  // the same.
  struct Entry {
    std::uint32_t row_node, column_node;
    std::uint32_t block, column;  // of the pattern
  };

  LdlPattern pattern;
  double multiplications = 0.0;  // of one factorisation, roughly
  std::vector<Entry> entries;
  std::vector<std::uint32_t> nodes;     // of each group, one after the other
  std::vector<std::uint32_t> group_of;  // of each node
  std::vector<std::uint32_t> hubs;      // local indices of bodies
  std::vector<JointEnds> coupling;      // of each joint: its ends that are no hubs; kImmovable else
};

// `ends` and `first_row` of each joint; first_row has an end. Empty if a factorisation would take
// more than `most_multiplications`.
std::optional<JointElimination> plan_joint_elimination(std::span<const JointEnds> ends,
                                                       std::span<const std::uint32_t> first_row,
                                                       double most_multiplications);

}  // namespace soda::physics
