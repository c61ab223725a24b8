#include "physics/broadphase/islands.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace soda::physics {
namespace {

ContactManifold between(std::uint32_t a, std::uint32_t b) {
  ContactManifold m;
  m.a = static_cast<BodyId>(a);
  m.b = static_cast<BodyId>(b);
  m.count = 1;
  return m;
}

std::vector<BodyId> every_third(std::uint32_t n) {
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < n; ++i) ids.push_back(static_cast<BodyId>(3 * i + 1));
  return ids;
}

TEST(Islands, StaticsConnectNothingButMakeAnIsland) {
  const std::vector<BodyId> ids = every_third(3);  // 1, 4, 7
  const std::vector<ContactManifold> manifolds = {between(1, kFirstStatic),
                                                  between(7, kFirstStatic)};
  Islands islands;
  build_islands(ids, manifolds, islands);
  ASSERT_EQ(islands.count(), 2u);
  EXPECT_EQ(islands.bodies, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(islands.free_bodies, (std::vector<std::uint32_t>{1}));
}

TEST(Islands, OutputReplacesWhatWasThere) {
  const std::vector<BodyId> ids = every_third(2);
  Islands islands;
  build_islands(ids, std::vector{between(1, 4)}, islands);
  build_islands(ids, std::vector<ContactManifold>{}, islands);
  EXPECT_EQ(islands.count(), 0u);
  EXPECT_EQ(islands.free_bodies.size(), 2u);
}

// Connected components by repeated label spreading: slow, and nothing like union-find.
std::vector<std::uint32_t> smallest_reachable(const std::vector<BodyId>& ids,
                                              const std::vector<ContactManifold>& manifolds) {
  std::vector<std::uint32_t> label;
  for (const BodyId id : ids) label.push_back(index_of(id));
  const auto at = [&](BodyId id) { return std::find(ids.begin(), ids.end(), id) - ids.begin(); };
  for (bool changed = true; changed;) {
    changed = false;
    for (const ContactManifold& m : manifolds) {
      if (is_static(m.b)) continue;
      std::uint32_t& a = label[at(m.a)];
      std::uint32_t& b = label[at(m.b)];
      if (a == b) continue;
      a = b = std::min(a, b);
      changed = true;
    }
  }
  return label;
}

TEST(Islands, AreTheConnectedComponentsInCanonicalOrder) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    std::mt19937_64 random(seed);
    const std::vector<BodyId> ids = every_third(40);
    std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (std::uint64_t i = 0; i < random() % 60; ++i) {
      const std::uint32_t a = index_of(ids[random() % 40]), b = index_of(ids[random() % 40]);
      if (a != b) pairs.insert({std::min(a, b), std::max(a, b)});
      if (random() % 4 == 0) pairs.insert({a, kFirstStatic + random() % 2});
    }
    std::vector<ContactManifold> manifolds;
    for (const auto& [a, b] : pairs) manifolds.push_back(between(a, b));
    Islands islands;
    build_islands(ids, manifolds, islands);

    const std::vector<std::uint32_t> label = smallest_reachable(ids, manifolds);
    std::size_t bodies = islands.free_bodies.size(), in_islands = 0;
    std::uint32_t last_label = 0;
    for (std::size_t i = 0; i < islands.count(); ++i) {
      const auto begin = islands.bodies.begin() + islands.body_begin[i];
      const auto end = islands.bodies.begin() + islands.body_begin[i + 1];
      EXPECT_TRUE(std::is_sorted(begin, end));
      const std::uint32_t own = label[*begin];
      EXPECT_EQ(own, index_of(ids[*begin])) << "labelled by the smallest id";
      EXPECT_TRUE(i == 0 || own > last_label);
      last_label = own;
      EXPECT_TRUE(std::all_of(begin, end, [&](std::uint32_t b) { return label[b] == own; }));
      EXPECT_EQ(end - begin, std::count(label.begin(), label.end(), own));
      bodies += end - begin;
      const auto first = islands.manifolds.begin() + islands.manifold_begin[i];
      const auto last = islands.manifolds.begin() + islands.manifold_begin[i + 1];
      EXPECT_TRUE(std::is_sorted(first, last));
      for (auto m = first; m != last; ++m) {
        const auto a = std::find(ids.begin(), ids.end(), manifolds[*m].a) - ids.begin();
        EXPECT_EQ(label[a], own);
        ++in_islands;
      }
    }
    EXPECT_EQ(bodies, ids.size());
    EXPECT_EQ(in_islands, manifolds.size());
  }
}

}  // namespace
}  // namespace soda::physics
