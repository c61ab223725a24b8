// Rollback and Propagate: what a repeated step computes again, and what it takes over.
#include "models/transform_buffer/repetition.hpp"

#include <gtest/gtest.h>

#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

// What a step left of two bodies in contact (ids 1 and 3), a free one (5) and a mixed island (7).
struct Stale {
  SharedMemory memory;
  BufferEntry entry;
  StoredEntry kept;
  // As it is now, until the next call.
  const StoredEntry* stored() {
    WorldCounters counters;
    BufferEntry copy = entry;
    kept = store(memory, copy, {}, {}, counters);
    return &kept;
  }
  Stale() {
    for (const std::uint32_t id : {1u, 3u, 5u, 7u}) {
      entry.ids.push_back(BodyId{id});
      entry.states.emplace_back();
      entry.states.back().position_m = Vec3(id, 1, 0);
    }
    entry.memo.valid = true;
    entry.rules.map = std::make_shared<TerritoryMap>(Grid{}, 2, std::vector<WorldId>{WorldId{0}});
    entry.memo.islands = {{BodyId{1}, 2}, {BodyId{1}, 2}, {BodyId{5}, 1}, {BodyId{7}, 0}};
    physics::ContactManifold contact;
    contact.a = BodyId{1};
    contact.b = BodyId{3};
    contact.count = 1;
    entry.memo.tested = {memory, {&contact, 1}, {}};
    entry.islands.emplace_back();
    entry.islands.back().label = BodyId{1};
    entry.islands.back().contact_points = 1;
  }
};

const std::vector<BodyId> kOwn = {BodyId{1}, BodyId{3}, BodyId{5}, BodyId{7}};

std::vector<BodyState> begin_states(std::size_t count) { return std::vector<BodyState>(count); }

TEST(Repetition, TakesOverWhatDependsOnUnchangedBodiesOnly) {
  Stale stale;
  Repetition repetition;
  repetition.start({}, stale.stored(), *stale.entry.rules.map);
  repetition.note_own(kOwn, {});
  std::vector<physics::ContactManifold> contacts;
  EXPECT_TRUE(repetition.take_contacts(BodyId{1}, BodyId{3}, contacts));
  EXPECT_EQ(contacts.size(), 1u);
  EXPECT_TRUE(repetition.take_contacts(BodyId{3}, BodyId{5}, contacts)) << "known not to touch";
  EXPECT_EQ(contacts.size(), 1u);

  const std::vector<BodyId> pair = {BodyId{1}, BodyId{3}};
  std::vector<BodyState> states = begin_states(2);
  physics::IslandReport report;
  EXPECT_TRUE(repetition.take_island(pair, states, &report));
  EXPECT_EQ(states[1].position_m, Vec3(3, 1, 0));
  EXPECT_EQ(report.contact_points, 1u);
  const std::vector<BodyId> mixed = {BodyId{7}};
  states = begin_states(1);
  EXPECT_FALSE(repetition.take_island(mixed, states, nullptr)) << "it had foreign bodies";
}

TEST(Repetition, AChangedBodyIsComputedAgainWithItsWholeIsland) {
  Stale stale;
  Repetition repetition;
  const std::vector<BodyId> changed = {BodyId{3}};
  repetition.start(changed, stale.stored(), *stale.entry.rules.map);
  repetition.note_own(kOwn, {});
  std::vector<physics::ContactManifold> contacts;
  EXPECT_FALSE(repetition.take_contacts(BodyId{1}, BodyId{3}, contacts));
  std::vector<BodyState> states = begin_states(2);
  physics::IslandReport report;
  const std::vector<BodyId> pair = {BodyId{1}, BodyId{3}};
  EXPECT_FALSE(repetition.take_island(pair, states, &report));
  // Without its partner, body 1 is another island, though it is unchanged.
  states = begin_states(1);
  const std::vector<BodyId> alone = {BodyId{1}};
  EXPECT_FALSE(repetition.take_island(alone, states, nullptr));
  const std::vector<BodyId> free = {BodyId{5}};
  EXPECT_TRUE(repetition.take_island(free, states, nullptr));
}

TEST(Repetition, ReportsTheBodiesThatEndDifferentlyAndThoseThatAlreadyDid) {
  Stale stale;
  stale.entry.differs = {BodyId{5}};
  Repetition repetition;
  repetition.start({}, stale.stored(), *stale.entry.rules.map);
  repetition.note_own(kOwn, {});
  std::vector<BodyState> ends = stale.entry.states;
  ends[1].linear_velocity_m_s = Vec3(0, 0, -0.0);  // another bit, equal as a number
  EXPECT_EQ(repetition.differences(kOwn, ends), (std::vector<BodyId>{BodyId{3}, BodyId{5}}));
  ends[3].impulses.emplace_back();  // the next solve would start from it
  EXPECT_EQ(repetition.differences(kOwn, ends),
            (std::vector<BodyId>{BodyId{3}, BodyId{5}, BodyId{7}}));
}

TEST(Repetition, AMigrantIsUnchangedOnlyIfItCameBeforeInTheSameState) {
  Stale stale;
  stale.entry.memo.migrants = {{BodyId{1}, {}}, {BodyId{3}, {}}};
  std::vector<Migrant> migrants = {{BodyId{1}, {}}, {BodyId{3}, {}}, {BodyId{5}, {}}};
  migrants[1].state.position_m = Vec3(0, 0, 1);
  Repetition repetition;
  repetition.start({}, stale.stored(), *stale.entry.rules.map);
  repetition.note_own(kOwn, migrants);
  std::vector<physics::ContactManifold> contacts;
  const BodyId ground = physics::static_id(0);
  EXPECT_TRUE(repetition.take_contacts(BodyId{1}, ground, contacts));
  EXPECT_FALSE(repetition.take_contacts(BodyId{3}, ground, contacts)) << "another state";
  EXPECT_FALSE(repetition.take_contacts(BodyId{5}, ground, contacts)) << "had not migrated";
  EXPECT_TRUE(repetition.take_contacts(BodyId{7}, ground, contacts));
}

TEST(Repetition, AGhostIsUnchangedOnlyIfItCameBeforeInTheSameState) {
  Stale stale;
  const auto ghost = [](std::uint32_t id) { return Ghost{BodyId{id}, WorldId{1}, {}, {}}; };
  stale.entry.memo.ghosts = {ghost(0), ghost(2), ghost(4), ghost(6)};
  std::vector<Ghost> ghosts = {ghost(0), ghost(2), ghost(4), ghost(6), ghost(8)};
  ghosts[1].state.position_m = Vec3(0, 0, 1);
  ghosts[2].box.max = Vec3(0, 0, 1);
  ghosts[3].owner = WorldId{2};
  Repetition repetition;
  repetition.start({}, stale.stored(), *stale.entry.rules.map);
  repetition.note_own(kOwn, {});
  repetition.note_ghosts(ghosts);
  std::vector<physics::ContactManifold> contacts;
  EXPECT_TRUE(repetition.take_contacts(BodyId{0}, BodyId{1}, contacts));
  EXPECT_FALSE(repetition.take_contacts(BodyId{1}, BodyId{2}, contacts)) << "another state";
  EXPECT_FALSE(repetition.take_contacts(BodyId{1}, BodyId{4}, contacts)) << "another box";
  EXPECT_FALSE(repetition.take_contacts(BodyId{1}, BodyId{6}, contacts)) << "another owner";
  EXPECT_FALSE(repetition.take_contacts(BodyId{1}, BodyId{8}, contacts)) << "was not here";
}

// Under another map another world may have to test the pairs of two owners.
TEST(Repetition, AGhostIsUnchangedOnlyUnderTheSameMap) {
  Stale stale;
  const std::vector<Ghost> ghosts = {{BodyId{0}, WorldId{1}, {}, {}}};
  stale.entry.memo.ghosts = ghosts;
  for (const std::uint32_t owner : {0u, 1u}) {
    const TerritoryMap map(Grid{}, 2, {WorldId{owner}});
    Repetition repetition;
    repetition.start({}, stale.stored(), map);
    repetition.note_own(kOwn, {});
    repetition.note_ghosts(ghosts);
    std::vector<physics::ContactManifold> contacts;
    EXPECT_EQ(repetition.take_contacts(BodyId{0}, BodyId{1}, contacts), owner == 0);
    EXPECT_TRUE(repetition.take_contacts(BodyId{1}, BodyId{3}, contacts)) << "both are own";
  }
}

// Bodies that rest on the ground, far from each other, in one territory, and a fast ball that comes
// in from another one, where nothing else is.
struct Intrusion {
  test::Scene scene{Vec3(0, 0, -9.81)};
  TerritoryMap map =
      make_territory_map({Grid{Vec3(-64, -64, 0), 1.0, {128, 128, 2}}, 2, MapKind::kBlocks, 1}, {});

  explicit Intrusion(double miss_m, int intruders = 1) {
    scene.ground();
    const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
    for (int i = 0; i < 100; ++i) scene.body(ball, Vec3(2.0 + 3 * (i % 10), 3 * (i / 10), 0.25));
    for (int i = 0; i < intruders; ++i)
      scene.body(ball, Vec3(-2.0, miss_m + 3 * i, 0.25), Vec3(24, 0, 0));
  }

  SimulationResult run(RollbackMode rollback,
                       ExecutorKind executor = ExecutorKind::kVirtual) const {
    return simulate(scene.description, scene.states, map,
                    {.executor = executor,
                     .steps = 60,
                     .buffer = 48,
                     .rollback = rollback,
                     .cluster = {.processors = 2, .latency_ns = 2'000'000}});
  }
};

std::uint64_t digest(const Intrusion& intrusion, const SimulationResult& result) {
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < intrusion.scene.states.size(); ++i) ids.push_back(BodyId{i});
  return physics::digest(ids, result.final_states);
}

// The intruder and what it hits: 2 or 3 of 101 bodies.
TEST(RollbackAndPropagate, OneDirtyIslandOfAHundredCostsAtMostFivePercentOfTheBaseline) {
  const Intrusion intrusion(0.0);
  const SimulationResult all = intrusion.run(RollbackMode::kInvalidate);
  const SimulationResult some = intrusion.run(RollbackMode::kPropagate);
  EXPECT_EQ(digest(intrusion, all), digest(intrusion, some));
  ASSERT_EQ(all.islands_committed, some.islands_committed);
  const std::uint64_t wasted_all = all.stages.islands_advanced() - all.islands_committed;
  const std::uint64_t wasted_some = some.stages.islands_advanced() - some.islands_committed;
  EXPECT_GT(wasted_all, 1000u);
  EXPECT_GT(some.worlds.islands_taken, 500u);
  EXPECT_LE(20 * wasted_some, wasted_all) << wasted_some << " of " << wasted_all;
}

// Ten rows of ten; an intruder in each of 1, 2, 5 or 10 rows. More intruders are more rollbacks, so
// it is the share of what the baseline wastes that is in proportion.
TEST(RollbackAndPropagate, WastedSolvesGrowInProportionToWhatIsDirty) {
  std::vector<double> each;
  for (const int intruders : {1, 2, 5, 10}) {
    const Intrusion intrusion(0.0, intruders);
    const auto wasted_by = [&](RollbackMode rollback) {
      const SimulationResult result = intrusion.run(rollback);
      return result.stages.islands_advanced() - result.islands_committed;
    };
    const std::uint64_t wasted = wasted_by(RollbackMode::kPropagate);
    RecordProperty("wasted_" + std::to_string(intruders), static_cast<int>(wasted));
    each.push_back(static_cast<double>(wasted) / intruders /
                   static_cast<double>(wasted_by(RollbackMode::kInvalidate)));
  }
  EXPECT_GT(each.front(), 0.0);
  for (const double wasted : each) EXPECT_NEAR(wasted, each.front(), 0.25 * each.front());
}

TEST(RollbackAndPropagate, AGhostThatTouchesNothingCausesNoSolve) {
  const Intrusion intrusion(1.5);
  const SimulationResult result = intrusion.run(RollbackMode::kPropagate);
  EXPECT_GT(result.worlds.steps_repeated, 0u);
  EXPECT_EQ(result.stages.islands_advanced(), result.islands_committed);
}

// A body leaves all bounds in step 8. Its world has run ahead of that when the intruder comes, whom
// it has nothing to do with.
TEST(RollbackAndPropagate, AFaultComesOutAgainThoughItsBodyIsUnchanged) {
  Intrusion intrusion(0.0);
  const std::uint32_t ball = intrusion.scene.shape(physics::Sphere{0.25});
  intrusion.scene.body(ball, Vec3(40, 40, 1e12 - 8e7), Vec3(0, 0, 6e8));  // 1e7 m a step
  const SimulationResult expected =
      intrusion.run(RollbackMode::kPropagate, ExecutorKind::kSequential);
  ASSERT_TRUE(expected.fault.has_value());
  EXPECT_EQ(expected.fault->step, 8);
  const SimulationResult result = intrusion.run(RollbackMode::kPropagate);
  EXPECT_GT(result.worlds.islands_taken, 100u);
  ASSERT_TRUE(result.fault.has_value());
  EXPECT_EQ(result.fault->step, expected.fault->step);
  EXPECT_EQ(result.fault->body_label, expected.fault->body_label);
}

}  // namespace
}  // namespace soda::models
