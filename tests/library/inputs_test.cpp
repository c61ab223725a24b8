// Inputs: what they do, when, and what may not be said.
#include <gtest/gtest.h>

#include "library/arena.hpp"
#include "soda/run.hpp"
#include "soda/simulation.hpp"

namespace soda {
namespace {

using namespace library_test;

std::vector<Input> one_of_each() {
  return {{1, 2, AddBody{.body = kWaiting, .position_m = Vec3{0.0, 0.0, 3.2}}},
          {2, 5, Push{.body = kBall, .impulse_newton_s = {3.0, 0.0, 0.0}, .point_m = {0, 0, 0.1}}},
          {3, 9, SetVelocity{.body = kLift, .velocity_m_s = Vec3{0.0, 0.0, -0.5}}},
          {4, 9, ChangeMaterial{.body = kBall, .friction = 0.1, .restitution = 0.9}},
          {5, 12, SetMotor{.joint = kHinge, .speed = -1.0}},
          {6, 12, SetMotor{.joint = kSlider, .speed = -0.4, .most_push = 50.0}},
          {7, 30, RemoveBody{.body = kFirstBox + 4}}};
}

TEST(LibraryInputs, EachActsAsInADividedRun) {
  const Scene scene = arena();
  Simulation simulation(scene);
  for (const Input& input : one_of_each()) simulation.apply(input);
  simulation.step(60);
  RunOptions options{.steps = 60, .worlds = 4, .threads = 2};
  options.inputs = one_of_each();
  EXPECT_EQ(simulation.digest(), run(scene, options).digest);
  EXPECT_TRUE(simulation.has(kWaiting));
  EXPECT_FALSE(simulation.has(kFirstBox + 4));
}

TEST(LibraryInputs, EachMatters) {
  const auto all = one_of_each();
  const auto digest_of = [](const std::vector<Input>& inputs) {
    Simulation simulation(arena());
    for (const Input& input : inputs) simulation.apply(input);
    simulation.step(60);
    return simulation.digest();
  };
  const std::uint64_t whole = digest_of(all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<Input> fewer = all;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_NE(digest_of(fewer), whole) << "without input " << all[i].id;
  }
}

TEST(LibraryInputs, LinesOfJsonAreTheSame) {
  Simulation typed(arena()), text(arena());
  typed.step(3);
  text.step(3);
  typed.apply({1, 3, Push{.body = kBall, .impulse_newton_s = {1.0, 2.0, 3.0}}});
  text.apply(R"({"type": "push", "id": 1, "body": 1, "impulse_newton_s": [1, 2, 3]})");
  typed.step();
  text.step();
  EXPECT_EQ(typed.digest(), text.digest());
}

TEST(LibraryInputs, ThoseOfOneStepActInTheOrderOfTheirIds) {
  const auto digest_of = [](std::uint32_t stop, std::uint32_t push) {
    Simulation simulation(arena());
    simulation.apply({stop, 0, SetVelocity{.body = kBall, .velocity_m_s = Vec3{}}});
    simulation.apply({push, 0, Push{.body = kBall, .impulse_newton_s = {1.0, 0.0, 0.0}}});
    simulation.step(2);
    return simulation.digest();
  };
  EXPECT_NE(digest_of(1, 2), digest_of(2, 1));
}

TEST(LibraryInputs, WhatMayNotBeSaidIsAFault) {
  Simulation simulation(arena());
  simulation.step(5);
  EXPECT_THROW(simulation.apply({1, 4, RemoveBody{.body = kBall}}), UsageError);
  EXPECT_THROW(simulation.apply({1, 5, RemoveBody{.body = 99}}), SceneError);
  EXPECT_THROW(simulation.apply({1, 5, RemoveBody{.body = kDoor}}), SceneError);
  EXPECT_THROW(simulation.apply({1, 5, Push{.body = kLift}}), SceneError);
  EXPECT_THROW(simulation.apply({1, 5, SetMotor{.joint = 9, .speed = 1.0}}), SceneError);
  EXPECT_THROW(simulation.apply({1, 5, SetMotor{.joint = kHinge}}), SceneError);
  EXPECT_THROW(simulation.apply("{"), SceneError);
  EXPECT_THROW(simulation.apply(""), SceneError);
  simulation.apply({1, 5, Push{.body = kBall}});
  EXPECT_THROW(simulation.apply({1, 5, Push{.body = kBall}}), UsageError);
  try {
    simulation.apply({2, 5, RemoveBody{.body = 99}});
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_NE(std::string(error.what()).find("/body: found 99, which no body has"),
              std::string::npos)
        << error.what();
  }
}

TEST(LibraryInputs, OnesThatFindTheirBodyAbsentHaveNoEffect) {
  Simulation simulation(arena()), left(arena());
  simulation.apply({1, 0, Push{.body = kWaiting, .impulse_newton_s = {1.0, 0.0, 0.0}}});
  simulation.apply({2, 0, AddBody{.body = kBall}});
  simulation.apply({3, 0, RemoveBody{.body = kWaiting}});
  simulation.step(3);
  left.step(3);
  EXPECT_EQ(simulation.digest(), left.digest());
}

}  // namespace
}  // namespace soda
