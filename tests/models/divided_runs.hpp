// Scenes in which much happens at the borders of territories, and runs of them that keep the digest
// of every step.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {

// Of the square of 8 x 8 m around the origin, 4 m high.
inline TerritoryMap blocks(std::uint32_t worlds) {
  return make_territory_map(
      {Grid{physics::Vec3(-4, -4, 0), 1.0, {8, 8, 4}}, worlds, MapKind::kBlocks, 1}, {});
}

// A stack that leans over a corner of territories, and as many bodies that fall and slide across
// borders, at most so fast along each axis.
inline test::Scene stack_and_sliders(std::uint64_t seed, int sliders = 10, double speed_m_s = 4) {
  using physics::Vec3;
  test::Choices choices(seed);
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t box = scene.shape(physics::Box{Vec3(0.3, 0.3, 0.3)});
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  for (int i = 0; i < 5; ++i) scene.body(box, Vec3(0.02 * i, 0.01 * i, 0.3 + 0.6 * i));
  for (int i = 0; i < sliders; ++i)
    scene.body(i % 2 == 0 ? box : ball, choices.vector(-3.5, 3.5) + Vec3(0, 0, 4),
               choices.vector(-speed_m_s, speed_m_s));
  return scene;
}

// The same and a ball that crosses many cells in a step.
inline test::Scene busy_scene(std::uint64_t seed, int sliders = 10, double speed_m_s = 4) {
  test::Scene scene = stack_and_sliders(seed, sliders, speed_m_s);
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  scene.body(ball, physics::Vec3(-3.5, 0.1, 0.8), physics::Vec3(120, 0, 0));
  return scene;
}

struct RunOutcome {
  std::vector<std::uint64_t> digests;  // of each step
  SimulationResult result;
};

// Each step, and each change of territories, is told once and in order.
inline RunOutcome run(const test::Scene& scene, const TerritoryMap& map,
                      const RunOptions& options) {
  RunOutcome outcome;
  std::vector<TerritoryChange> changes;
  const CommitObserver observer{
      .wants_states = true, .on_step = [&](const CommittedStep& step) {
        EXPECT_EQ(step.step, static_cast<std::int64_t>(outcome.digests.size()) + 1);
        EXPECT_EQ(step.ids.size(), scene.states.size()) << "step " << step.step;
        outcome.digests.push_back(physics::digest(step.ids, step.states));
        for (const TerritoryChange& change : step.territory_changes) {
          EXPECT_EQ(change.step, step.step - 1);
          changes.push_back(change);
        }
      }};
  outcome.result = simulate(scene.description, scene.states, map, options, observer);
  EXPECT_EQ(changes == outcome.result.territory_changes, true);
  return outcome;
}

}  // namespace soda::models
