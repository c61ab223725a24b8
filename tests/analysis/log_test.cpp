#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/log_writer.hpp"
#include "analysis/event_log/step_comparison.hpp"
#include "analysis/logged_steps.hpp"
#include "analysis/measures/error_measures.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using analysis_test::digest_of;
using analysis_test::kLabels;
using analysis_test::logged_step;
using analysis_test::read_file;
using analysis_test::states_at;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;

constexpr std::int64_t kSteps = 6;
const std::vector<scenarios::MeshFile> kMeshes = {{"a.obj", "v 0 0 0"}, {"b/c.stl", {0, 1, 2}}};

void write_log(const std::string& file) {
  Overrides overrides;
  overrides.worlds = 12;
  overrides.executor = models::ExecutorKind::kThreads;
  LogWriter log(file, false);
  log.begin({"9.9", "/somewhere/scene.json", "{ the text }"}, {overrides, 0}, kLabels, kMeshes);
  for (std::int64_t step = 0; step <= kSteps; ++step) {
    log.add_step(logged_step(step, digest_of(states_at(step)), states_at(step)));
  }
  log.finish();
}

TEST(EventLog, ReadsBackEveryBitThatWasWritten) {
  const TemporaryFolder folder;
  const std::string file = folder.file("a.sodalog");
  write_log(file);
  LogReader log(file);
  EXPECT_TRUE(log.complete());
  EXPECT_EQ(log.cut(), "");
  EXPECT_EQ(log.damage(), "");
  EXPECT_EQ(log.last_step(), kSteps);
  EXPECT_EQ(log.labels(), kLabels);
  EXPECT_EQ(log.scenario().program_version, "9.9");
  EXPECT_EQ(log.scenario().file, "/somewhere/scene.json");
  EXPECT_EQ(log.scenario().text, "{ the text }");
  EXPECT_EQ(log.options().overrides.worlds, 12u);
  EXPECT_EQ(log.options().overrides.executor, models::ExecutorKind::kThreads);
  EXPECT_FALSE(log.options().overrides.seed.has_value());
  ASSERT_EQ(log.meshes().size(), kMeshes.size());
  EXPECT_EQ(log.meshes()[1].name, kMeshes[1].name);
  EXPECT_EQ(log.meshes()[1].bytes, kMeshes[1].bytes);
  for (const std::int64_t step : {kSteps, std::int64_t{0}, std::int64_t{3}}) {
    const LoggedStep found = log.read_step(step);
    EXPECT_EQ(found.step, step);
    EXPECT_EQ(found.digest, digest_of(states_at(step)));
    for (std::size_t i = 0; i < kLabels.size(); ++i) {
      EXPECT_TRUE(physics::identical(found.states[i], states_at(step)[i]));
    }
  }
}

// Every possible length: the reader never crashes, keeps every step whose block is whole and says
// that the log is cut.
TEST(EventLog, CutOffAnywhereItIsReadUpToItsLastWholeBlock) {
  const TemporaryFolder folder;
  const std::string whole = folder.file("whole.sodalog");
  const std::string cut = folder.file("cut.sodalog");
  write_log(whole);
  const std::string bytes = read_file(whole);
  std::int64_t last_step = -1;
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    write_file(cut, bytes.substr(0, length));
    try {
      LogReader log(cut);
      ASSERT_NE(log.cut(), "") << length;
      ASSERT_EQ(log.damage(), "") << length;
      ASSERT_FALSE(log.complete());
      ASSERT_GE(log.last_step(), last_step);
      ASSERT_LE(log.last_step(), last_step + 1);
      last_step = log.last_step();
      ASSERT_EQ(log.read_step(last_step).digest, digest_of(states_at(last_step)));
    } catch (const scenarios::FileError&) {
      ASSERT_EQ(last_step, -1) << "no step may be lost once it was whole; length " << length;
    }
  }
  EXPECT_EQ(last_step, kSteps);
}

TEST(EventLog, AnyFlippedBitIsNoticed) {
  const TemporaryFolder folder;
  const std::string whole = folder.file("whole.sodalog");
  const std::string damaged = folder.file("damaged.sodalog");
  write_log(whole);
  const std::string bytes = read_file(whole);
  for (std::size_t byte = 0; byte < bytes.size(); ++byte) {
    std::string changed = bytes;
    changed[byte] = static_cast<char>(changed[byte] ^ (1 << (byte % 8)));
    write_file(damaged, changed);
    try {
      const LogReader log(damaged);
      ASSERT_NE(log.damage(), "") << "byte " << byte;
      ASSERT_NE(log.damage().find("(step " + std::to_string(log.last_step() + 1) + ")"),
                std::string::npos)
          << log.damage();
    } catch (const scenarios::FileError&) {
      // Damage before the first step is whole: there is nothing to replay.
      ASSERT_LT(byte, bytes.size() / 2);
    }
  }
}

TEST(EventLog, AnotherVersionIsRefusedByName) {
  const TemporaryFolder folder;
  const std::string file = folder.file("a.sodalog");
  ByteBuffer header(kLogMagic.begin(), kLogMagic.end());
  put(header, kLogVersion + 1);
  put(header, std::uint32_t{0});
  put(header, checksum(header));
  write_file(file, std::string(header.begin(), header.end()));
  try {
    LogReader log(file);
    FAIL() << "read a log of another version";
  } catch (const scenarios::FileError& error) {
    EXPECT_NE(std::string(error.what()).find("version 8"), std::string::npos) << error.what();
  }
}

TEST(EventLog, WhatIsNoLogIsRefused) {
  const TemporaryFolder folder;
  write_file(folder.file("text"), "{\"not\": \"a log, but long enough to hold a header\"}");
  EXPECT_THROW(LogReader(folder.file("text")), scenarios::FileError);
  EXPECT_THROW(LogReader(folder.file("missing")), scenarios::FileError);
  EXPECT_THROW(LogReader(folder.file("")), scenarios::FileError);
}

TEST(EventLog, EveryOptionOfARunReadsBack) {
  LoggedOptions options;
  Overrides& given = options.overrides;
  given.policy = kernel::Synchronisation::kLockstep;
  given.rollback = models::RollbackMode::kInvalidate;
  given.gating = false;
  given.split_islands = true;
  given.ghosts = models::GhostMode::kPredicted;
  given.balancing = models::BalancingPolicy::kPaper;
  given.balancing_interval = 7;
  given.balancing_seed = ~std::uint64_t{0};
  given.cluster = {.processors = 3,
                   .latency_us = 60.5,
                   .jitter_us = 0.0,
                   .cost_us = 1e-3,
                   .bandwidth_mb_s = 1e9,
                   .gvt_interval_us = 100.0,
                   .execution_seed = 11,
                   .check_purity = true};
  options.ranks = 4;
  const ByteBuffer bytes = encode(options);
  EXPECT_EQ(encode(decode_options(bytes)), bytes);
  const std::vector<OptionText> told = in_words(decode_options(bytes));
  const auto value_of = [&told](const std::string& name) {
    for (const OptionText& option : told)
      if (option.name == name) return option.value;
    return std::string("no such option");
  };
  EXPECT_EQ(value_of("policy"), "lockstep");
  EXPECT_EQ(value_of("gating"), "off");
  EXPECT_EQ(value_of("ghosts"), "predicted");
  EXPECT_EQ(value_of("latency"), "60.5");
  EXPECT_EQ(value_of("check of purity"), "on");
  EXPECT_EQ(value_of("ranks"), "4");
  EXPECT_EQ(value_of("worlds"), "not given");
}

TEST(EventLog, AnUnwritablePlaceIsAFileError) {
  EXPECT_THROW(LogWriter("/nonexistent-folder/a.sodalog", false), scenarios::FileError);
}

// They are kept in memory, and compress to nothing.
TEST(EventLog, MeshFilesHaveALimitTogether) {
  const TemporaryFolder folder;
  const auto begin = [&folder](const std::string& name, std::size_t last_bytes) {
    std::vector<scenarios::MeshFile> meshes(4, {"a.obj", std::string(63u << 20, ' ')});
    meshes.push_back({"last.obj", std::string(last_bytes, ' ')});
    LogWriter(folder.file(name), false).begin({"9.9", "/a.json", "{}"}, {}, kLabels, meshes);
  };
  EXPECT_NO_THROW(begin("a.sodalog", (4u << 20) - 4096));
  EXPECT_THROW(begin("b.sodalog", 4u << 20), scenarios::FileError);
}

// As on a full disk.
TEST(EventLog, AFailedWriteIsKnownAtOnceAndToldAtTheEnd) {
  const TemporaryFolder folder;
  const auto states = states_at(0);
  LogWriter log(folder.file("a.sodalog"), false);
  log.begin({"9.9", "/a.json", "{}"}, {}, kLabels, {});
  EXPECT_TRUE(log.add_step(logged_step(0, digest_of(states), states)));
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handled = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit none{100, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  EXPECT_FALSE(log.add_step(logged_step(1, digest_of(states), states)));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handled);
  EXPECT_FALSE(log.add_step(logged_step(1, digest_of(states), states)));
  EXPECT_THROW(log.finish(), scenarios::FileError);
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.sodalog")));
}

TEST(StepComparison, AgreesOnlyWhenEveryBitDoes) {
  const auto states = states_at(2);
  EXPECT_EQ(divergence(logged_step(2, digest_of(states), states), all_ids(states.size()), states,
                       kLabels),
            "");
}

TEST(StepComparison, NamesStepBodyFieldAndBothValues) {
  const auto logged = states_at(2);
  auto replayed = logged;
  replayed[1].linear_velocity_m_s.x() = 0.5;
  const std::string text = divergence(logged_step(2, digest_of(logged), logged),
                                      all_ids(replayed.size()), replayed, kLabels);
  EXPECT_NE(text.find("step 2"), std::string::npos) << text;
  EXPECT_NE(text.find("body 7"), std::string::npos) << text;
  EXPECT_NE(text.find("linear_velocity"), std::string::npos) << text;
  EXPECT_NE(text.find("0.3333333333333333 (0x3fd5555555555555)"), std::string::npos) << text;
  EXPECT_NE(text.find("0.5 (0x3fe0000000000000)"), std::string::npos) << text;
}

TEST(StepComparison, TellsAnAlteredDigestFromAnAlteredState) {
  const auto states = states_at(2);
  const std::string text = divergence(logged_step(2, digest_of(states) ^ 1, states),
                                      all_ids(states.size()), states, kLabels);
  EXPECT_NE(text.find("step 2"), std::string::npos) << text;
  EXPECT_NE(text.find("digest"), std::string::npos) << text;
  EXPECT_NE(text.find(format_digest(digest_of(states) ^ 1)), std::string::npos) << text;
}

TEST(StepComparison, NamesABodyThatOneOfThemLacks) {
  const auto states = states_at(2);
  auto ids = all_ids(states.size());
  ids.back() = physics::BodyId{3};
  const std::vector<std::uint32_t> labels{7, 8, 9, 10};
  const std::string text = divergence(logged_step(2, 0, states), ids, states, labels);
  EXPECT_NE(text.find("logged, body 10 replayed"), std::string::npos) << text;
}

// Every field of an input, by its bytes.
TEST(EventLog, ReadsBackInputsAndWhichBodiesWereThere) {
  LoggedStep step = logged_step(4, 5, states_at(4));
  step.ids.back() = physics::BodyId{9};
  models::CommittedInput committed;
  committed.input.id = 3;
  committed.input.step = 3;
  committed.input.kind = models::InputKind::kSetVelocity;
  committed.input.body = physics::BodyId{1};
  committed.input.state = states_at(4)[0];
  committed.input.sets_angular = true;
  committed.input.impulse_newton_s = {1.0, 2.0, 3.0};
  committed.input.point_local_m = {4.0, 5.0, 6.0};
  committed.input.material = {0.25, 0.75};
  committed.asked_step = -1;
  committed.had_effect = true;
  step.inputs = {committed, committed};
  const LoggedStep found = decode_step(encode_step(step), {.bodies = 10});
  EXPECT_EQ(found.ids, step.ids);
  ASSERT_EQ(found.inputs.size(), 2u);
  EXPECT_EQ(models::encode_input(found.inputs[1].input), models::encode_input(committed.input));
  EXPECT_EQ(found.inputs[1].asked_step, -1);
  EXPECT_TRUE(found.inputs[1].had_effect);
}

// Of each step, and of where it leads.
TEST(EventLog, BoundsHoldAllStatesOfTheirSteps) {
  const TemporaryFolder folder;
  const std::string file = folder.file("a.sodalog");
  write_log(file);
  LogReader log(file);
  const std::optional<MotionBounds> bounds = log.read_bounds(0);
  ASSERT_TRUE(bounds);
  EXPECT_EQ(bounds->first_step, 0);
  EXPECT_EQ(bounds->last_step, kSteps);
  for (std::int64_t step = 0; step <= kSteps; ++step) {
    const std::vector<physics::BodyState> states = states_at(step);
    for (std::size_t i = 0; i < states.size(); ++i) {
      EXPECT_LE(states[i].linear_velocity_m_s.norm(), bounds->most_speed_m_s);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double place = states[i].position_m[static_cast<Eigen::Index>(axis)];
        EXPECT_LE(bounds->bodies[i].low_m[axis], place);
        EXPECT_GE(bounds->bodies[i].high_m[axis], place);
        EXPECT_LT(bounds->bodies[i].high_m[axis] - bounds->bodies[i].low_m[axis], 1.0);
      }
    }
  }
}

TEST(EventLog, ReadsBackWhichCellsChangedHands) {
  LoggedStep step = logged_step(4, 5, states_at(4));
  step.territory_changes = {{3, 7, models::WorldId{1}, models::WorldId{2}},
                            {3, 0xfffffffe, models::WorldId{0xffff0}, models::WorldId{0}}};
  EXPECT_EQ(decode_step(encode_step(step), {.bodies = 10}).territory_changes,
            step.territory_changes);
}

TEST(StepComparison, SignedZerosAreDifferentValues) {
  const auto logged = states_at(0);
  auto replayed = logged;
  replayed[0].position_m.y() = 0.0;
  EXPECT_NE(divergence(logged_step(0, digest_of(logged), logged), all_ids(replayed.size()),
                       replayed, kLabels),
            "");
}

}  // namespace
}  // namespace soda::analysis
