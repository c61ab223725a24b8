#include "scenarios/generators.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <map>

#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

// A scenario of one generator of unit boxes (or of `shape`), without anything else.
std::string generator_scene(const std::string& fields,
                            const std::string& shape = R"({"type": "box", "size_m": [1, 1, 1]})") {
  return R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 0,
             "materials": [{"name": "m", "friction": 0, "restitution": 0}],
             "generators": [{"first_id": 5, "mass_kg": 1, "material": "m", "shape": )" +
         shape + ", " + fields + "}]}";
}

std::vector<physics::BodyState> states(const std::string& fields,
                                       std::optional<std::uint64_t> seed = {}) {
  return read_scenario_text(generator_scene(fields), "a.json", seed).initial;
}

// FNV-1a over the bits of all fields, in order of ids.
std::uint64_t digest_of(const std::vector<physics::BodyState>& bodies) {
  std::uint64_t hash = 0xCBF29CE484222325u;
  const auto add = [&](double value) {
    std::uint64_t bits = std::bit_cast<std::uint64_t>(value);
    for (int i = 0; i < 8; ++i, bits >>= 8) hash = (hash ^ (bits & 0xFF)) * 0x100000001B3u;
  };
  for (const physics::BodyState& b : bodies) {
    for (int i = 0; i < 3; ++i) add(b.position_m[i]);
    for (const double c :
         {b.orientation.w(), b.orientation.x(), b.orientation.y(), b.orientation.z()}) {
      add(c);
    }
    for (int i = 0; i < 3; ++i) add(b.linear_velocity_m_s[i]);
    for (int i = 0; i < 3; ++i) add(b.angular_velocity_rad_s[i]);
  }
  return hash;
}

TEST(RandomStreamOfASeed, IsSplitMix64) {
  // First outputs for the seed 1234567, as published with the algorithm.
  RandomStream stream{1234567};
  EXPECT_EQ(next_bits(stream), 6457827717110365317u);
  EXPECT_EQ(next_bits(stream), 3203168211198807973u);
  EXPECT_EQ(next_bits(stream), 9817491932198370423u);
}

TEST(RandomRotations, HaveUnitNormAndNoPreferredDirection) {
  RandomStream stream = make_stream(3, 4);
  physics::Vec3 sum = physics::Vec3::Zero();
  constexpr int kDraws = 20'000;
  for (int i = 0; i < kDraws; ++i) {
    const physics::Quat q = uniform_rotation(stream);
    ASSERT_NEAR(q.norm(), 1.0, 1e-14);
    sum += q._transformVector(physics::Vec3::UnitX());
  }
  // Each component of the mean has deviation sqrt(1/3/n) = 0.0041: five of them.
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(sum[i] / kDraws), 0.021);
}

TEST(GridGenerator, RunsAlongXFirst) {
  const auto bodies = states(
      R"("type": "grid", "count": [2, 3, 2], "spacing_m": [1, 10, 100],
         "position_m": [0.5, 0, 0])");
  ASSERT_EQ(bodies.size(), 12u);
  EXPECT_EQ(bodies[0].position_m, Vec3(0.5, 0.0, 0.0));
  EXPECT_EQ(bodies[1].position_m, Vec3(1.5, 0.0, 0.0));
  EXPECT_EQ(bodies[2].position_m, Vec3(0.5, 10.0, 0.0));
  EXPECT_EQ(bodies[11].position_m, Vec3(1.5, 20.0, 100.0));
}

TEST(StackGenerator, LetsBodiesTouch) {
  const auto bodies = states(R"("type": "stack", "count": 3, "position_m": [0, 0, 0.5])");
  ASSERT_EQ(bodies.size(), 3u);
  EXPECT_EQ(bodies[2].position_m, Vec3(0.0, 0.0, 2.5));
}

TEST(PyramidGenerator, PutsEachBodyBetweenTwoOfTheRowBelow) {
  const auto bodies =
      states(R"("type": "pyramid", "rows": 3, "side_gap_m": 0.5, "position_m": [0, 0, 0.5])");
  ASSERT_EQ(bodies.size(), 6u);
  EXPECT_EQ(bodies[2].position_m, Vec3(3.0, 0.0, 0.5));
  EXPECT_EQ(bodies[3].position_m, Vec3(0.75, 0.0, 1.5));
  EXPECT_EQ(bodies[5].position_m, Vec3(1.5, 0.0, 2.5));
}

TEST(ChainGenerator, RunsAlongItsAxisWithBodiesTouching) {
  const std::string text =
      generator_scene(R"("type": "chain", "count": 3, "axis": "z", "position_m": [0, 0, 0])",
                      R"({"type": "capsule", "radius_m": 0.25, "length_m": 1})");
  const auto bodies = read_scenario_text(text, "a.json").initial;
  ASSERT_EQ(bodies.size(), 3u);
  EXPECT_EQ(bodies[2].position_m, Vec3(0.0, 0.0, 3.0));
}

constexpr const char* kGas =
    R"("type": "gas", "count": 300, "seed": 9, "region_min_m": [-9, -9, -9],
       "region_max_m": [9, 9, 9], "min_gap_m": 0.01, "max_speed_m_s": 3, "max_spin_rad_s": 2)";

TEST(GasGenerator, PlacesBodiesApartInsideTheRegionWithinTheSpeeds) {
  const auto bodies = states(kGas);
  ASSERT_EQ(bodies.size(), 300u);
  const double least = std::sqrt(3.0) + 0.01;  // twice the bounding radius of a unit box
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    EXPECT_LE(bodies[i].position_m.cwiseAbs().maxCoeff(), 9.0);
    EXPECT_LE(bodies[i].linear_velocity_m_s.norm(), 3.0);
    EXPECT_LE(bodies[i].angular_velocity_rad_s.norm(), 2.0);
    for (std::size_t j = 0; j < i; ++j) {
      ASSERT_GE((bodies[i].position_m - bodies[j].position_m).norm(), least * (1.0 - 1e-15));
    }
  }
}

TEST(GasGenerator, DependsOnTheSeedAndOnTheFirstId) {
  const auto first = digest_of(states(kGas));
  EXPECT_EQ(digest_of(states(kGas)), first);
  EXPECT_EQ(digest_of(states(kGas, 9)), first);
  EXPECT_NE(digest_of(states(kGas, 10)), first);
  const std::string other = replaced(generator_scene(kGas), "\"first_id\": 5", "\"first_id\": 6");
  EXPECT_NE(digest_of(read_scenario_text(other, "a.json").initial), first);
}

TEST(RandomGenerator, KeepsClearOfBodiesFurtherUpWhateverTheirSize) {
  for (const char* radius : {"0.001", "0.7", "6"}) {
    const std::string first =
        R"("generators": [{"type": "grid", "first_id": 1000, "mass_kg": 1, "material": "m",
            "shape": {"type": "sphere", "radius_m": )" +
        std::string(radius) +
        R"(}, "count": [2, 1, 1], "spacing_m": [14, 0, 0], "position_m": [-7, 0, 0]}, )";
    const std::string text = replaced(generator_scene(R"("type": "random", "count": 200, "seed": 1,
                           "region_min_m": [-9, -9, -9], "region_max_m": [9, 9, 9])"),
                                      "\"generators\": [", first);
    const Scenario scenario = read_scenario_text(text, "a.json");
    ASSERT_EQ(scenario.initial.size(), 202u);
    const double least = std::stod(radius) + 0.5 * std::sqrt(3.0);
    for (std::size_t i = 0; i < 200; ++i) {
      for (std::size_t j = 200; j < 202; ++j) {
        const double distance =
            (scenario.initial[i].position_m - scenario.initial[j].position_m).norm();
        ASSERT_GE(distance, least * (1.0 - 1e-15)) << radius;
      }
    }
  }
}

// Stored digests: the library's starting states must be the same bits on every machine, compiler
// and optimisation level.
TEST(LibraryStates, AreTheStoredBits) {
  const std::map<std::string, std::uint64_t> stored = {
      {"big-body", 0x81e554bff91d17d1u},
      {"billiards", 0xb2b7caba828a50f5u},
      {"bin-1000", 0x7b367e61e1a3023du},
      {"border-stack", 0x6162be1876413164u},
      {"breaking-bridge", 0xfe9b2432c013d70bu},
      {"crowd", 0xfa7b945695cf8e21u},
      {"detection-only", 0x6885ac246c12ab3bu},
      {"eight-corner", 0x5c6e310c27913e2eu},
      {"factory-line", 0x444c560a9bc46cd1u},
      {"fast-crosser", 0x48c8607874c075au},
      {"five-worlds-chain", 0x3b56243f5fff8bf9u},
      {"mill", 0xdeb7701fe9a79bd3u},
      {"mixed-shapes", 0x218fa851e93b661au},
      {"pyramid", 0x4f1b4274bfb6ddeeu},
      {"ragdolls", 0x84af93aff7c405ddu},
      {"robot-arm", 0x283c0845eb71921au},
      {"rope-bridge", 0x7aec1aadaf531f22u},
      {"sparse-10000", 0x5a5bdd7936a350u},
      {"spheres-frictionless", 0x5d100c46196920b6u},
      {"spring-sleds", 0x4239cbad26b7d0bdu},
      {"third-world", 0x471b561d07ea46d9u},
      {"twelve-worlds", 0x807207d07af09eaeu},
      {"twelve-worlds-blocks", 0x807207d07af09eaeu},
      {"twelve-worlds-piles", 0xd0d773fa24f9ed24u},
      {"user-input", 0x4c97f3a4aadcab4fu},
      {"wrecking-balls", 0xa9ae569c9bfee866u},
  };
  for (const auto& file : library_files()) {
    const Scenario scenario = read_scenario_file(file.string());
    const auto at = stored.find(scenario.name);
    const std::uint64_t digest = digest_of(scenario.initial);
    EXPECT_EQ(at == stored.end() ? 0u : at->second, digest)
        << "{\"" << scenario.name << "\", 0x" << std::hex << digest << "u},";
  }
  EXPECT_EQ(library_files().size(), stored.size());
}

}  // namespace
}  // namespace soda::scenarios
