#include "physics/solvers/island_blocks.hpp"

#include <algorithm>

#include "physics/model/body_places.hpp"

namespace soda::physics {
namespace {

// Fewer make blocks whose borders cost more than dividing them gains.
constexpr std::uint32_t kBlockPoints = 128;

constexpr std::uint32_t kNowhere = 0xffffffffu;

struct ContactEnds {
  std::uint32_t a = 0, b = kNowhere;  // places in the island; none for a static
};

std::vector<ContactEnds> ends_of(std::span<const BodyId> ids,
                                 std::span<const ContactManifold> manifolds) {
  std::vector<ContactEnds> ends;
  ends.reserve(manifolds.size());
  for (const ContactManifold& m : manifolds)
    ends.push_back({place_of(ids, m.a), is_static(m.b) ? kNowhere : place_of(ids, m.b)});
  return ends;
}

// Who touches whom: neighbours[begin[i] .. begin[i + 1]) of body i.
struct ContactGraph {
  std::vector<std::uint32_t> begin, neighbours;
};

ContactGraph graph_of(std::size_t bodies, std::span<const ContactEnds> ends) {
  ContactGraph graph;
  graph.begin.assign(bodies + 1, 0);
  for (const ContactEnds& e : ends) {
    if (e.b == kNowhere) continue;
    ++graph.begin[e.a + 1];
    ++graph.begin[e.b + 1];
  }
  for (std::size_t i = 0; i < bodies; ++i) graph.begin[i + 1] += graph.begin[i];
  graph.neighbours.resize(graph.begin.back());
  std::vector<std::uint32_t> next(graph.begin.begin(), graph.begin.end() - 1);
  for (const ContactEnds& e : ends) {
    if (e.b == kNowhere) continue;
    graph.neighbours[next[e.a]++] = e.b;
    graph.neighbours[next[e.b]++] = e.a;
  }
  return graph;
}

// The distance of each body from `start`, and a body that is farthest.
struct Layers {
  std::vector<std::uint32_t> of;
  std::uint32_t count = 0;
  std::uint32_t far_end = 0;  // the lowest
};

Layers layers_from(std::uint32_t start, const ContactGraph& graph) {
  Layers layers;
  layers.of.assign(graph.begin.size() - 1, kNowhere);
  std::vector<std::uint32_t> layer{start}, next;
  layers.of[start] = 0;
  while (!layer.empty()) {
    layers.far_end = *std::min_element(layer.begin(), layer.end());
    ++layers.count;
    next.clear();
    for (const std::uint32_t body : layer) {
      for (std::uint32_t i = graph.begin[body]; i < graph.begin[body + 1]; ++i) {
        const std::uint32_t neighbour = graph.neighbours[i];
        if (layers.of[neighbour] != kNowhere) continue;
        layers.of[neighbour] = layers.count;
        next.push_back(neighbour);
      }
    }
    std::swap(layer, next);
  }
  return layers;
}

// The block of each layer. A contact counts for the farther of its layers.
std::vector<std::uint32_t> group_layers(const Layers& layers, std::span<const ContactEnds> ends,
                                        std::span<const ContactManifold> manifolds) {
  std::vector<std::uint32_t> points(layers.count, 0);
  std::uint32_t rest = 0;
  for (std::size_t m = 0; m < ends.size(); ++m) {
    const std::uint32_t b = ends[m].b == kNowhere ? ends[m].a : ends[m].b;
    points[std::max(layers.of[ends[m].a], layers.of[b])] += manifolds[m].count;
    rest += manifolds[m].count;
  }
  std::vector<std::uint32_t> block_of(layers.count, 0);
  std::uint32_t block = 0, size = 0, depth = 0;
  for (std::uint32_t layer = 0; layer < layers.count; ++layer) {
    block_of[layer] = block;
    size += points[layer];
    rest -= points[layer];
    ++depth;
    const bool next_can_be = rest >= kBlockPoints && layers.count - layer - 1 >= 2;
    if (size < kBlockPoints || depth < 2 || !next_can_be) continue;
    ++block;
    size = depth = 0;
  }
  return block_of;
}

// The border's bodies: those of its contacts.
void note_border_body(std::uint32_t body, std::vector<std::uint32_t>& last_border,
                      std::uint32_t border, IslandPart& part) {
  if (last_border[body] == border) return;
  last_border[body] = border;
  part.bodies.push_back(body);
}

void sort_contacts(std::span<const ContactEnds> ends, IslandBlocks& blocks) {
  std::vector<std::uint32_t> last_border(blocks.block_of.size(), kNowhere);
  for (std::uint32_t m = 0; m < ends.size(); ++m) {
    const std::uint32_t of_a = blocks.block_of[ends[m].a];
    const std::uint32_t of_b = ends[m].b == kNowhere ? of_a : blocks.block_of[ends[m].b];
    if (of_a == of_b) {
      blocks.inside[of_a].manifolds.push_back(m);
      continue;
    }
    const std::uint32_t border = std::min(of_a, of_b);
    blocks.borders[border].manifolds.push_back(m);
    note_border_body(ends[m].a, last_border, border, blocks.borders[border]);
    note_border_body(ends[m].b, last_border, border, blocks.borders[border]);
  }
  for (IslandPart& border : blocks.borders) std::sort(border.bodies.begin(), border.bodies.end());
}

}  // namespace

std::uint32_t points_of(std::span<const ContactManifold> manifolds) {
  std::uint32_t points = 0;
  for (const ContactManifold& m : manifolds) points += m.count;
  return points;
}

bool is_large(std::span<const ContactManifold> manifolds) {
  return points_of(manifolds) >= kLargeIslandPoints;
}

IslandBlocks split_island(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  const std::vector<ContactEnds> ends = ends_of(ids, manifolds);
  const ContactGraph graph = graph_of(ids.size(), ends);
  const Layers layers = layers_from(layers_from(0, graph).far_end, graph);
  IslandBlocks blocks;
  // Not one island, whatever the caller says.
  if (std::find(layers.of.begin(), layers.of.end(), kNowhere) != layers.of.end()) return blocks;
  const std::vector<std::uint32_t> block_of_layer = group_layers(layers, ends, manifolds);
  blocks.inside.resize(block_of_layer.back() + 1);
  blocks.borders.resize(blocks.inside.size() - 1);
  for (std::uint32_t body = 0; body < ids.size(); ++body) {
    const std::uint32_t block = block_of_layer[layers.of[body]];
    blocks.block_of.push_back(block);
    blocks.place_in.push_back(static_cast<std::uint32_t>(blocks.inside[block].bodies.size()));
    blocks.inside[block].bodies.push_back(body);
  }
  sort_contacts(ends, blocks);
  return blocks;
}

}  // namespace soda::physics
