// Plans of random small scenes and runs: what is not needed counts nothing, whatever happens.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <thread>

#include "models/run/plan.hpp"
#include "models/user_input/input_feed.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;
using test::Choices;

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* value = std::getenv(name);
  return value ? std::strtoull(value, nullptr, 10) : otherwise;
}

bool one_in(std::uint64_t count, Choices& choices) { return choices.below(count) == 0; }

physics::Material random_material(Choices& choices) {
  const double frictions[] = {0.0, 0.5, 1.0}, restitutions[] = {0.0, 0.0, 0.3, 0.9};
  return {frictions[choices.below(3)], restitutions[choices.below(4)]};
}

std::uint32_t random_shape(test::Scene& scene, Choices& choices) {
  switch (choices.below(4)) {
    case 0:
      return scene.shape(physics::Sphere{choices.between(0.2, 0.5)});
    case 1:
      return scene.shape(physics::Box{Vec3(0.1, 0.1, 0.1) + choices.vector(0.05, 0.4)});
    case 2:
      return scene.shape(physics::Capsule{0.2, choices.between(0.2, 0.8)});
    default:
      return scene.shape(physics::Cylinder{0.3, choices.between(0.2, 0.8)});
  }
}

void add_static(std::uint32_t shape, const Vec3& at, test::Scene& scene, Choices& choices) {
  physics::StaticBody fixed;
  fixed.shape = shape;
  fixed.position_m = at;
  fixed.material = random_material(choices);
  if (one_in(4, choices)) fixed.surface_velocity_m_s = Vec3(1, 0.5, 0);
  scene.description.statics.push_back(fixed);
}

void add_statics(test::Scene& scene, Choices& choices) {
  if (!one_in(4, choices))
    add_static(scene.shape(physics::HalfSpace{}), Vec3::Zero(), scene, choices);
  if (one_in(3, choices))
    add_static(scene.shape(physics::Box{Vec3(0.5, 2, 0.5)}), Vec3(1.5, 0, 0.3), scene, choices);
  if (!one_in(5, choices)) return;
  const physics::TriangleMesh slope{{{-4, -4, 0.3}, {4, -4, 0.1}, {4, 4, 0.2}, {-4, 4, 0.4}},
                                    {{0, 1, 2}, {0, 2, 3}}};
  add_static(scene.shape(slope), Vec3::Zero(), scene, choices);
}

void push(test::Scene& scene, Choices& choices) {
  if (one_in(3, choices)) {
    scene.description.bodies.back().own_field_m_s2 = choices.vector(-20, 20);
  }
  if (one_in(3, choices)) {
    scene.description.forces.push_back({.body_force_newton = choices.vector(-200, 200),
                                        .linear_damping_1_s = choices.between(0, 1)});
    scene.description.bodies.back().forces =
        static_cast<std::uint32_t>(scene.description.forces.size() - 1);
  }
  if (!one_in(5, choices)) return;
  scene.description.drives.push_back({.velocity_m_s = choices.vector(-2, 2), .lane = std::nullopt});
  scene.description.bodies.back().drive =
      static_cast<std::uint32_t>(scene.description.drives.size() - 1);
}

// Between two bodies, or a body and the world, in the middle.
void add_joint(test::Scene& scene, Choices& choices) {
  physics::Joint joint;
  joint.label = static_cast<std::uint32_t>(scene.description.joints.size());
  joint.kind = static_cast<physics::JointKind>(choices.below(6));
  const auto bodies = static_cast<std::uint32_t>(scene.states.size());
  const auto a = static_cast<std::uint32_t>(choices.below(bodies));
  const auto b = static_cast<std::uint32_t>(choices.below(bodies));
  joint.a = BodyId{std::min(a, b)};
  const Vec3 at_a = scene.states[std::min(a, b)].position_m;
  joint.reach_m = 8.0;
  if (a == b) {
    joint.anchor_b_m = at_a;
  } else {
    joint.b = BodyId{std::max(a, b)};
    joint.anchor_a_m = 0.5 * (scene.states[std::max(a, b)].position_m - at_a);
    joint.anchor_b_m = -joint.anchor_a_m;
  }
  joint.length_m = 0.1;
  joint.stiffness_newton_m = choices.between(10, 5000);
  joint.damping_newton_s_m = one_in(2, choices) ? 0.0 : choices.between(0, 50);
  joint.collides = one_in(2, choices);
  const bool bounded =
      joint.kind == physics::JointKind::kHinge || joint.kind == physics::JointKind::kSlider;
  if (bounded && one_in(2, choices)) joint.limits = physics::JointLimits{-0.3, 0.3};
  if (bounded && one_in(2, choices)) joint.motor = physics::JointMotor{1.0, 100.0};
  scene.description.joints.push_back(joint);
}

void choose_settings(physics::SceneDescription& scene, Choices& choices) {
  scene.solver.direct = !one_in(6, choices);
  scene.solver.rest = !one_in(6, choices);
  scene.solver.warm_starting = !one_in(6, choices);
  scene.solver.contact_response = !one_in(12, choices);
  if (one_in(12, choices)) scene.tolerance = 1e-2;
  if (one_in(6, choices)) scene.dt_s = 0.1;
}

test::Scene random_scene(Choices& choices) {
  test::Scene scene(one_in(6, choices) ? Vec3(0, 0, 0) : Vec3(0, 0, -9.81));
  add_statics(scene, choices);
  const std::uint64_t bodies = 1 + choices.below(5);
  const bool calm = one_in(3, choices);
  for (std::uint64_t i = 0; i < bodies; ++i) {
    const Vec3 at = choices.vector(-1.2, 1.2) + Vec3(0, 0, 1.7);
    const Vec3 velocity = calm ? Vec3(0, 0, 0) : choices.vector(-6, 6);
    scene.body(random_shape(scene, choices), at, velocity, random_material(choices))
        .angular_velocity_rad_s = calm ? Vec3(0, 0, 0) : choices.vector(-10, 10);
    push(scene, choices);
  }
  if (one_in(2, choices))
    for (std::uint64_t i = choices.below(4); i > 0; --i) add_joint(scene, choices);
  physics::order_joints(scene.description);
  choose_settings(scene.description, choices);
  return scene;
}

InputOptions random_inputs(const test::Scene& scene, std::int64_t steps, Choices& choices) {
  InputOptions inputs;
  if (!one_in(3, choices)) return inputs;
  for (std::uint32_t body = 0; body < scene.states.size(); ++body)
    if (scene.description.bodies[body].joints == 0 && one_in(4, choices))
      inputs.absent.push_back(BodyId{body});
  for (std::uint32_t i = 0; i < 5; ++i) {
    UserInput input;
    input.id = i;
    input.step = static_cast<std::int64_t>(choices.below(static_cast<std::uint64_t>(steps)));
    input.body = BodyId{static_cast<std::uint32_t>(choices.below(scene.states.size()))};
    const bool jointed = scene.description.bodies[physics::index_of(input.body)].joints > 0;
    input.kind = static_cast<InputKind>(jointed ? 2 + choices.below(3) : choices.below(5));
    input.state.position_m = choices.vector(-1.5, 1.5) + Vec3(0, 0, 2);
    input.state.linear_velocity_m_s = choices.vector(-3, 3);
    input.sets_linear = true;
    input.impulse_newton_s = choices.vector(-100, 100);
    input.material = random_material(choices);
    inputs.script.push_back(input);
  }
  inputs.at_the_last_moment = one_in(2, choices);
  return inputs;
}

RunOptions random_run(const test::Scene& scene, Choices& choices) {
  RunOptions run{.executor = static_cast<ExecutorKind>(choices.below(4))};
  run.steps = 25;
  run.threads = static_cast<unsigned>(1 + choices.below(3));
  run.buffer = static_cast<std::int64_t>(1 + choices.below(20));
  run.scheduling_seed = one_in(2, choices) ? 0 : choices.next();
  run.rollback = static_cast<RollbackMode>(choices.below(3));
  run.gating = !one_in(3, choices);
  run.split_islands = !one_in(3, choices);
  if (one_in(3, choices)) run.ghosts = static_cast<GhostMode>(choices.below(3));
  if (one_in(3, choices))
    run.balancing = {.policy = static_cast<BalancingPolicy>(choices.below(3)), .interval = 3};
  if (one_in(6, choices)) run.synchronisation = kernel::Synchronisation::kLockstep;
  run.cluster.processors = static_cast<unsigned>(1 + choices.below(4));
  run.cluster.latency_ns = static_cast<std::int64_t>(choices.below(200'000));
  run.cluster.jitter_ns = static_cast<std::int64_t>(choices.below(50'000));
  run.cluster.check_purity = run.rollback != RollbackMode::kWarm && one_in(3, choices);
  run.inputs = random_inputs(scene, run.steps, choices);
  return run;
}

SimulationResult simulated(const test::Scene& scene, const TerritoryMap& map,
                           const RunOptions& options) {
  if (options.executor != ExecutorKind::kMpi)
    return simulate(scene.description, scene.states, map, options);
  constexpr std::uint32_t kRanks = 2;
  kernel::RankThreads network(kRanks, 7);
  std::vector<SimulationResult> results(kRanks);
  {
    std::vector<std::jthread> ranks;
    for (std::uint32_t rank = 0; rank < kRanks; ++rank)
      ranks.emplace_back([&, rank] {
        RunOptions own = options;
        own.transport = &network.end(rank);
        results[rank] = simulate(scene.description, scene.states, map, own);
      });
  }
  return results[0];
}

struct Tally {
  std::uint64_t runs = 0, faults = 0, left_out = 0;
};

void expect_an_honest_plan(std::uint64_t seed, Tally& tally) {
  Choices choices(seed);
  const test::Scene scene = random_scene(choices);
  RunOptions options = random_run(scene, choices);
  const TerritoryMap map = blocks(static_cast<std::uint32_t>(1 + choices.below(8)));
  // What a user offers while it runs; nothing else acts then.
  LiveInputs live;
  if (one_in(12, choices)) {
    for (const UserInput& input : options.inputs.script) live.offer(input);
    options.inputs.script.clear();
    options.inputs.live = &live;
  }
  const std::vector<PlanLine> plan = make_plan(scene.description, map.worlds(), options);
  const SimulationResult result = simulated(scene, map, options);
  const std::vector<std::uint64_t> counts = plan_counters(plan, result);
  ++tally.runs;
  tally.faults += result.fault.has_value();
  for (std::size_t i = 0; i < plan.size(); ++i) {
    if (plan[i].needed) continue;
    ++tally.left_out;
    EXPECT_EQ(counts[i], 0u) << "seed " << seed << ", " << plan[i].stage << ": " << plan[i].reason;
  }
}

// SODA_PLAN_SEEDS more of them, from SODA_PLAN_FIRST on.
TEST(RandomPlans, WhatIsNotNeededIsNeverDone) {
  const std::uint64_t first = from_environment("SODA_PLAN_FIRST", 1);
  const std::uint64_t seeds = from_environment("SODA_PLAN_SEEDS", 120);
  Tally tally;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) expect_an_honest_plan(seed, tally);
  EXPECT_EQ(tally.runs, seeds);
  EXPECT_LT(3 * tally.faults, tally.runs);     // most runs come to their end
  EXPECT_GT(tally.left_out, 12 * tally.runs);  // and plans leave much out
  RecordProperty("faults", static_cast<int>(tally.faults));
  RecordProperty("lines_left_out", static_cast<int>(tally.left_out));
}

}  // namespace
}  // namespace soda::models
