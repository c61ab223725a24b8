// Snapshots: going on bit for bit, and what cannot be restored.
#include <gtest/gtest.h>

#include "library/arena.hpp"
#include "soda/simulation.hpp"

namespace soda {
namespace {

using namespace library_test;

TEST(LibrarySnapshot, ARestoredSimulationGoesOnBitForBit) {
  for (const char* const name : {"user-input", "breaking-bridge", "ragdolls", "mixed-shapes"}) {
    const Scene scene =
        Scene::load(std::string(SODA_SOURCE_DIR "/scenarios/library/") + name + ".json");
    Simulation straight(scene), other(scene);
    straight.step(25);
    const Snapshot then = straight.snapshot();
    straight.step(25);
    other.step(3);  // whatever it did before
    other.restore(then);
    EXPECT_EQ(other.steps(), 25);
    other.step(25);
    EXPECT_EQ(other.digest(), straight.digest()) << name;
    straight.restore(then);
    straight.step(25);
    EXPECT_EQ(other.digest(), straight.digest()) << name;
  }
}

TEST(LibrarySnapshot, GoingBackOverInputsTakesThemBack) {
  Simulation simulation(arena()), straight(arena());
  const Snapshot start = simulation.snapshot();
  simulation.apply({1, 0, AddBody{.body = kWaiting}});
  simulation.apply({2, 1, ChangeMaterial{.body = kBall, .friction = 0.9, .restitution = 0.1}});
  simulation.apply({3, 2, SetMotor{.joint = kHinge, .speed = -2.0}});
  simulation.apply({4, 3, RemoveBody{.body = kFirstBox}});
  simulation.step(10);
  simulation.restore(start);
  EXPECT_FALSE(simulation.has(kWaiting));
  EXPECT_TRUE(simulation.has(kFirstBox));
  simulation.step(90);
  straight.step(90);
  EXPECT_EQ(simulation.digest(), straight.digest());
}

TEST(LibrarySnapshot, HoldsChangesAndInputsToCome) {
  Simulation simulation(arena());
  simulation.apply({1, 0, ChangeMaterial{.body = kBall, .friction = 0.9, .restitution = 0.8}});
  simulation.apply({2, 0, SetMotor{.joint = kSlider, .speed = -0.3}});
  simulation.apply({3, 0, RemoveBody{.body = kFirstBox + 2}});
  simulation.apply({4, 20, Push{.body = kBall, .impulse_newton_s = {0.0, 2.0, 0.0}}});
  simulation.step(10);
  Simulation other(arena());
  other.restore(simulation.snapshot());
  EXPECT_EQ(other.body_ids().size(), simulation.body_ids().size());
  simulation.step(50);
  other.step(50);
  EXPECT_EQ(simulation.digest(), other.digest());
  EXPECT_EQ(simulation.snapshot().bytes, other.snapshot().bytes);
}

TEST(LibrarySnapshot, TakesNoMoreThanStatesAndImpulses) {
  Simulation simulation(arena());
  const std::size_t before = simulation.snapshot().bytes.size();
  EXPECT_LT(before, 60 + 120 * simulation.body_ids().size());
  simulation.step(60);
  EXPECT_GT(simulation.snapshot().bytes.size(), before) << "impulses of contacts";
}

TEST(LibrarySnapshot, OfAnotherSceneIsRefused) {
  SceneParts parts = arena_parts();
  parts.bodies[0].mass_kg = 2.0;
  Simulation simulation(arena()), other(Scene::build(parts));
  EXPECT_THROW(other.restore(simulation.snapshot()), UsageError);
}

TEST(LibrarySnapshot, DamagedOnesAreRefusedAndChangeNothing) {
  Simulation simulation(arena());
  simulation.apply({1, 90, Push{.body = kBall, .impulse_newton_s = {0.0, 2.0, 0.0}}});
  simulation.step(60);
  const Snapshot whole = simulation.snapshot();
  const std::uint64_t digest = simulation.digest();
  for (std::size_t size = 0; size < whole.bytes.size(); size += 7) {
    Snapshot cut{{whole.bytes.begin(), whole.bytes.begin() + static_cast<std::ptrdiff_t>(size)}};
    EXPECT_THROW(simulation.restore(cut), UsageError) << size;
  }
  for (std::size_t at = 0; at < whole.bytes.size(); at += 5) {
    Snapshot flipped = whole;
    flipped.bytes[at] ^= std::byte{0x10};
    EXPECT_THROW(simulation.restore(flipped), UsageError) << at;
  }
  EXPECT_EQ(simulation.digest(), digest);
  simulation.restore(whole);
  simulation.step(60);
}

}  // namespace
}  // namespace soda
