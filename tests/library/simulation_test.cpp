// Stepping: the bits of `soda run`, states, callbacks, faults.
#include "soda/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "library/arena.hpp"
#include "soda/run.hpp"

namespace soda {
namespace {

namespace fs = std::filesystem;
using library_test::arena;

std::vector<std::string> library_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(SODA_SOURCE_DIR "/scenarios/library"))
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

Scene library_scene(const std::string& name) {
  return Scene::load(SODA_SOURCE_DIR "/scenarios/library/" + name + ".json");
}

class LibraryDigests : public testing::TestWithParam<std::string> {};

// The divided run is what `soda run` makes; determinism/ compares that with stored digests.
TEST_P(LibraryDigests, StepByStepAsDivided) {
  const Scene scene = library_scene(GetParam());
  const std::int64_t steps = std::min<std::int64_t>(scene.steps(), 12);
  Simulation simulation(scene);
  simulation.step(steps);
  const RunResult divided = run(scene, {.steps = steps, .threads = 2});
  EXPECT_EQ(simulation.digest(), divided.digest);
  EXPECT_EQ(divided.steps, steps);
  EXPECT_EQ(simulation.states(), divided.states);
}

INSTANTIATE_TEST_SUITE_P(Scenes, LibraryDigests, testing::ValuesIn(library_scenes()),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(LibrarySimulation, WholeRunsHaveTheStoredDigests) {
  struct Stored {
    std::int64_t steps = 0;
    std::uint64_t last = 0;
  };
  std::ifstream file(SODA_SOURCE_DIR "/tests/golden/digests.txt");
  std::map<std::string, Stored> stored;
  for (std::string line; std::getline(file, line);) {
    std::string scene;
    Stored run;
    std::istringstream(line) >> scene >> run.steps >> std::hex >> run.last;
    stored[scene] = run;
  }
  for (const std::string name : {"ragdolls", "user-input", "breaking-bridge"}) {
    ASSERT_TRUE(stored.contains("library/" + name)) << name;
    Simulation simulation(library_scene(name));
    simulation.step(stored["library/" + name].steps);
    EXPECT_EQ(simulation.digest(), stored["library/" + name].last) << name;
  }
}

TEST(LibrarySimulation, CommittedStepsOfARunAreThoseOfASimulation) {
  const Scene scene = arena();
  std::vector<std::vector<BodyState>> committed;
  const RunResult divided =
      run(scene, {.steps = 40, .worlds = 4, .threads = 2}, [&committed](const CommittedStep& step) {
        committed.emplace_back(step.states.begin(), step.states.end());
        EXPECT_EQ(step.body_ids.size(), step.states.size());
      });
  ASSERT_EQ(committed.size(), 40u);
  Simulation simulation(scene);
  for (const std::vector<BodyState>& states : committed) {
    simulation.step();
    ASSERT_EQ(simulation.states(), states) << "after " << simulation.steps();
  }
  EXPECT_GT(divided.events_committed, 0u);
}

TEST(LibrarySimulation, StepsAreCountedAndTold) {
  Simulation simulation(arena());
  std::vector<std::int64_t> told;
  simulation.on_step([&told](const Simulation& now) { told.push_back(now.steps()); });
  simulation.step(3);
  simulation.step(0);
  EXPECT_EQ(told, (std::vector<std::int64_t>{1, 2, 3}));
  EXPECT_DOUBLE_EQ(simulation.time_s(), 3.0 / 120.0);
  EXPECT_EQ(simulation.counters().steps, 3u);
  EXPECT_GT(simulation.counters().contact_points, 0u);
  EXPECT_GT(simulation.report().islands, 0u);
  EXPECT_THROW(simulation.step(-1), UsageError);
}

TEST(LibrarySimulation, WhatACallbackThrowsLeavesTheStep) {
  Simulation simulation(arena());
  simulation.on_step([](const Simulation& now) {
    if (now.steps() == 2) throw std::runtime_error("enough");
  });
  EXPECT_THROW(simulation.step(5), std::runtime_error);
  EXPECT_EQ(simulation.steps(), 2);
}

TEST(LibrarySimulation, StatesAreReadByIdAndInOrder) {
  Simulation simulation(arena());
  EXPECT_EQ(simulation.body_ids().size(), 9u);
  EXPECT_FALSE(simulation.has(library_test::kWaiting));
  EXPECT_EQ(simulation.state(library_test::kBall), simulation.states()[0]);
  EXPECT_THROW(simulation.state(77), UsageError);
  try {
    simulation.state(library_test::kWaiting);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "body 2 is not there after 0 steps");
  }
}

TEST(LibrarySimulation, AStateThatIsWrittenBackChangesNothing) {
  Simulation touched(arena()), left(arena());
  for (int i = 0; i < 60; ++i) {
    for (const std::uint32_t body : touched.body_ids())
      touched.set_state(body, touched.state(body));
    touched.step();
    left.step();
  }
  EXPECT_EQ(touched.digest(), left.digest());
}

TEST(LibrarySimulation, BodiesAreWhereTheyArePut) {
  Simulation simulation(arena());
  simulation.step(60);
  BodyState state = simulation.state(library_test::kFirstBox + 4);
  state.position_m = {10.0, 10.0, 5.0};
  state.velocity_m_s = {};
  simulation.set_state(library_test::kFirstBox + 4, state);
  EXPECT_EQ(simulation.state(library_test::kFirstBox + 4), state);
  for (const Contact& contact : simulation.contacts())
    EXPECT_FALSE(contact.a.id == library_test::kFirstBox + 4) << "it bears nothing any more";
  simulation.step(12);
  // Free fall over .1 s, by steps of 1/120 s.
  EXPECT_NEAR(simulation.state(library_test::kFirstBox + 4).position_m.z, 5.0 - 0.5 * 9.81 * 0.01,
              0.005);
  state.orientation = {2.0, 0.0, 0.0, 0.0};
  EXPECT_THROW(simulation.set_state(library_test::kFirstBox, state), UsageError);
  state.orientation = {};
  state.position_m.x = std::numeric_limits<double>::infinity();
  EXPECT_THROW(simulation.set_state(library_test::kFirstBox, state), UsageError);
}

TEST(LibrarySimulation, AnAbsurdStateIsANumericalErrorUntilItIsTakenBack) {
  Simulation simulation(arena());
  const Snapshot good = simulation.snapshot();
  BodyState state = simulation.state(library_test::kBall);
  state.velocity_m_s = {1e308, 0.0, 0.0};
  state.position_m = {1e308, 0.0, 0.0};
  simulation.set_state(library_test::kBall, state);
  try {
    simulation.step(10);
    FAIL() << "no fault";
  } catch (const NumericalError& error) {
    EXPECT_EQ(error.body(), library_test::kBall);
    EXPECT_EQ(error.step(), simulation.steps());
  }
  EXPECT_THROW(simulation.step(), NumericalError);
  simulation.restore(good);
  EXPECT_NO_THROW(simulation.step(10));
}

TEST(LibraryRun, OptionsAreChecked) {
  EXPECT_THROW(run(arena(), {.steps = -1}), UsageError);
  EXPECT_THROW(run(arena(), {.worlds = 0}), UsageError);
  EXPECT_THROW(run(arena(), {.worlds = 1000}), UsageError);
  EXPECT_THROW(run(arena(), {.threads = 0}), UsageError);
  EXPECT_THROW(run(arena(), {.buffer_entries = 0}), UsageError);
}

}  // namespace
}  // namespace soda
