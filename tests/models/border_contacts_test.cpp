#include "models/world/border_contacts.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

#include "models/islands/island_merge.hpp"
#include "physics/step/step.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;
using PairKey = std::pair<BodyId, BodyId>;

// A dense cloud of spheres and boxes, some larger than a cell, some fast enough for their swept box
// to cover many cells.
test::Scene cloud(std::uint64_t seed) {
  test::Choices choices(seed);
  test::Scene scene;
  const std::uint32_t shapes[] = {
      scene.shape(physics::Sphere{0.4}), scene.shape(physics::Box{Vec3(0.3, 0.4, 0.5)}),
      scene.shape(physics::Sphere{1.7}), scene.shape(physics::Box{Vec3(1.6, 0.2, 0.2)})};
  for (int i = 0; i < 60; ++i) {
    const double speed = choices.below(8) == 0 ? 200.0 : 1.0;
    scene.body(shapes[choices.below(4)], choices.vector(0, 8), choices.vector(-speed, speed));
  }
  scene.ground();
  return scene;
}

struct Owned {
  std::vector<BodyId> ids;
  std::vector<physics::BodyState> states;
  std::vector<physics::Aabb> boxes;
  std::vector<Ghost> ghosts;
};

std::vector<Owned> distribute(const test::Scene& scene, const physics::Geometry& geometry,
                              const TerritoryMap& map) {
  std::vector<Owned> worlds(map.worlds());
  std::vector<WorldId> covered;
  for (std::uint32_t i = 0; i < scene.states.size(); ++i) {
    const physics::BodyState& state = scene.states[i];
    const physics::Aabb box = physics::swept_aabb(scene.description, geometry, BodyId{i}, state);
    const WorldId owner = map.owner_at(state.position_m);
    Owned& own = worlds[index_of(owner)];
    own.ids.push_back(BodyId{i});
    own.states.push_back(state);
    own.boxes.push_back(box);
    map.owners_of(box, covered);
    for (const WorldId other : covered) {
      if (other != owner) worlds[index_of(other)].ghosts.push_back({BodyId{i}, owner, box, state});
    }
  }
  return worlds;
}

// Twelve worlds, each cell given to any of them.
TerritoryMap random_map(std::uint64_t seed) {
  test::Choices choices(seed);
  const Grid grid{Vec3::Zero(), 2.0, {4, 4, 4}};
  std::vector<WorldId> owner_of_cell;
  for (std::size_t cell = 0; cell < grid.cell_count(); ++cell)
    owner_of_cell.push_back(WorldId{static_cast<std::uint32_t>(choices.below(12))});
  return {grid, 12, owner_of_cell};
}

TEST(BorderContacts, EveryTouchingPairIsTestedByExactlyOneWorldWithTheUndividedResult) {
  std::size_t third_world_pairs = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const test::Scene scene = cloud(seed);
    const physics::Geometry geometry(scene.description);
    physics::StageCounters counters;

    std::vector<BodyId> ids;
    for (std::uint32_t i = 0; i < scene.states.size(); ++i) ids.push_back(BodyId{i});
    physics::StepScratch undivided;
    physics::compute_boxes(scene.description, geometry, ids, scene.states, undivided.boxes,
                           counters);
    physics::find_contacts(scene.description, geometry, ids, scene.states, undivided, counters);
    ASSERT_GT(undivided.manifolds.size(), 20u);

    const TerritoryMap map = random_map(seed);

    std::map<PairKey, int> tested;
    std::vector<physics::ContactManifold> all;
    const std::vector<Owned> worlds = distribute(scene, geometry, map);
    for (std::uint32_t w = 0; w < worlds.size(); ++w) {
      const Owned& world = worlds[w];
      const BorderContacts contacts = find_border_contacts(
          scene.description, geometry, map,
          {WorldId{w}, world.ids, world.states, world.boxes, world.ghosts}, {{}, {}}, counters);
      std::map<PairKey, std::vector<physics::ContactManifold>> found;
      for (const auto& manifold : contacts.manifolds)
        found[{manifold.a, manifold.b}].push_back(manifold);
      for (const auto& [target, fragment] : contacts.fragments) {
        std::map<PairKey, std::vector<physics::ContactManifold>> told;
        for (const auto& manifold : fragment.records.manifolds)
          told[{manifold.a, manifold.b}].push_back(manifold);
        for (const auto& [pair, manifolds] : told) {
          third_world_pairs += !found.contains(pair);
          found.try_emplace(pair, manifolds);
        }
      }
      for (const auto& [pair, manifolds] : found) {
        ++tested[pair];
        all.insert(all.end(), manifolds.begin(), manifolds.end());
      }
    }
    for (const auto& [pair, times] : tested) {
      ASSERT_EQ(times, 1) << "seed " << seed << " pair " << index_of(pair.first) << ","
                          << index_of(pair.second);
    }
    std::sort(all.begin(), all.end(), canonical_before);
    EXPECT_EQ(encode_records({{}, all}), encode_records({{}, undivided.manifolds}))
        << "seed " << seed;
  }
  EXPECT_GT(third_world_pairs, 0u)
      << "no pair was tested by a third world: the scenes are too tame";
}

// The tester may be a third world: then both owners depend on what it tells them.
TEST(BorderContacts, BothOwnersOfAPairHearOfItAndOfTheBodyThatTheyDoNotOwn) {
  std::size_t told_by_a_third = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const test::Scene scene = cloud(seed);
    const physics::Geometry geometry(scene.description);
    physics::StageCounters counters;
    const TerritoryMap map = random_map(seed);
    const std::vector<Owned> worlds = distribute(scene, geometry, map);
    const auto owner_of = [&](BodyId body) {
      return map.owner_at(scene.states[index_of(body)].position_m);
    };
    std::set<std::pair<WorldId, PairKey>> received;
    std::set<std::pair<WorldId, BodyId>> known;
    std::set<PairKey> found;
    for (std::uint32_t w = 0; w < worlds.size(); ++w) {
      const Owned& world = worlds[w];
      const BorderContacts contacts = find_border_contacts(
          scene.description, geometry, map,
          {WorldId{w}, world.ids, world.states, world.boxes, world.ghosts}, {{}, {}}, counters);
      for (const auto& manifold : contacts.manifolds) {
        if (physics::is_static(manifold.b)) continue;
        found.insert({manifold.a, manifold.b});
        received.insert({WorldId{w}, {manifold.a, manifold.b}});
      }
      for (const Node& node : contacts.foreign) known.insert({WorldId{w}, node.id});
      for (const auto& [target, fragment] : contacts.fragments) {
        for (const Node& node : fragment.records.nodes) known.insert({target, node.id});
        for (const auto& manifold : fragment.records.manifolds) {
          found.insert({manifold.a, manifold.b});
          received.insert({target, {manifold.a, manifold.b}});
          told_by_a_third +=
              owner_of(manifold.a) != WorldId{w} && owner_of(manifold.b) != WorldId{w};
        }
      }
    }
    for (const PairKey& pair : found) {
      const WorldId a = owner_of(pair.first), b = owner_of(pair.second);
      EXPECT_TRUE(received.contains({a, pair})) << "seed " << seed;
      EXPECT_TRUE(received.contains({b, pair})) << "seed " << seed;
      if (a == b) continue;
      EXPECT_TRUE(known.contains({a, pair.second})) << "seed " << seed;
      EXPECT_TRUE(known.contains({b, pair.first})) << "seed " << seed;
    }
  }
  EXPECT_GT(told_by_a_third, 0u);
}

TEST(BorderContacts, WithoutGhostsThereIsNothingToTell) {
  const test::Scene scene = cloud(3);
  const physics::Geometry geometry(scene.description);
  const TerritoryMap map = make_territory_map({Grid{}, 1, MapKind::kBlocks, 1}, {});
  const std::vector<Owned> worlds = distribute(scene, geometry, map);
  physics::StageCounters counters;
  const BorderContacts contacts = find_border_contacts(
      scene.description, geometry, map,
      {WorldId{0}, worlds[0].ids, worlds[0].states, worlds[0].boxes, worlds[0].ghosts}, {{}, {}},
      counters);
  EXPECT_FALSE(contacts.manifolds.empty());
  EXPECT_TRUE(contacts.fragments.empty());
  EXPECT_TRUE(contacts.foreign.empty());
}

}  // namespace
}  // namespace soda::models
