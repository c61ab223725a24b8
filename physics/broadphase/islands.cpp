#include "physics/broadphase/islands.hpp"

#include <algorithm>
#include <numeric>

#include "physics/math/disjoint_sets.hpp"
#include "physics/math/gallop.hpp"

namespace soda::physics {
namespace {

// Where `id` is, not before `from`. Bodies in contact mostly have ids that lie close to each other,
// with none missing between.
std::uint32_t position_of(std::span<const BodyId> ids, BodyId id, std::uint32_t from) {
  const std::uint32_t guess = from + (index_of(id) - index_of(ids[from]));
  if (guess < ids.size() && ids[guess] == id) return guess;
  return static_cast<std::uint32_t>(gallop(ids.begin() + from, ids.end(), id) - ids.begin());
}

constexpr std::uint32_t kNoIsland = 0xffffffffu, kTouched = 0xfffffffeu;  // instead of an island

// Turns counts[i] at begin[i + 1] into offsets.
void accumulate(std::vector<std::uint32_t>& begin) {
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
}

}  // namespace

void build_islands(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                   Islands& out) {
  const std::uint32_t n = static_cast<std::uint32_t>(ids.size());
  // The root of a set is its smallest member, so that no history of unions can show.
  auto& [parent, body_of_manifold, island_of, next] = out.scratch;
  parent.resize(n);
  body_of_manifold.resize(manifolds.size());
  island_of.assign(n, kNoIsland);  // by body; roots come first by construction
  std::iota(parent.begin(), parent.end(), 0u);
  std::uint32_t a = 0;  // the manifolds ascend by it
  for (std::size_t m = 0; m < manifolds.size(); ++m) {
    a = position_of(ids, manifolds[m].a, a);
    body_of_manifold[m] = a;
    island_of[a] = kTouched;
    if (is_static(manifolds[m].b)) continue;
    const std::uint32_t b = position_of(ids, manifolds[m].b, a);
    island_of[b] = kTouched;
    const std::uint32_t root_a = find_root(parent, a), root_b = find_root(parent, b);
    parent[std::max(root_a, root_b)] = std::min(root_a, root_b);
  }

  out.free_bodies.clear();
  out.body_begin.assign(1, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    if (island_of[i] == kNoIsland) {
      out.free_bodies.push_back(i);
      continue;
    }
    const std::uint32_t root = find_root(parent, i);
    if (root == i) {
      island_of[i] = static_cast<std::uint32_t>(out.body_begin.size() - 1);
      out.body_begin.push_back(0);
    } else {
      island_of[i] = island_of[root];
    }
    ++out.body_begin[island_of[i] + 1];
  }
  out.manifold_begin.assign(out.body_begin.size(), 0);
  for (const std::uint32_t body : body_of_manifold) ++out.manifold_begin[island_of[body] + 1];
  accumulate(out.body_begin);
  accumulate(out.manifold_begin);

  // Distributing in ascending order keeps each island's members ascending.
  out.bodies.resize(out.body_begin.back());
  out.manifolds.resize(manifolds.size());
  next.assign(out.body_begin.begin(), out.body_begin.end());
  for (std::uint32_t i = 0; i < n; ++i) {
    if (island_of[i] != kNoIsland) out.bodies[next[island_of[i]]++] = i;
  }
  next.assign(out.manifold_begin.begin(), out.manifold_begin.end());
  for (std::uint32_t m = 0; m < manifolds.size(); ++m) {
    out.manifolds[next[island_of[body_of_manifold[m]]]++] = m;
  }
}

}  // namespace soda::physics
