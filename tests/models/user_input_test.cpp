// User input: the same committed steps for every executor, whenever the messages come.
#include "models/user_input/user_input.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "models/messages/schedule.hpp"
#include "models/run/simulation.hpp"
#include "models/user_input/input_feed.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/measures/measures.hpp"
#include "physics/step/step.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

constexpr std::int64_t kSteps = 50;

// Not there yet at the start.
const std::vector<BodyId> kAbsent{BodyId{12}, BodyId{13}, BodyId{14}};

UserInput random_input(std::uint32_t id, const test::Scene& scene, test::Choices& choices) {
  UserInput input;
  input.id = id;
  input.step = static_cast<std::int64_t>(choices.below(kSteps + 3));
  input.kind = static_cast<InputKind>(choices.below(5));
  const auto body = static_cast<std::uint32_t>(choices.below(scene.states.size()));
  input.body = BodyId{body};
  input.state.position_m = Vec3(0.5, 0.5, 1.0) + choices.vector(-1.5, 1.5);
  input.state.linear_velocity_m_s = choices.vector(-3, 3);
  input.state.angular_velocity_rad_s = choices.vector(-3, 3);
  input.sets_linear = choices.below(2) == 0;
  input.sets_angular = !input.sets_linear || choices.below(2) == 0;
  input.impulse_newton_s = choices.vector(-2, 2) * scene.description.bodies[body].mass_kg;
  input.point_local_m = choices.vector(-0.3, 0.3);
  input.material = {choices.between(0, 1), choices.between(0, 0.5)};
  return input;
}

InputOptions random_inputs(const test::Scene& scene, std::uint64_t seed, int count = 40) {
  test::Choices choices(seed);
  InputOptions inputs;
  inputs.absent = kAbsent;
  for (int i = 0; i < count; ++i)
    inputs.script.push_back(random_input(static_cast<std::uint32_t>(i), scene, choices));
  return inputs;
}

struct Outcome {
  std::vector<std::uint64_t> digests;
  std::vector<CommittedInput> inputs;
  SimulationResult result;
};

// What no world and no message is involved in.
Outcome bare_loop(const test::Scene& start, InputOptions inputs) {
  test::Scene scene = start;
  const physics::Geometry geometry(scene.description);
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  Presence presence(inputs.absent);
  for (std::uint32_t i = 0; i < scene.states.size(); ++i) {
    if (!presence.has(BodyId{i})) continue;
    ids.push_back(BodyId{i});
    states.push_back(scene.states[i]);
  }
  std::sort(inputs.script.begin(), inputs.script.end(), acts_before);
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  Outcome outcome;
  auto next = inputs.script.begin();
  for (std::int64_t step = 0; step < kSteps; ++step) {
    for (; next != inputs.script.end() && next->step == step; ++next) {
      const bool has_effect = presence.note(*next);
      outcome.inputs.push_back({*next, next->step, has_effect});
      if (has_effect) act_on_scene(*next, scene.description, ids, states);
    }
    scratch.resting.forget();
    physics::step(scene.description, geometry, ids, states, {scratch, report, counters});
    outcome.digests.push_back(physics::digest(ids, states));
  }
  return outcome;
}

Outcome simulated(const test::Scene& scene, std::uint32_t worlds, const RunOptions& options,
                  const std::function<void(std::int64_t step)>& on_step = {}) {
  Outcome outcome;
  CommitObserver observer;
  observer.wants_states = true;
  observer.on_step = [&](const CommittedStep& step) {
    outcome.digests.push_back(physics::digest(step.ids, step.states));
    outcome.inputs.insert(outcome.inputs.end(), step.inputs.begin(), step.inputs.end());
    if (on_step) on_step(step.step);
  };
  outcome.result = simulate(scene.description, scene.states, blocks(worlds), options, observer);
  return outcome;
}

void expect_equal(const Outcome& found, const Outcome& expected, const std::string& how) {
  ASSERT_EQ(found.digests, expected.digests) << how;
  EXPECT_EQ(final_digest(found.result), expected.digests.back()) << how;
  ASSERT_EQ(found.inputs.size(), expected.inputs.size()) << how;
  for (std::size_t i = 0; i < found.inputs.size(); ++i) {
    EXPECT_EQ(found.inputs[i].input.id, expected.inputs[i].input.id) << how;
    EXPECT_EQ(found.inputs[i].had_effect, expected.inputs[i].had_effect) << how;
  }
  EXPECT_EQ(found.result.inputs.size(), found.inputs.size()) << how;
}

TEST(UserInput, OfAScriptGivesTheBitsOfTheBareLoopInAnyDivisionInSequence) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const test::Scene scene = stack_and_sliders(seed);
    const InputOptions inputs = random_inputs(scene, seed);
    const Outcome expected = bare_loop(scene, inputs);
    EXPECT_NE(expected.digests, bare_loop(scene, {kAbsent, {}}).digests);
    for (const std::uint32_t worlds : {1u, 2u, 8u, 64u})
      expect_equal(simulated(scene, worlds, {.steps = kSteps, .inputs = inputs}), expected,
                   std::to_string(worlds) + " worlds, seed " + std::to_string(seed));
  }
}

// One of the bodies slides along a rail of the world.
test::Scene with_a_motor(std::uint64_t seed) {
  test::Scene scene = stack_and_sliders(seed);
  physics::Joint joint;
  joint.kind = physics::JointKind::kSlider;
  joint.a = BodyId{2};
  joint.anchor_b_m = scene.states[2].position_m;
  joint.frame_a = scene.states[2].orientation.conjugate() *
                  physics::turn_between(Vec3::UnitZ(), Vec3::UnitX());
  joint.frame_b = physics::turn_between(Vec3::UnitZ(), Vec3::UnitX());
  joint.motor = physics::JointMotor{1.0, 50.0 * scene.description.bodies[2].mass_kg};
  joint.reach_m = 10.0;
  scene.description.joints = {joint};
  physics::order_joints(scene.description);
  return scene;
}

InputOptions motor_inputs(std::uint64_t seed) {
  test::Choices choices(seed);
  InputOptions inputs;
  inputs.absent = kAbsent;
  for (std::uint32_t id = 0; id < 12; ++id) {
    UserInput& input = inputs.script.emplace_back();
    input.id = id;
    input.step = static_cast<std::int64_t>(choices.below(kSteps));
    input.kind = InputKind::kSetMotor;
    input.body = BodyId{2};
    if (choices.below(2) == 0) input.motor_speed = choices.between(-4, 4);
    if (choices.below(2) == 0) input.motor_target = choices.between(-1, 1);
    if (choices.below(4) == 0) input.motor_push = choices.between(0, 20);
  }
  return inputs;
}

TEST(UserInput, ForMotorsGivesTheBitsOfTheBareLoopInAnyDivision) {
  std::uint64_t rollbacks = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const test::Scene scene = with_a_motor(seed);
    InputOptions inputs = motor_inputs(seed);
    const Outcome expected = bare_loop(scene, inputs);
    EXPECT_NE(expected.digests, bare_loop(scene, {kAbsent, {}}).digests);
    for (const ExecutorKind executor : {ExecutorKind::kSequential, ExecutorKind::kThreads})
      for (const std::uint32_t worlds : {1u, 2u, 16u}) {
        inputs.at_the_last_moment = executor == ExecutorKind::kThreads && seed % 2 == 0;
        const Outcome found = simulated(
            scene, worlds,
            {.executor = executor, .threads = 2, .steps = kSteps, .buffer = 12, .inputs = inputs});
        expect_equal(found, expected,
                     std::to_string(worlds) + " worlds, seed " + std::to_string(seed));
        rollbacks += found.result.events.rollbacks;
      }
  }
  EXPECT_GT(rollbacks, 0u);
}

TEST(UserInput, RollsBackLikeAnyStragglerUnderThreads) {
  std::uint64_t rollbacks = 0, taken = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const test::Scene scene = stack_and_sliders(seed);
    InputOptions inputs = random_inputs(scene, seed);
    const Outcome expected = bare_loop(scene, inputs);
    for (const std::uint32_t worlds : {2u, 16u, 64u})
      for (const RollbackMode rollback : {RollbackMode::kPropagate, RollbackMode::kInvalidate}) {
        inputs.at_the_last_moment = seed % 2 == 0;
        const Outcome found = simulated(scene, worlds,
                                        {.executor = ExecutorKind::kThreads,
                                         .threads = 1 + static_cast<unsigned>(seed % 3),
                                         .steps = kSteps,
                                         .buffer = 1 + static_cast<std::int64_t>(seed * 3),
                                         .scheduling_seed = seed / 2,
                                         .rollback = rollback,
                                         .inputs = inputs});
        expect_equal(found, expected,
                     std::to_string(worlds) + " worlds, seed " + std::to_string(seed));
        rollbacks += found.result.events.rollbacks;
        taken += found.result.worlds.islands_taken;
      }
  }
  EXPECT_GT(rollbacks, 0u);
  EXPECT_GT(taken, 0u);
}

TEST(UserInput, AtTheLastMomentMakesWorldsThatRanAheadRollBack) {
  std::uint64_t jumps = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const test::Scene scene = stack_and_sliders(seed);
    RunOptions options{.executor = ExecutorKind::kVirtual,
                       .steps = kSteps,
                       .buffer = 12,
                       .inputs = {.absent = kAbsent, .script = {}}};
    options.cluster.processors = 1;
    const std::uint64_t alone = simulated(scene, 2, options).result.events.stragglers;
    options.inputs = random_inputs(scene, seed);
    options.inputs.at_the_last_moment = true;
    const Outcome found = simulated(scene, 2, options);
    expect_equal(found, bare_loop(scene, options.inputs), "seed " + std::to_string(seed));
    EXPECT_GT(found.result.events.stragglers, alone + 10);
    jumps += found.result.events.jumps;
  }
  EXPECT_GT(jumps, 0u);
}

TEST(UserInput, OnTheVirtualClusterGivesTheBitsOfTheBareLoop) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const test::Scene scene = stack_and_sliders(seed);
    RunOptions options{.executor = ExecutorKind::kVirtual,
                       .steps = kSteps,
                       .buffer = 8,
                       .inputs = random_inputs(scene, seed)};
    options.inputs.at_the_last_moment = seed % 2 == 0;
    options.cluster.processors = 5;
    options.cluster.jitter_ns = 20'000;
    options.cluster.check_purity = seed == 4;
    for (const auto how :
         {kernel::Synchronisation::kOptimistic, kernel::Synchronisation::kLockstep}) {
      options.synchronisation = how;
      expect_equal(simulated(scene, 16, options), bare_loop(scene, options.inputs),
                   "seed " + std::to_string(seed));
    }
  }
}

TEST(UserInput, ReachesTheWorldsOfAllRanks) {
  const test::Scene scene = stack_and_sliders(5);
  RunOptions options{.executor = ExecutorKind::kMpi,
                     .threads = 1,
                     .steps = kSteps,
                     .buffer = 8,
                     .inputs = random_inputs(scene, 5)};
  const Outcome expected = bare_loop(scene, options.inputs);
  for (const bool late : {false, true}) {
    options.inputs.at_the_last_moment = late;
    kernel::RankThreads network(3, 7);
    std::vector<Outcome> outcomes(3);
    {
      std::vector<std::jthread> ranks;
      for (std::uint32_t rank = 0; rank < 3; ++rank)
        ranks.emplace_back([&, rank] {
          RunOptions own = options;
          own.transport = &network.end(rank);
          outcomes[rank] = simulated(scene, 12, own);
        });
    }
    expect_equal(outcomes[0], expected, late ? "late" : "early");
    EXPECT_TRUE(outcomes[1].inputs.empty());
  }
}

// Offered as steps are committed: the stamps are another matter in each run, but they are logged,
// and a script of the log gives the same steps.
TEST(UserInput, ThatCameWhileTheRunWentOnIsRepeatedFromItsLog) {
  const test::Scene scene = stack_and_sliders(6);
  for (const std::uint32_t worlds : {1u, 2u, 8u}) {
    LiveInputs live;
    test::Choices choices(6);
    std::uint32_t next_id = 0;
    const auto offer = [&](std::int64_t step) {
      UserInput input = random_input(next_id++, scene, choices);
      input.step = step;
      live.offer(input);
    };
    const Outcome found = simulated(scene, worlds,
                                    {.executor = ExecutorKind::kThreads,
                                     .threads = 2,
                                     .steps = kSteps,
                                     .buffer = 6,
                                     .inputs = {.absent = kAbsent, .script = {}, .live = &live}},
                                    [&](std::int64_t step) {
                                      offer(-1);
                                      offer(step / 2);
                                      offer(step + 5);
                                    });
    InputOptions logged{.absent = kAbsent, .script = {}};
    std::size_t moved = 0;
    for (const CommittedInput& committed : found.inputs) {
      EXPECT_LE(committed.asked_step, committed.input.step);
      moved += committed.asked_step >= 0 && committed.asked_step < committed.input.step;
      logged.script.push_back(committed.input);
    }
    EXPECT_GT(moved, 0u);
    EXPECT_LT(logged.script.size(), next_id);
    EXPECT_GT(found.result.inputs_too_late, 0u);
    expect_equal(found, bare_loop(scene, logged), "from the log");
  }
}

TEST(UserInput, WithoutEffectIsTold) {
  const test::Scene scene = stack_and_sliders(1);
  InputOptions inputs{.absent = {BodyId{14}}, .script = {}};
  const auto add = [&](InputKind kind, std::uint32_t body, std::int64_t step) {
    UserInput input;
    input.id = static_cast<std::uint32_t>(inputs.script.size());
    input.kind = kind;
    input.body = BodyId{body};
    input.step = step;
    inputs.script.push_back(input);
  };
  add(InputKind::kPush, 14, 2);           // absent
  add(InputKind::kAdd, 14, 3);            // comes
  add(InputKind::kPush, 14, 3);           // is there, for it came with a lower id
  add(InputKind::kAdd, 3, 4);             // is there already
  add(InputKind::kRemove, 3, 5);          // goes
  add(InputKind::kRemove, 3, 5);          // has gone
  add(InputKind::kSetVelocity, 3, 6);     // is not there
  add(InputKind::kChangeMaterial, 3, 6);  // has an effect later
  const Outcome found = simulated(scene, 8, {.steps = kSteps, .inputs = inputs});
  std::vector<bool> effects;
  for (const CommittedInput& committed : found.inputs) effects.push_back(committed.had_effect);
  EXPECT_EQ(effects, (std::vector<bool>{false, true, true, false, true, false, false, true}));
  EXPECT_EQ(found.result.final_ids.size(), scene.states.size() - 1);
}

// What was known of the box at rest was found with its old friction.
TEST(UserInput, ABoxAtRestOnASlopeSlidesOnceItIsMadeSmooth) {
  test::Scene scene(Vec3(3.0, 0, -9.81));
  scene.ground();
  scene.body(scene.shape(physics::Box{}), Vec3(0.2, 0.2, 0.5)).linear_velocity_m_s = Vec3::Zero();
  InputOptions inputs;
  UserInput input;
  input.kind = InputKind::kChangeMaterial;
  input.body = BodyId{0};
  input.step = kSteps / 2;
  input.material = {0.0, 0.0};
  inputs.script.push_back(input);
  const Outcome expected = bare_loop(scene, inputs);
  for (const std::uint32_t worlds : {1u, 8u}) {
    const Outcome found = simulated(scene, worlds, {.steps = kSteps, .inputs = inputs});
    expect_equal(found, expected, std::to_string(worlds) + " worlds");
    EXPECT_GT(found.result.stages.islands_at_rest, 0u);
    EXPECT_GT(found.result.final_states.front().linear_velocity_m_s.x(), 0.1);
  }
}

TEST(UserInput, ComesBackFromItsEncoding) {
  const test::Scene scene = stack_and_sliders(1);
  test::Choices choices(2);
  for (std::uint32_t id = 0; id < 20; ++id) {
    const UserInput input = random_input(id, scene, choices);
    const kernel::Payload payload = encode_input(input);
    EXPECT_EQ(encode_input(decode_input(payload.bytes())), payload);
  }
  for (const UserInput& input : motor_inputs(3).script) {
    const UserInput back = decode_input(encode_input(input).bytes());
    EXPECT_EQ(back.motor_speed, input.motor_speed);
    EXPECT_EQ(back.motor_push, input.motor_push);
    EXPECT_EQ(back.motor_target, input.motor_target);
  }
}

TEST(UserInput, APushOffTheCentreTurnsTheBody) {
  test::Scene scene;
  const BodyState& state = scene.body(scene.shape(physics::Sphere{0.5}), Vec3::Zero());
  const physics::BodyParams& params = scene.description.bodies[0];
  UserInput input;
  input.kind = InputKind::kPush;
  input.impulse_newton_s = Vec3(0, params.mass_kg, 0);
  input.point_local_m = Vec3(0.5, 0, 0);
  std::vector<BodyId> ids{BodyId{0}};
  EXPECT_TRUE(act_on_bodies(input, scene.description, ids, scene.states));
  EXPECT_EQ(state.linear_velocity_m_s, Vec3(0, 1, 0));
  // m v r / (2/5 m r^2) = 5 v / (2 r)
  EXPECT_NEAR(state.angular_velocity_rad_s.z(), 5.0, 1e-12);
}

}  // namespace
}  // namespace soda::models
