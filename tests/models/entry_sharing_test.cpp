// What runs take for buffer entries, and that sharing them changes no bit.
#include <gtest/gtest.h>

#include "models/run/simulation.hpp"
#include "models/transform_buffer/stored_entry.hpp"
#include "physics/measures/measures.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

TerritoryMap blocks(std::uint32_t worlds) {
  return make_territory_map(
      {Grid{Vec3(-10, -10, 0), 2.0, {10, 10, 4}}, worlds, MapKind::kBlocks, 1}, {});
}

// Spheres rest on the ground apart from each other.
test::Scene resting_spheres() {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t ball = scene.shape(physics::Sphere{0.2});
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 20; ++y) scene.body(ball, Vec3(x - 9.5, y - 9.5, 0.2));
  return scene;
}

double share_taken(const WorldCounters& counters) {
  return static_cast<double>(counters.state_bytes_stored) /
         static_cast<double>(counters.state_bytes_whole);
}

std::vector<std::uint64_t> digests_of(const test::Scene& scene, std::uint32_t worlds,
                                      const RunOptions& options, SimulationResult& result) {
  std::vector<std::uint64_t> digests;
  const CommitObserver observer{.wants_states = true,
                                .on_step = [&digests](const CommittedStep& step) {
                                  digests.push_back(physics::digest(step.ids, step.states));
                                }};
  result = simulate(scene.description, scene.states, blocks(worlds), options, observer);
  return digests;
}

TEST(EntrySharing, AScheduledRunOfAGasTakesAtMostFiveQuartersOfItsStates) {
  test::Choices choices(2);
  test::Scene scene;
  const std::uint32_t ball = scene.shape(physics::Sphere{0.2});
  for (int i = 0; i < 400; ++i) {
    const Vec3 place = choices.vector(-9, 9);
    scene.body(ball, Vec3(place.x(), place.y(), 4 + place.z() / 3), choices.vector(-3, 3));
  }
  const RunOptions options{.executor = ExecutorKind::kThreads, .threads = 2, .steps = 60};
  const SimulationResult result = simulate(scene.description, scene.states, blocks(4), options);
  EXPECT_GT(result.worlds.bodies_stored, 400u * 50u);
  EXPECT_LE(share_taken(result.worlds), 1.25);
}

// What an entry costs beside its bodies falls on few of them here.
TEST(EntrySharing, ThreeMovingBoxesAWorldTakeAtMostFiveQuartersOfTheirStates) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t box = scene.shape(physics::Box{{0.25, 0.25, 0.25}});
  for (const double x : {-5.0, 5.0})
    for (const double y : {-5.0, 5.0})
      for (int i = 0; i < 3; ++i) scene.body(box, Vec3(x, y, 0.25 + 0.5 * i), Vec3(2, 0, 0));
  const RunOptions options{.executor = ExecutorKind::kThreads, .threads = 2, .steps = 40};
  const SimulationResult result = simulate(scene.description, scene.states, blocks(4), options);
  EXPECT_GT(result.worlds.bodies_stored, 12u * 35u);
  EXPECT_LE(share_taken(result.worlds), 1.25);
}

// Entry 0 and the first steps, in which the contacts settle, are taken whole.
TEST(EntrySharing, ARunOfWorldsAtRestTakesATwentiethOfThat) {
  const RunOptions options{.executor = ExecutorKind::kThreads, .threads = 2, .steps = 300};
  const test::Scene scene = resting_spheres();
  const SimulationResult result = simulate(scene.description, scene.states, blocks(4), options);
  EXPECT_GT(result.worlds.bodies_stored, 400u * 250u);
  EXPECT_LE(share_taken(result.worlds), 0.05 * 1.25);
}

// A ball that crosses all worlds makes resting neighbours go back over entries that are shared.
TEST(EntrySharing, RollbacksThroughSharedEntriesGiveTheBitsOfTheSequentialRun) {
  test::Scene scene = resting_spheres();
  const std::uint32_t ball = scene.shape(physics::Sphere{0.3});
  for (int i = 0; i < 4; ++i)
    scene.body(ball, Vec3(-9 + 0.1 * i, 6.0 * i - 9, 0.5), Vec3(25, 0.5 * i, 0));
  SimulationResult plain, shared;
  const std::vector<std::uint64_t> expected = digests_of(scene, 1, {.steps = 60}, plain);
  for (const RollbackMode rollback : {RollbackMode::kPropagate, RollbackMode::kInvalidate}) {
    RunOptions options{.executor = ExecutorKind::kVirtual, .steps = 60, .buffer = 16};
    options.rollback = rollback;
    options.cluster.processors = 8;
    options.cluster.latency_ns = 300'000;
    EXPECT_EQ(digests_of(scene, 8, options, shared), expected);
    EXPECT_GT(shared.events.rollbacks, 5u);
    EXPECT_LT(share_taken(shared.worlds), 0.3);
  }
  EXPECT_EQ(plain.worlds.entries_stored, 0u) << "one world cannot go back";
}

// Every fourth body moves, so hardly a chunk rests. What rests is taken once more, when it is found
// to, and from then on not at all; nor does it keep what moved with it.
TEST(EntrySharing, ABodyThatRestsAmongOthersThatMoveIsCopiedOnce) {
  constexpr std::size_t kBodies = 400, kImpulses = 8, kStateBytes = 104 + 48 * kImpulses;
  SharedMemory memory;
  WorldCounters counters;
  StoredEntry older;
  std::vector<std::uint64_t> taken;
  for (int step = 0; step < 6; ++step) {
    BufferEntry entry;
    for (std::uint32_t id = 0; id < kBodies; ++id) {
      entry.ids.push_back(physics::BodyId{id});
      entry.states.emplace_back();
      entry.states.back().position_m = Vec3(id, id % 4 == 0 ? 0.1 * step : 0.0, 0);
      entry.states.back().impulses.resize(kImpulses);
    }
    const std::uint64_t before = memory.taken_bytes;
    older = store(memory, entry, older, {}, counters);
    taken.push_back(memory.taken_bytes - before);
    std::vector<physics::BodyId> ids;
    std::vector<physics::BodyState> states;
    load_bodies(older, ids, states);
    ASSERT_EQ(physics::digest(ids, states), physics::digest(entry.ids, entry.states)) << step;
  }
  const std::uint64_t moving = kBodies / 4 * kStateBytes, items = kBodies * sizeof(StoredBody);
  EXPECT_GT(taken[0], kBodies * kStateBytes);
  EXPECT_LT(taken[2], 5 * (moving + items) / 4);
  EXPECT_EQ(taken[5], taken[2]);
  EXPECT_LT(memory.live_bytes, taken[0] + kBodies * 48) << "old chunks are gone";
}

}  // namespace
}  // namespace soda::models
