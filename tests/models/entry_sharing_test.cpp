// What runs take for buffer entries, and that sharing them changes no bit.
#include <gtest/gtest.h>

#include "models/simulation.hpp"
#include "physics/measures.hpp"
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
  const CommitObserver observer{true, [&digests](const CommittedStep& step) {
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

}  // namespace
}  // namespace soda::models
