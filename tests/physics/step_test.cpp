// What a step may depend on: the states and the scene, nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

World mixed_scene() {
  World world = test::under_gravity();
  world.add_floor();
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i) {
    points.push_back(0.7 * (Vec3(i & 1, i >> 1 & 1, i >> 2 & 1) - Vec3(.5, .5, .5)));
  }
  const std::uint32_t shapes[] = {world.add_shape(Sphere{0.4}), world.add_shape(Box{}),
                                  world.add_shape(Capsule{0.3, 0.4}),
                                  world.add_shape(Cylinder{0.4, 0.8}),
                                  world.add_shape(std::get<ConvexHull>(make_convex_hull(points)))};
  for (int i = 0; i < 60; ++i) {
    const Vec3 at(i % 5 * 1.1, i / 5 % 4 * 1.1, 0.7 + i / 20 * 1.2);
    BodyState& s = world.add_body(shapes[i % 5], at, 1000.0, Material{0.5, i % 7 ? 0.0 : 0.6});
    s.orientation = test::about(Vec3(1, i % 3, i % 4), 0.2 * i);
    s.linear_velocity_m_s = Vec3(0.3 * (i % 4), -0.2 * (i % 3), 0);
  }
  return world;
}

TEST(Step, SameInputsGiveTheSameBits) {
  World first = mixed_scene(), second = mixed_scene();
  for (int i = 0; i < 120; ++i) {
    first.run(1);
    second.run(1);
    ASSERT_EQ(first.digest_of_states(), second.digest_of_states()) << "step " << i;
  }
  EXPECT_GT(first.counters.contact_points, 1000u);
}

TEST(Step, RestartFromAnyStateGivesTheSameBits) {
  World whole = mixed_scene();
  whole.run(60);
  World resumed = mixed_scene();
  resumed.states = whole.states;  // fresh scratch, fresh geometry
  whole.run(60);
  resumed.run(60);
  EXPECT_EQ(whole.digest_of_states(), resumed.digest_of_states());
}

// A subset that is closed under contact advances the same bits alone as among all others.
TEST(Step, AnIslandAloneGivesTheSameBitsAsAmongOthers) {
  World world = mixed_scene();
  const Geometry geometry(world.scene);
  world.run(40, geometry);
  const std::vector<BodyState> before = world.states;
  compute_boxes(world.scene, geometry, world.ids, before, world.scratch.boxes, world.counters);
  find_contacts(world.scene, geometry, world.ids, before, world.scratch, world.counters);
  Islands islands;
  build_islands(world.ids, world.scratch.manifolds, islands);
  ASSERT_GT(islands.count(), 1u);
  world.run(1, geometry);

  for (std::size_t i = 0; i < islands.count(); ++i) {
    std::vector<BodyId> ids;
    std::vector<BodyState> states;
    for (std::uint32_t b = islands.body_begin[i]; b < islands.body_begin[i + 1]; ++b) {
      ids.push_back(world.ids[islands.bodies[b]]);
      states.push_back(before[islands.bodies[b]]);
    }
    StepScratch scratch;
    StepReport report;
    StageCounters counters;
    step(world.scene, geometry, ids, states, {scratch, report, counters});
    for (std::size_t k = 0; k < ids.size(); ++k) {
      EXPECT_TRUE(identical(states[k], world.states[index_of(ids[k])]))
          << first_difference(states[k], world.states[index_of(ids[k])]).field;
    }
  }
}

// Leaves a pattern where the next calls will have their local variables.
[[gnu::noinline]] void fill_stack(unsigned char pattern) {
  volatile unsigned char garbage[65536];
  for (volatile unsigned char& byte : garbage) byte = pattern;
}

// Contacts come from ids, states and the scene: neither what was tested before them nor what was
// left on the stack leaves a trace.
TEST(Step, CollideGivesTheSameBitsInAnyOrderOfPairsAndOverAnyGarbage) {
  World world = mixed_scene();
  const Geometry geometry(world.scene);
  world.run(40, geometry);
  struct Tested {
    IndexPair pair;
    std::vector<ContactManifold> result;
  };
  StageCounters counters;
  const auto run = [&](const IndexPair& p) {
    std::vector<ContactManifold> out;
    collide({world.scene, geometry, world.scene.dt_s, world.ids[p.first], world.states[p.first],
             world.ids[p.second], &world.states[p.second]},
            out, counters);
    return out;
  };
  std::vector<Tested> tests;
  for (std::uint32_t i = 0; i < 60; ++i) {
    fill_stack(0x3f);
    for (std::uint32_t j = i + 1; j < 60; ++j) tests.push_back({{i, j}, run({i, j})});
  }
  std::shuffle(tests.begin(), tests.end(), std::mt19937_64(1));
  for (const Tested& t : tests) {
    fill_stack(0xff);
    const std::vector<ContactManifold> again = run(t.pair);
    ASSERT_EQ(again.size(), t.result.size());
    for (std::size_t m = 0; m < again.size(); ++m) {
      ASSERT_EQ(again[m].count, t.result[m].count);
      EXPECT_EQ(again[m].normal, t.result[m].normal);
      for (std::uint32_t p = 0; p < again[m].count; ++p) {
        EXPECT_EQ(again[m].points[p].position_m, t.result[m].points[p].position_m);
        EXPECT_EQ(again[m].points[p].separation_m, t.result[m].points[p].separation_m);
        EXPECT_EQ(again[m].points[p].feature, t.result[m].points[p].feature);
      }
    }
  }
}

TEST(Step, BothBroadphasesGiveTheSameBits) {
  World grid = mixed_scene(), pairs = mixed_scene();
  pairs.scene.broadphase = Broadphase::kAllPairs;
  grid.run(60);
  pairs.run(60);
  EXPECT_EQ(grid.digest_of_states(), pairs.digest_of_states());
}

// Warm-start impulses are state: without them the next step has other bits.
TEST(Step, StoredImpulsesDecideBits) {
  World world = mixed_scene();
  world.run(60);
  World stripped = mixed_scene();
  stripped.states = world.states;
  for (BodyState& s : stripped.states) s.impulses.clear();
  world.run(1);
  stripped.run(1);
  EXPECT_NE(world.digest_of_states(), stripped.digest_of_states());
}

TEST(Step, ReportsIslandsInAscendingOrderOfTheirLabels) {
  World world = mixed_scene();
  world.run(60);
  ASSERT_GT(world.report.islands.size(), 1u);
  for (std::size_t i = 1; i < world.report.islands.size(); ++i) {
    EXPECT_LT(index_of(world.report.islands[i - 1].label), index_of(world.report.islands[i].label));
  }
}

}  // namespace
}  // namespace soda::physics
