// States in a log: as differences, whole, and of single bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/log_writer.hpp"
#include "analysis/event_log/single_states.hpp"
#include "analysis/logged_steps.hpp"
#include "analysis/measures/error_measures.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

using analysis_test::digest_of;
using analysis_test::kLabels;
using analysis_test::logged_step;
using analysis_test::states_at;
using analysis_test::TemporaryFolder;

ByteBuffer difference_of(const LoggedStates& now, const LoggedStates& before) {
  ByteBuffer bytes;
  put_difference(bytes, now.ids, now.states, before, 0.01);
  return bytes;
}

// Whatever is read before it, and with bodies that come and go.
TEST(EventLog, TheStateOfABodyIsReadWithoutTheOthers) {
  const TemporaryFolder folder;
  const std::string file = folder.file("some.sodalog");
  constexpr std::size_t kBodies = 100;
  constexpr std::int64_t kLast = kStatesAWhole + 45;
  std::vector<std::uint32_t> labels(kBodies);
  std::iota(labels.begin(), labels.end(), 1u);
  const auto states_of = [&](std::int64_t step) {
    LoggedStates there;
    for (std::uint32_t i = 0; i < kBodies; ++i) {
      if (i % 7 == 2 && step / 10 % 2 == 1) continue;
      there.ids.push_back(physics::BodyId{i});
      physics::BodyState& state = there.states.emplace_back(states_at(i % 3 == 0 ? step : 0)[1]);
      state.position_m.y() = i;
      if (i % 5 == 0) state.impulses.resize(static_cast<std::size_t>(step) % 2);
      if (i == 11 && step > 20) state.broken_joints = {4};
    }
    return there;
  };
  LogWriter log(file, false);
  log.begin({"9.9", "/somewhere/scene.json", "{ the text }", 0.01}, {}, labels, {});
  for (std::int64_t step = 0; step <= kLast; ++step) {
    const auto [ids, states] = states_of(step);
    log.add_step({step, physics::digest(ids, states), true, ids, states, {}, {}});
  }
  log.finish();
  LogReader reader(file);
  SingleStates single(reader);
  for (std::int64_t at = 0; at < 400; ++at) {
    const std::int64_t step = at * 7919 % (kLast + 1);
    const physics::BodyId id{static_cast<std::uint32_t>(at * 31 % kBodies)};
    const auto [ids, states] = states_of(step);
    const auto found = std::ranges::find(ids, id);
    const std::optional<physics::BodyState> read = single.read(id, step);
    ASSERT_EQ(read.has_value(), found != ids.end()) << step;
    if (read) {
      ASSERT_TRUE(physics::identical(*read, states[static_cast<std::size_t>(found - ids.begin())]))
          << step;
    }
    ASSERT_EQ(single.ids(step), ids);
  }
  const LoggedStates last = reader.read_last_states();
  EXPECT_EQ(physics::digest(last.ids, last.states), reader.read_step(kLast).digest);
}

// Bodies come and go, touch and part; velocities of any size, and what is no number.
TEST(EventLog, DifferencesReadBackBitForBit) {
  LoggedStates before;
  before.ids = all_ids(3);
  before.states = states_at(2);
  LoggedStates now = before;
  now.ids = {physics::BodyId{0}, physics::BodyId{2}, physics::BodyId{7}};
  now.states[1].linear_velocity_m_s.x() = std::numeric_limits<double>::quiet_NaN();
  now.states[1].angular_velocity_rad_s = physics::Vec3(1e300, -1e-310, -0.0);
  now.states[2] = states_at(5)[1];
  now.states[2].broken_joints = {4, 9};
  now.states[2].impulses.push_back({physics::BodyId{0xffffffffu}, 8, ~0u, -0.0, {1.0, 2.0, 3.0}});
  for (const auto& [from, to] : {std::pair(before, now), std::pair(now, before),
                                 std::pair(now, now), std::pair(LoggedStates{}, now)}) {
    const ByteBuffer bytes = difference_of(to, from);
    ByteReader in(bytes);
    const LoggedStates found = decode_difference(in, from, 0.01);
    in.expect_end();
    EXPECT_EQ(found.ids, to.ids);
    ASSERT_EQ(found.states.size(), to.states.size());
    for (std::size_t i = 0; i < to.states.size(); ++i)
      EXPECT_TRUE(physics::identical(found.states[i], to.states[i])) << i;
  }
  EXPECT_LT(difference_of(now, now).size(), 40u);
}

TEST(EventLog, ADamagedDifferenceIsNoDifference) {
  LoggedStates before{all_ids(3), states_at(2)}, now{all_ids(3), states_at(3)};
  const ByteBuffer sound = difference_of(now, before);
  for (std::size_t at = 0; at < sound.size(); ++at)
    for (const unsigned char flip : {0x01, 0x80, 0xff}) {
      ByteBuffer bytes = sound;
      bytes[at] ^= flip;
      bytes.resize(flip == 0x80 ? at : bytes.size());
      ByteReader in(bytes);
      try {
        EXPECT_LE(decode_difference(in, before, 0.01).states.size(), 1000u);
      } catch (const DecodeError&) {
      }
    }
}

// From the whole states before, wherever it was read last.
TEST(EventLog, StepsReadInAnyOrder) {
  const TemporaryFolder folder;
  const std::string file = folder.file("long.sodalog");
  constexpr std::int64_t kLong = 2 * kStatesAWhole + 10;
  LoggedOptions options;
  options.every = 3;
  LogWriter log(file, false);
  log.begin({"9.9", "/somewhere/scene.json", "{ the text }", 0.01}, options, kLabels, {});
  for (std::int64_t step = 0; step <= 3 * kLong; ++step) {
    LoggedStep logged = logged_step(step, digest_of(states_at(step)), states_at(step));
    if (step % 3 != 0) logged = {step, logged.digest, false, {}, {}, {}, {}};
    log.add_step(logged);
  }
  log.finish();
  LogReader reader(file);
  EXPECT_EQ(reader.last_states(), 3 * kLong);
  for (std::int64_t at = 0; at < 60; ++at) {
    const std::int64_t step = at * 7919 % (3 * kLong + 1);
    const LoggedStep found = reader.read_step(step);
    EXPECT_EQ(found.has_states, step % 3 == 0);
    if (found.has_states) {
      EXPECT_EQ(physics::digest(found.ids, found.states), found.digest) << step;
    }
    EXPECT_EQ(found.digest, digest_of(states_at(step)));
  }
}

}  // namespace
}  // namespace soda::analysis
