// Simulation islands: bodies connected by contacts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/contact_manifold.hpp"

namespace soda::physics {

// Islands of one step over `ids`. Islands are in ascending order of their label (the smallest id);
// inside an island, bodies are ascending by id and manifolds in canonical order.
struct Islands {
  // Island i has bodies bodies[body_begin[i] .. body_begin[i+1]) (indices into ids) and manifolds
  // manifolds[manifold_begin[i] .. manifold_begin[i+1]) (indices into the manifolds given).
  std::vector<std::uint32_t> body_begin, bodies;
  std::vector<std::uint32_t> manifold_begin, manifolds;
  // Bodies without any contact, ascending: they belong to no island.
  std::vector<std::uint32_t> free_bodies;

  // Memory that is worth keeping; carries no meaning.
  struct Scratch {
    std::vector<std::uint32_t> parent, body_of_manifold, island_of, next;
  } scratch = {};

  std::span<const std::uint32_t> bodies_of(std::size_t island) const {
    return std::span(bodies).subspan(body_begin[island],
                                     body_begin[island + 1] - body_begin[island]);
  }
  std::size_t count() const { return body_begin.empty() ? 0 : body_begin.size() - 1; }
};

// `ids` ascending and unique; `manifolds` in canonical order, their dynamic bodies all in `ids`.
// Static bodies connect nothing. `out` is overwritten.
void build_islands(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                   Islands& out);

}  // namespace soda::physics
