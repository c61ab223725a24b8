// Cutting a large island into a chain of blocks that can be solved side by side.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/contact_manifold.hpp"

namespace soda::physics {

// An island with fewer contact points is not cut.
inline constexpr std::uint32_t kLargeIslandPoints = 512;

bool is_large(std::span<const ContactManifold> manifolds);

// Of all contacts.
std::uint32_t points_of(std::span<const ContactManifold> manifolds);

// A part of an island. Places in the island's bodies and manifolds, ascending.
struct IslandPart {
  std::vector<std::uint32_t> bodies;
  std::vector<std::uint32_t> manifolds;
};

// Blocks in a row: every body is in one block, every contact inside one block or between a block
// and the next. A body that touches the block before touches none of the block after. So blocks
// have nothing in common, and neither have borders.
struct IslandBlocks {
  std::vector<IslandPart> inside;       // contacts of the block's bodies with each other, statics
  std::vector<IslandPart> borders;      // [c]: contacts of block c with c + 1, and their bodies
  std::vector<std::uint32_t> block_of;  // by body
  std::vector<std::uint32_t> place_in;  // by body: in inside[block_of].bodies

  std::size_t count() const { return inside.size(); }
};

// Blocks of layers: bodies of equal distance, in contacts, from one end of the island. Each has two
// layers at least and some number of contact points; one block if there are not enough of them.
// `ids` ascending, the dynamic bodies of `manifolds` among them. The lowest id decides between
// equal ends, so that the blocks are a function of ids and contacts alone.
IslandBlocks split_island(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds);

}  // namespace soda::physics
