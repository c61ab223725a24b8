// Ghosts that have not come are extrapolated: what extrapolation is, what it costs, and that it
// decides nothing.
#include "models/ghosts/extrapolated_ghosts.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "models/ghosts/extrapolation_audit.hpp"
#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "physics/step/step.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

constexpr WorldId kWest{0}, kEast{1};

// Two worlds that meet at x = 0.
TerritoryMap halves() { return {Grid{Vec3(-16, -8, -8), 16.0, {2, 1, 1}}, 2, {kWest, kEast}}; }

// As models/run/simulation.cpp makes it.
Rules rules_of(const test::Scene& scene) {
  return {std::make_shared<TerritoryMap>(halves()),
          std::make_shared<physics::SceneDescription>(scene.description),
          std::make_shared<InputAccount>(InputAccount{Presence({}), {}})};
}

// A long box that spins beside the border, in the east, falls, and has a drive.
test::Scene spinning_scene() {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.description.drives.push_back({.velocity_m_s = Vec3(0, 2, 0), .lane = {}});
  scene.body(scene.shape(physics::Box{Vec3(0.6, 0.2, 0.1)}), Vec3(0.4, 0, 4), Vec3(0.1, 1, 2));
  scene.description.bodies.back().drive = 0;
  scene.states.back().angular_velocity_rad_s = Vec3(1, 3, -2);
  return scene;
}

Ghost ghost_of(const test::Scene& scene, std::uint32_t body, const BodyState& state,
               WorldId owner) {
  const physics::Geometry geometry(scene.description);
  std::vector<physics::Aabb> boxes;
  physics::StageCounters counters;
  const BodyId id{body};
  physics::compute_boxes(scene.description, geometry, {&id, 1}, {&state, 1}, boxes, counters);
  return {id, owner, boxes.front(), state};
}

std::vector<Ghost> extrapolate(GhostMode mode, const test::Scene& scene, const ForeignView& before,
                               std::vector<WorldId> told = {}) {
  const physics::Geometry geometry(scene.description);
  physics::StageCounters counters;
  return extrapolate_ghosts(mode, rules_of(scene), geometry, {kWest, told}, before, counters);
}

TEST(ExtrapolatedGhosts, AFreeBodyIsPredictedBitForBitOverManySteps) {
  const test::Scene scene = spinning_scene();
  const physics::Geometry geometry(scene.description);
  std::vector<BodyState> truth = scene.states;
  const BodyId id{0};
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  ForeignView view;
  view.bodies_sent_to = {kEast};
  view.received.ghosts = {ghost_of(scene, 0, truth[0], kEast)};
  for (int step = 0; step < 20; ++step) {
    physics::step(scene.description, geometry, {&id, 1}, truth, {scratch, report, counters});
    view.received.ghosts = extrapolate(GhostMode::kPredicted, scene, view);
    ASSERT_EQ(view.received.ghosts.size(), 1u) << step;
    EXPECT_TRUE(identical(view.received.ghosts[0], ghost_of(scene, 0, truth[0], kEast))) << step;
  }
}

TEST(ExtrapolatedGhosts, DeadReckoningKeepsVelocityAndSpin) {
  const test::Scene scene = spinning_scene();
  ForeignView view;
  view.bodies_sent_to = {kEast};
  view.received.ghosts = {ghost_of(scene, 0, scene.states[0], kEast)};
  const std::vector<Ghost> extrapolated = extrapolate(GhostMode::kDeadReckoning, scene, view);
  ASSERT_EQ(extrapolated.size(), 1u);
  const BodyState& before = scene.states[0];
  const BodyState& after = extrapolated[0].state;
  const Vec3 moved = before.position_m + before.linear_velocity_m_s * scene.description.dt_s;
  EXPECT_EQ(after.position_m, moved);
  EXPECT_EQ(after.linear_velocity_m_s, before.linear_velocity_m_s);
  EXPECT_EQ(after.angular_velocity_rad_s, before.angular_velocity_rad_s);
  // |w| dt, to the accuracy of arcsin by its argument
  const double angle = before.angular_velocity_rad_s.norm() * scene.description.dt_s;
  const double half_sine = (after.orientation * before.orientation.conjugate()).vec().norm();
  EXPECT_NEAR(2.0 * half_sine, angle, angle * angle * angle);
}

TEST(ExtrapolatedGhosts, ABodyThatSomethingCarriesIsNotPredictedToFall) {
  const test::Scene scene = spinning_scene();
  ForeignView view;
  view.bodies_sent_to = {kEast};
  view.received.ghosts = {ghost_of(scene, 0, scene.states[0], kEast)};
  view.received.ghosts[0].state.impulses.push_back(
      {.other = physics::static_id(0), .normal_newton_s = 1});
  const std::vector<Ghost> extrapolated = extrapolate(GhostMode::kPredicted, scene, view);
  ASSERT_EQ(extrapolated.size(), 1u);
  EXPECT_EQ(extrapolated[0].state.linear_velocity_m_s, scene.states[0].linear_velocity_m_s);
  EXPECT_EQ(extrapolated[0].state.impulses.size(), 1u);
}

TEST(ExtrapolatedGhosts, NothingIsExtrapolatedOfAWorldThatHasSpokenOrWillNotSpeak) {
  const test::Scene scene = spinning_scene();
  ForeignView view;
  view.bodies_sent_to = {kEast};
  view.received.ghosts = {ghost_of(scene, 0, scene.states[0], kEast)};
  EXPECT_EQ(extrapolate(GhostMode::kPredicted, scene, view).size(), 1u);
  EXPECT_TRUE(extrapolate(GhostMode::kPredicted, scene, view, {kEast}).empty());
  view = {.ghosts_sent_to = {}, .bodies_sent_to = {kEast}, .received = {}, .known = {}};
  view.known = {{BodyId{0}, kEast, scene.states[0]}};
  EXPECT_EQ(extrapolate(GhostMode::kPredicted, scene, view).size(), 1u);
  view.bodies_sent_to = {WorldId{2}};
  EXPECT_TRUE(extrapolate(GhostMode::kPredicted, scene, view).empty());
}

TEST(ExtrapolatedGhosts, ABodyThatWillHaveComeOrGoneIsNotExtrapolated) {
  test::Scene scene;
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  scene.body(ball, Vec3(0.01, 0, 0), Vec3(-6, 0, 0));  // into the west: 0.1 m a step
  scene.body(ball, Vec3(0.2, 2, 0), Vec3(12, 0, 0));   // its box leaves the west
  scene.body(ball, Vec3(-0.01, -2, 0));                // has left the west: its state is known
  ForeignView view;
  view.bodies_sent_to = {kEast};
  for (const std::uint32_t body : {0u, 1u})
    view.received.ghosts.push_back(ghost_of(scene, body, scene.states[body], kEast));
  EXPECT_TRUE(extrapolate(GhostMode::kPredicted, scene, view).empty());
  scene.states[2].position_m.x() = 0.01;
  view.known = {{BodyId{2}, kEast, scene.states[2]}};
  const std::vector<Ghost> extrapolated = extrapolate(GhostMode::kPredicted, scene, view);
  ASSERT_EQ(extrapolated.size(), 1u);
  EXPECT_TRUE(identical(extrapolated[0], ghost_of(scene, 2, scene.states[2], kEast)));
}

TEST(ForeignGhosts, OfOneBodyInTheHandsOfManyTheLowestOwnersStaysAndNoOwnBody) {
  const auto ghost = [](std::uint32_t id, std::uint32_t owner) {
    return Ghost{BodyId{id}, WorldId{owner}, {}, {}};
  };
  const std::vector<Ghost> usable = foreign_ghosts(
      {ghost(5, 1), ghost(3, 1), ghost(0, 1), ghost(0, 7), ghost(0, 9), ghost(0, 10), ghost(5, 10)},
      [](BodyId id) { return id == BodyId{3}; });
  ASSERT_EQ(usable.size(), 2u);
  for (const std::size_t place : {0u, 1u}) {
    EXPECT_EQ(usable[place].id, BodyId{place == 0 ? 0u : 5u});
    EXPECT_EQ(usable[place].owner, WorldId{1});
  }
}

TEST(ExtrapolatedGhosts, AnAbsurdExtrapolationStaysWhereItWas) {
  test::Scene scene;
  scene.body(scene.shape(physics::Sphere{0.25}), Vec3(0.1, 0, 0), Vec3(0, 0, 1e300));
  ForeignView view;
  view.bodies_sent_to = {kEast};
  view.received.ghosts = {{BodyId{0}, kEast, {Vec3(-1, -1, -1), Vec3(1, 1, 1)}, scene.states[0]}};
  for (const GhostMode mode : {GhostMode::kDeadReckoning, GhostMode::kPredicted}) {
    const std::vector<Ghost> extrapolated = extrapolate(mode, scene, view);
    ASSERT_EQ(extrapolated.size(), 1u);
    EXPECT_EQ(extrapolated[0].state.position_m, Vec3(0.1, 0, 0));
  }
}

TEST(ExtrapolationAudit, CountsWhatCameOfExtrapolationsAndOfContacts) {
  const test::Scene scene = spinning_scene();
  const Ghost right = ghost_of(scene, 0, scene.states[0], kEast);
  Ghost wrong = right;
  wrong.state.position_m.x() += 1e-9;
  ExtrapolationAudit audit;
  WorldCounters counters;
  audit.note_extrapolated(3, kEast, {&right, 1});
  audit.note_news(3, kEast, {&right, 1}, counters);
  audit.note_news(3, kEast, {&right, 1}, counters);  // executed again: counted already
  audit.note_extrapolated(4, kEast, {&wrong, 1});
  audit.note_news(4, kEast, {&right, 1}, counters);
  EXPECT_EQ(counters.guesses_answered, 2u);
  EXPECT_EQ(counters.guesses_confirmed, 1u);
  EXPECT_EQ(counters.ghosts_confirmed, 1u);

  const RecordKey a{BodyId{0}, BodyId{1}}, b{BodyId{0}, BodyId{2}}, c{BodyId{1}, BodyId{2}};
  audit.note_contacts(5, {a, b});
  audit.note_contacts(5, {b, c});
  audit.commit(4, counters);
  EXPECT_EQ(counters.contacts_false + counters.contacts_missed, 0u);
  audit.commit(5, counters);
  audit.commit(6, counters);
  EXPECT_EQ(counters.contacts_false, 1u) << "a";
  EXPECT_EQ(counters.contacts_missed, 1u) << "c";
}

std::uint64_t digest(const test::Scene& scene, const SimulationResult& result) {
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < scene.states.size(); ++i) ids.push_back(BodyId{i});
  return physics::digest(ids, result.final_states);
}

constexpr GhostMode kModes[] = {GhostMode::kReceivedOnly, GhostMode::kDeadReckoning,
                                GhostMode::kPredicted};

// Two balls fall, one 2 cm above the other, the upper one in the west, the lower one in the east:
//
//     west  (o) | .         The west has nothing else to do and runs ahead of the news; the east
//            .  |(o)        has to move a hundred boxes. What it has told of the lower ball, dead
//                           reckoning lets fall too slowly: after n steps by 9.81 (n dt)^2 / 2.
struct FallingPair {
  test::Scene scene{Vec3(0, 0, -9.81)};

  FallingPair() {
    const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
    const std::uint32_t box = scene.shape(physics::Box{Vec3(0.1, 0.1, 0.1)});
    scene.body(ball, Vec3(-0.1, 0, 3.5));
    scene.body(ball, Vec3(0.1, 0, 3.5 - std::sqrt(0.52 * 0.52 - 0.2 * 0.2)));
    for (int i = 0; i < 100; ++i)
      scene.body(box, Vec3(1.2 + 0.3 * (i % 10), -3.2 + 0.3 * (i / 10), -4));
  }

  SimulationResult run(GhostMode ghosts, ExecutorKind executor = ExecutorKind::kVirtual) const {
    return simulate(scene.description, scene.states, halves(),
                    {.executor = executor,
                     .steps = 40,
                     .ghosts = ghosts,
                     .cluster = {.processors = 2, .latency_ns = 100'000}});
  }
};

TEST(GhostModes, DeadReckoningInventsAContactThatSodaAndPredictionDoNot) {
  const FallingPair pair;
  const SimulationResult expected = pair.run(GhostMode::kReceivedOnly, ExecutorKind::kSequential);
  for (const GhostMode mode : kModes) {
    const SimulationResult result = pair.run(mode);
    EXPECT_EQ(digest(pair.scene, result), digest(pair.scene, expected));
    EXPECT_EQ(result.islands_committed, 0u);
    EXPECT_EQ(result.worlds.ghosts_guessed > 0, mode != GhostMode::kReceivedOnly);
    EXPECT_EQ(result.worlds.contacts_false > 0, mode == GhostMode::kDeadReckoning);
    EXPECT_EQ(result.stages.islands_solved > 0, mode == GhostMode::kDeadReckoning);
    EXPECT_EQ(result.worlds.contacts_missed, 0u);
  }
}

TEST(GhostModes, APredictedGhostOfAFreeBodyIsAlwaysConfirmed) {
  const FallingPair pair;
  const WorldCounters predicted = pair.run(GhostMode::kPredicted).worlds;
  EXPECT_GT(predicted.guesses_answered, 10u);
  EXPECT_EQ(predicted.guesses_confirmed, predicted.guesses_answered);
  const WorldCounters reckoned = pair.run(GhostMode::kDeadReckoning).worlds;
  EXPECT_GT(reckoned.guesses_answered, 10u);
  EXPECT_EQ(reckoned.ghosts_confirmed, 0u);
}

// What is extrapolated right restarts nothing, and its late answer is not even extrapolated again:
// one a step, and the first ghost, which nobody expected, sets the extrapolations of the steps
// behind it right.
TEST(GhostModes, AnExtrapolationThatComesTrueCostsNoRestart) {
  const FallingPair pair;
  const SimulationResult predicted = pair.run(GhostMode::kPredicted);
  EXPECT_EQ(predicted.events.rollbacks, 0u);
  EXPECT_EQ(predicted.events.rolled_back, 0u);
  EXPECT_GE(predicted.events.absorbed, 10u);
  EXPECT_LE(predicted.worlds.ghosts_guessed, 50u) << "of 40 steps";
  EXPECT_GT(pair.run(GhostMode::kDeadReckoning).events.rollbacks, 0u);
}

TEST(GhostModes, GiveTheBitsOfTheSequentialRunForAnyScheduleOfThreads) {
  const test::Scene scene = busy_scene(5, 12, 6);
  const std::uint64_t expected =
      digest(scene, simulate(scene.description, scene.states, blocks(1), {.steps = 80}));
  std::uint64_t extrapolated = 0, wrong = 0;
  for (const GhostMode mode : kModes)
    for (const std::uint32_t worlds : {2u, 8u, 64u})
      for (std::uint64_t seed = 0; seed <= 5; ++seed) {
        const SimulationResult result = simulate(
            scene.description, scene.states, blocks(worlds),
            {.executor = ExecutorKind::kThreads,
             .threads = 1 + static_cast<unsigned>(seed % 3),
             .steps = 80,
             .buffer = seed % 2 == 0 ? 3 : 24,
             .scheduling_seed = seed,
             .rollback = seed % 3 == 1 ? RollbackMode::kInvalidate : RollbackMode::kPropagate,
             .gating = seed % 4 < 2,
             .ghosts = mode});
        ASSERT_EQ(digest(scene, result), expected) << worlds << " worlds, seed " << seed;
        extrapolated += result.worlds.ghosts_guessed;
        wrong += result.worlds.guesses_answered - result.worlds.guesses_confirmed;
      }
  EXPECT_GT(extrapolated, 0u);
  EXPECT_GT(wrong, 0u) << "all extrapolations were right: nothing was proved";
}

TEST(GhostModes, StayPureFunctionsOnTheVirtualCluster) {
  const test::Scene scene = busy_scene(6, 12, 6);
  const std::uint64_t expected =
      digest(scene, simulate(scene.description, scene.states, blocks(1), {.steps = 40}));
  for (const GhostMode mode : kModes)
    for (const bool gating : {false, true})
      for (const std::int64_t latency_ns : {1'000, 100'000}) {
        const SimulationResult result = simulate(scene.description, scene.states, blocks(6),
                                                 {.executor = ExecutorKind::kVirtual,
                                                  .steps = 40,
                                                  .buffer = 12,
                                                  .gating = gating,
                                                  .ghosts = mode,
                                                  .cluster = {.processors = 6,
                                                              .seed = 3,
                                                              .latency_ns = latency_ns,
                                                              .jitter_ns = latency_ns,
                                                              .check_purity = true}});
        ASSERT_EQ(digest(scene, result), expected) << latency_ns << " ns";
        EXPECT_EQ(result.worlds.ghosts_guessed > 0, mode != GhostMode::kReceivedOnly);
      }
}

// In sequence everything has come: nothing is extrapolated, and only the answers are sent besides.
TEST(GhostModes, CostNothingWhereGhostsAreReceivedOnlyOrHaveCome) {
  const test::Scene scene = busy_scene(7);
  std::uint64_t messages_told = 0;
  for (const GhostMode mode : kModes) {
    const SimulationResult result =
        simulate(scene.description, scene.states, blocks(8), {.steps = 60, .ghosts = mode});
    EXPECT_EQ(result.worlds.ghosts_guessed, 0u);
    EXPECT_EQ(result.worlds.contacts_missed + result.worlds.contacts_false, 0u);
    if (mode == GhostMode::kReceivedOnly) messages_told = result.events.messages;
    EXPECT_EQ(result.events.messages > messages_told, mode != GhostMode::kReceivedOnly);
  }
  for (const ExecutorKind executor : {ExecutorKind::kThreads, ExecutorKind::kVirtual}) {
    const SimulationResult told = simulate(scene.description, scene.states, blocks(8),
                                           {.executor = executor,
                                            .threads = 2,
                                            .steps = 60,
                                            .buffer = 8,
                                            .cluster = {.processors = 8}});
    EXPECT_EQ(told.worlds.ghosts_guessed + told.worlds.guesses_answered, 0u);
    EXPECT_EQ(told.worlds.contacts_missed > 0, executor == ExecutorKind::kVirtual);
  }
}

}  // namespace
}  // namespace soda::models
