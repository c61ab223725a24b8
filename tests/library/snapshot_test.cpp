// Snapshots: going on bit for bit, and what cannot be restored.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>

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

void set_checksum(Snapshot& forged) {
  constexpr std::size_t kChecksum = 16, kHead = 24;
  const std::uint64_t checksum =
      XXH3_64bits(forged.bytes.data() + kHead, forged.bytes.size() - kHead);
  std::memcpy(&forged.bytes[kChecksum], &checksum, sizeof checksum);
}

TEST(LibrarySnapshot, OnlyABodysOwnJointsCanBeBroken) {
  SceneParts parts;
  parts.name = "hangs";
  parts.time_step_s = 1.0 / 60.0;
  parts.steps = 60;
  parts.materials = {{.name = "wood"}};
  parts.bodies = {{.id = 1, .shape = Sphere{0.1}, .material = "wood", .mass_kg = 5.0}};
  parts.joints = {{.id = 7,
                   .kind = JointKind::kBall,
                   .body = 1,
                   .anchor_m = {0.0, 0.0, 1.0},
                   .break_force_newton = 1.0}};
  Simulation simulation(Scene::build(parts));
  simulation.step(3);
  ASSERT_EQ(simulation.broken_joints(), (std::vector<std::uint32_t>{7}));
  Snapshot forged = simulation.snapshot();
  const std::size_t label = 24 + 8 + 4 + 4 + 8 * 13 + 4 + 4;
  ASSERT_EQ(forged.bytes[label], std::byte{7});
  forged.bytes[label] = std::byte{8};
  set_checksum(forged);
  EXPECT_THROW(simulation.restore(forged), UsageError);
}

// As somebody writes them who knows the format: any number may be anything, the checksum is right.
TEST(LibrarySnapshot, ForgedOnesAreRefusedOrGoOn) {
  constexpr std::size_t kHead = 24, kNumber = 4;
  Simulation simulation(arena());
  simulation.apply({1, 90, Push{.body = kBall, .impulse_newton_s = {0.0, 2.0, 0.0}}});
  simulation.step(60);
  const Snapshot whole = simulation.snapshot();
  const std::uint64_t digest = simulation.digest();
  int refused = 0, gone_on = 0, failed = 0;
  const auto try_with = [&](std::size_t at, const std::vector<std::uint32_t>& numbers) {
    Snapshot forged = whole;
    std::memcpy(&forged.bytes[at], numbers.data(),
                std::min(kNumber * numbers.size(), forged.bytes.size() - at));
    set_checksum(forged);
    try {
      simulation.restore(forged);
      simulation.step(2);
      ++gone_on;
    } catch (const UsageError&) {
      ++refused;
    } catch (const NumericalError&) {
      ++failed;
    }
  };
  for (std::size_t at = kHead; at + kNumber <= whole.bytes.size(); at += kNumber)
    for (const std::vector<std::uint32_t>& numbers : {std::vector<std::uint32_t>{0},
                                                      {1},
                                                      {0xffffffff},
                                                      {0x7fffffff},
                                                      {0, 0x7fe00000},
                                                      {0, 0xbff00000},
                                                      {0xffffffff, 0x7fffffff}})
      try_with(at, numbers);
  EXPECT_GT(refused, 1000);
  EXPECT_GT(gone_on, 1000);
  simulation.restore(whole);
  EXPECT_EQ(simulation.digest(), digest);
}

}  // namespace
}  // namespace soda
