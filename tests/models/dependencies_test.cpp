// Dependency waits, absorption and jumps: what worlds do not compute for nothing.
#include "models/islands/dependencies.hpp"

#include <gtest/gtest.h>

#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

physics::ContactManifold contact(std::uint32_t a, std::uint32_t b) {
  physics::ContactManifold manifold;
  manifold.a = BodyId{a};
  manifold.b = BodyId{b};
  manifold.count = 1;
  return manifold;
}

Node node(std::uint32_t id, std::uint32_t owner) { return {BodyId{id}, WorldId{owner}, {}}; }

TEST(DependencyWaits, OnlyIslandsOfSeveralOwnersWithAnOwnBodyAreGroups) {
  const std::vector<BodyId> ids = {BodyId{2}, BodyId{5}, BodyId{9}};
  std::vector<MixedGroup> groups;
  note_group(ids, std::vector<WorldId>{WorldId{1}, WorldId{1}, WorldId{1}}, WorldId{1}, groups);
  note_group(ids, std::vector<WorldId>{WorldId{0}, WorldId{2}, WorldId{0}}, WorldId{1}, groups);
  EXPECT_TRUE(groups.empty());
  note_group(ids, std::vector<WorldId>{WorldId{3}, WorldId{1}, WorldId{3}}, WorldId{1}, groups);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0], (MixedGroup{BodyId{2}, {WorldId{1}, WorldId{3}}, {BodyId{5}}}));
}

TEST(DependencyWaits, WaitsForPartnersForTestersAndForRecordsThatCameInTheStepBefore) {
  Dependencies dependencies;
  dependencies.groups = {{BodyId{2}, {WorldId{1}, WorldId{3}}, {BodyId{5}}}};
  dependencies.testers = {WorldId{4}};
  dependencies.tested_for = {WorldId{5}};
  dependencies.received = {{1u, WorldId{3}}};
  dependencies.sent = {{3u, WorldId{3}}};
  const Expected expected = expected_from(dependencies, WorldId{1});
  EXPECT_EQ(expected.ghosts_to, (std::vector{WorldId{3}, WorldId{4}}));
  EXPECT_EQ(expected.ghosts_from, (std::vector{WorldId{3}, WorldId{5}}));
  EXPECT_EQ(expected.fragments_from, (std::vector{WorldId{3}, WorldId{4}}));
  EXPECT_EQ(next_round(dependencies, expected, 0), 0u);
  EXPECT_EQ(next_round(dependencies, expected, 1), 1u);
  EXPECT_EQ(next_round(dependencies, expected, 2),
            2u);  // what was sent for round 3 is sent in round 2
  EXPECT_EQ(next_round(dependencies, expected, 3), kNoRound);

  std::vector<kernel::MessageView> bag = {
      {kernel::LpId{3}, static_cast<std::uint32_t>(MessageKind::kFragments), 0, {}}};
  EXPECT_TRUE(lacks(dependencies, expected, time_of(7, Phase::kSync), bag));
  bag.push_back({kernel::LpId{4}, static_cast<std::uint32_t>(MessageKind::kFragments), 0, {}});
  EXPECT_FALSE(lacks(dependencies, expected, time_of(7, Phase::kSync), bag));
  EXPECT_TRUE(lacks(dependencies, expected, time_of(7, Phase::kBorderTraversal), bag));
  EXPECT_TRUE(lacks(dependencies, expected, time_of(7, Phase::kSync, 1), {}));
  EXPECT_FALSE(lacks(dependencies, expected, time_of(7, Phase::kSync, 2), {}));
  EXPECT_FALSE(lacks(dependencies, expected, time_of(7, Phase::kPairs), {}));
}

// World 1 owns 1 and 4, which rest on 2 and 3 of worlds 2 and 3; 1 touches 4. In the step before
// all were one island. Contact 2-3, tested here for others, is in no part of the group.
TEST(DependencyWaits, AllOwnersOfAGroupGetTheSameAndNobodyGetsItTwice) {
  const std::vector<MixedGroup> groups = {
      {BodyId{1}, {WorldId{1}, WorldId{2}, WorldId{3}}, {BodyId{1}, BodyId{4}}}};
  const std::vector<BodyId> own = {BodyId{1}, BodyId{4}};
  const std::vector<physics::BodyState> states(2);
  IslandMerge merge;
  merge.nodes = {node(2, 2), node(3, 3)};
  const std::vector<physics::ContactManifold> manifolds = {contact(1, 2), contact(1, 4),
                                                           contact(3, 4)};
  std::map<WorldId, Fragment> fragments;
  fragments[WorldId{2}].records = {{node(1, 1), node(3, 3)}, {contact(1, 2), contact(2, 3)}};
  add_group_fragments(groups, WorldId{1},
                      {known_bodies(own, WorldId{1}, merge), states, merge.nodes, manifolds},
                      fragments);
  ASSERT_EQ(fragments.size(), 2u);
  for (const std::uint32_t owner : {2u, 3u}) {
    const Fragment& fragment = fragments[WorldId{owner}];
    ASSERT_EQ(fragment.groups.size(), 1u);
    EXPECT_EQ(fragment.groups[0].records.nodes.size(), 4u);
    EXPECT_EQ(fragment.groups[0].records.manifolds.size(), 3u);
  }
  const Records& loose = fragments[WorldId{2}].records;
  ASSERT_EQ(loose.manifolds.size(), 1u);
  EXPECT_EQ(loose.manifolds[0].a, BodyId{2});
  ASSERT_EQ(loose.nodes.size(), 1u);
  EXPECT_EQ(loose.nodes[0].id, BodyId{3});

  // World 3 takes it in: it has nothing of it left to tell world 2.
  IslandMerge at_three;
  std::vector<physics::ContactManifold> known;
  const std::vector<MixedGroup> groups_of_three = {
      {BodyId{1}, {WorldId{1}, WorldId{2}, WorldId{3}}, {BodyId{3}}}};
  const std::vector<BodyId> own_of_three = {BodyId{3}};
  take_fragment(own_of_three, WorldId{3}, {WorldId{1}, fragments[WorldId{3}]}, groups_of_three,
                at_three, known);
  EXPECT_EQ(known.size(), 3u);
  const std::vector<physics::BodyState> state_of_three(1);
  EXPECT_TRUE(outgoing_records(0, WorldId{3}, known_bodies(own_of_three, WorldId{3}, at_three),
                               state_of_three, known, at_three)
                  .empty());
}

struct Cluster {
  test::Scene scene{Vec3(0, 0, -9.81)};
  TerritoryMap map;
  std::int64_t steps = 0;

  SimulationResult run(const RunOptions& options) const {
    return simulate(scene.description, scene.states, map, options);
  }
  std::uint64_t digest(const SimulationResult& result) const {
    std::vector<BodyId> ids;
    for (std::uint32_t i = 0; i < scene.states.size(); ++i) ids.push_back(BodyId{i});
    return physics::digest(ids, result.final_states);
  }
};

// Ten boxes over the edge where four worlds meet.
Cluster border_stack() {
  Cluster cluster{.map = make_territory_map(
                      {Grid{Vec3(-6, -6, 0), 2.0, {6, 6, 6}}, 4, MapKind::kBlocks, 1}, {}),
                  .steps = 150};
  cluster.scene.ground();
  const std::uint32_t box = cluster.scene.shape(physics::Box{});
  for (int i = 0; i < 10; ++i)
    cluster.scene.body(box, Vec3(i % 2 == 0 ? -0.25 : 0.25, i % 4 < 2 ? -0.25 : 0.25, 0.5 + i));
  return cluster;
}

double rework(const SimulationResult& result) {
  return static_cast<double>(result.stages.islands_advanced() + result.worlds.islands_reused) /
         static_cast<double>(result.worlds.solves_committed);
}

TEST(DependencyWaits, AStackOnABorderIsSolvedLessThanHalfAsOftenAsWithoutWaiting) {
  const Cluster cluster = border_stack();
  RunOptions options{.executor = ExecutorKind::kVirtual,
                     .steps = cluster.steps,
                     .buffer = 48,
                     .gating = true,
                     .cluster = {.processors = 4, .latency_ns = 30'000}};
  const SimulationResult gated = cluster.run(options);
  options.gating = false;
  const SimulationResult free = cluster.run(options);
  options.executor = ExecutorKind::kSequential;
  EXPECT_EQ(cluster.digest(gated), cluster.digest(cluster.run(options)));
  EXPECT_EQ(cluster.digest(gated), cluster.digest(free));
  EXPECT_EQ(gated.worlds.solves_committed, free.worlds.solves_committed);
  EXPECT_LT(2 * rework(gated), rework(free));
  EXPECT_LT(gated.cluster->makespan_ns, free.cluster->makespan_ns);
}

TEST(JumpForward, StepsThatComeOutUnchangedPutBackWhatWasUndoneAfterThem) {
  const Cluster cluster = border_stack();
  RunOptions options{.executor = ExecutorKind::kVirtual,
                     .steps = 60,
                     .buffer = 48,
                     .gating = false,
                     .cluster = {.processors = 4, .latency_ns = 300'000}};
  const SimulationResult jumping = cluster.run(options);
  options.rollback = RollbackMode::kInvalidate;
  const SimulationResult plodding = cluster.run(options);
  EXPECT_EQ(cluster.digest(jumping), cluster.digest(plodding));
  EXPECT_GT(jumping.events.jumps, 0u);
  EXPECT_GE(jumping.worlds.steps_put_back, jumping.events.jumps);
  EXPECT_EQ(plodding.events.jumps, 0u);
}

// A ball flies along the border and is a ghost in every step; `bodies` rest far from it.
Cluster passing_ball(int bodies) {
  Cluster cluster{.map = make_territory_map(
                      {Grid{Vec3(-64, -64, 0), 1.0, {128, 128, 2}}, 2, MapKind::kBlocks, 1}, {}),
                  .steps = 40};
  const std::uint32_t ball = cluster.scene.shape(physics::Sphere{0.2});
  cluster.scene.ground();
  for (int i = 0; i < bodies; ++i)
    cluster.scene.body(ball, Vec3(3.0 + 0.5 * (i % 100), 0.5 * (i / 100), 0.2));
  cluster.scene.body(ball, Vec3(-0.1, -60.0, 1.0), Vec3(0, 30.0, 0));
  return cluster;
}

TEST(Absorption, AGhostThatTouchesNothingCostsAWorldOfTenThousandBodiesWhatItCostsOneOfAHundred) {
  std::vector<std::uint64_t> looks;
  for (const int bodies : {100, 1000, 10'000}) {
    const Cluster cluster = passing_ball(bodies);
    const SimulationResult result =
        cluster.run({.executor = ExecutorKind::kVirtual,
                     .steps = cluster.steps,
                     .buffer = 48,
                     .cluster = {.processors = 2, .latency_ns = 100'000'000},
                     .constant_cost = true});
    EXPECT_EQ(result.events.rollbacks, 0u);
    EXPECT_EQ(result.worlds.steps_repeated, 0u);
    EXPECT_EQ(result.stages.islands_advanced(), result.islands_committed);
    EXPECT_EQ(result.stages.boxes, static_cast<std::uint64_t>(cluster.steps * (bodies + 1)));
    // A ghost in each step, and once news that the ball lands: it is sent on.
    EXPECT_EQ(result.worlds.bags_absorbed, static_cast<std::uint64_t>(cluster.steps) + 1);
    looks.push_back(result.worlds.absorption_looks);
  }
  EXPECT_EQ(looks[0], looks[1]);
  EXPECT_EQ(looks[0], looks[2]);
}

}  // namespace
}  // namespace soda::models
