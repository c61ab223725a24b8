// What the page of `soda view` is made of: the timeline of a traced run, and what lies between
// bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/why_command.hpp"
#include "analysis/viewer/recording.hpp"
#include "analysis/viewer/timeline.hpp"
#include "analysis/viewer/timeline_bars.hpp"
#include "physics/step/contact_loads.hpp"

namespace soda::analysis {
namespace {

using analysis_test::library_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;

class ViewParts : public testing::Test {
 protected:
  void run(const std::string& scene, const std::vector<std::string>& options) {
    std::vector<std::string> command = {"run", library_file(scene), "--log", file_};
    command.insert(command.end(), options.begin(), options.end());
    const auto ran = run_soda(command);
    ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
    log_.emplace(file_);
    scenario_ = logged_scenario(*log_, {});
  }

  const TemporaryFolder folder_;
  const std::string file_ = folder_.file("run.sodalog");
  std::optional<LogReader> log_;
  scenarios::Scenario scenario_;
};

TEST_F(ViewParts, TheTimelineTellsOfEachExecutionAndRollback) {
  run("border-stack", {"--steps", "120", "--executor", "virtual", "--log-level", "trace"});
  const ExecutionTrace trace = read_trace(*log_, scenario_.territory.worlds);
  const std::optional<Timeline> timeline = timeline_of(*log_, scenario_);
  ASSERT_TRUE(timeline);
  EXPECT_EQ(timeline->steps_a_bar, 0);
  const auto absorbed =
      static_cast<std::size_t>(std::ranges::count_if(trace.executions, &TracedExecution::absorbed));
  EXPECT_EQ(timeline->bars.size() + absorbed, trace.executions.size());
  const std::size_t executed =
      std::transform_reduce(timeline->samples.begin(), timeline->samples.end(), std::size_t{0},
                            std::plus(), [](const auto& sample) { return sample.executed; });
  EXPECT_EQ(executed, timeline->bars.size());
  ASSERT_GT(trace.rollbacks.size(), 20u);
  ASSERT_EQ(timeline->rollbacks.size(), trace.rollbacks.size());
  for (std::size_t i = 0; i < trace.rollbacks.size(); ++i) {
    const Timeline::Rollback& rollback = timeline->rollbacks[i];
    EXPECT_EQ(rollback.text, why_text(trace, i, log_->labels()));
    EXPECT_EQ(timeline->causes[rollback.cause], cause_of(trace, i));
    EXPECT_EQ(rollback.because_of, trace.led_to(i).value_or(Timeline::kNobody));
    std::int64_t wasted = 0;
    for (const Timeline::Bar& bar : timeline->bars)
      if (bar.rollback == i) wasted += bar.busy_ns;
    EXPECT_EQ(wasted, rollback.wasted_ns) << i;
    for (const Timeline::Arrow& arrow : rollback.arrows) EXPECT_LE(arrow.sent_ns, arrow.arrived_ns);
  }
}

TEST_F(ViewParts, CommitsAscendAndNoWorldIsFurtherAheadThanItsBuffer) {
  run("twelve-worlds", {"--steps", "60", "--executor", "virtual", "--log-level", "trace"});
  const Timeline timeline = timeline_of(*log_, scenario_).value();
  EXPECT_EQ(timeline.commits.front().steps, 0);
  EXPECT_EQ(timeline.commits.back().steps, 60);
  for (std::size_t i = 1; i < timeline.commits.size(); ++i) {
    EXPECT_GT(timeline.commits[i].steps, timeline.commits[i - 1].steps);
    EXPECT_GE(timeline.commits[i].at_ns, timeline.commits[i - 1].at_ns);
  }
  std::int64_t most = 0;
  for (const Timeline::Sample& sample : timeline.samples) {
    ASSERT_EQ(sample.reached.size(), timeline.worlds);
    most = std::max(most, std::ranges::max(sample.reached) + 1 - sample.committed);
  }
  EXPECT_GT(most, 1);
  EXPECT_LE(most, timeline.buffer);
}

TEST_F(ViewParts, OfAResumedRunTheyBeginWhereItDid) {
  const std::string before = folder_.file("before.sodalog");
  ASSERT_EQ(
      run_soda({"run", library_file("border-stack"), "--steps", "30", "--log", before}).exit_code,
      kExitOk);
  const auto resumed = run_soda({"run", "--resume", before, "--steps", "45", "--executor",
                                 "virtual", "--log", file_, "--log-level", "trace"});
  ASSERT_EQ(resumed.exit_code, kExitOk) << resumed.err;
  log_.emplace(file_);
  scenario_ = logged_scenario(*log_, {});
  const Timeline timeline = timeline_of(*log_, scenario_).value();
  EXPECT_EQ(timeline.commits.front().steps, 30);
  EXPECT_EQ(timeline.commits.back().steps, 45);
  EXPECT_EQ(timeline.costs.size(), 15u);
  for (const Timeline::StepCost& cost : timeline.costs) EXPECT_GT(cost.kept_ns, 0);
  EXPECT_EQ(record(*log_, scenario_, 10).steps, (std::vector<std::int64_t>{30, 40, 45}));
}

TEST_F(ViewParts, ALogWithoutATraceHasNoTimeline) {
  run("border-stack", {"--steps", "3"});
  EXPECT_FALSE(timeline_of(*log_, scenario_));
}

// Half a million executions, every third of which was rolled back.
TEST(TimelineBars, AreMergedUntilThereAreFewAndLoseNoWork) {
  ExecutionTrace trace;
  trace.worlds = 5;
  trace.rollbacks.resize(1);
  std::int64_t kept_ns = 0, undone_ns = 0;
  for (std::int64_t i = 0; i < 500'000; ++i) {
    TracedExecution& execution = trace.executions.emplace_back();
    execution.world = static_cast<std::uint32_t>(i / 100'000);
    execution.time.t = i % 100'000 / 7;
    execution.began_ns = 10 * i;
    execution.took_ns = 1 + i % 5;
    execution.committed = true;
    if (execution.time.t / 40 % 3 == 0) execution.undone_by = 0;
    (execution.undone_by ? undone_ns : kept_ns) += execution.took_ns;
  }
  Timeline timeline;
  add_bars(trace, {0}, timeline);
  EXPECT_LE(timeline.bars.size(), kMostBars);
  EXPECT_GT(timeline.bars.size(), kMostBars / 4);
  EXPECT_GE(timeline.steps_a_bar, 1);
  for (const Timeline::Bar& bar : timeline.bars) {
    EXPECT_LT(bar.last_step - bar.step, timeline.steps_a_bar);
    (bar.fate == Timeline::Fate::kRolledBack ? undone_ns : kept_ns) -= bar.busy_ns;
  }
  EXPECT_EQ(kept_ns, 0);
  EXPECT_EQ(undone_ns, 0);
}

// Neighbours of another fate each time, so that nothing can be merged.
TEST(TimelineBars, KeepWhatWasRolledBackWhereNothingCanBeMerged) {
  ExecutionTrace trace;
  trace.worlds = 1;
  trace.rollbacks.resize(1);
  for (std::int64_t i = 0; i < 240'000; ++i) {
    TracedExecution& execution = trace.executions.emplace_back();
    execution.time.t = i;
    execution.began_ns = i;
    execution.took_ns = 1;
    execution.committed = i % 3 != 0;
    execution.repeats = i % 3 == 1;
    if (i % 3 == 0) execution.undone_by = 0;
  }
  Timeline timeline;
  add_bars(trace, {0}, timeline);
  EXPECT_EQ(timeline.bars.size(), kMostBars);
  EXPECT_EQ(std::ranges::count(timeline.bars, Timeline::Fate::kRolledBack, &Timeline::Bar::fate),
            80'000);
}

TEST_F(ViewParts, ContactsAreThoseThatBearSomething) {
  run("pyramid", {"--steps", "12"});
  const FrameMarks marks = record(*log_, scenario_, 3).marks;
  const physics::Geometry geometry(scenario_.scene);
  ASSERT_EQ(marks.every, 1u);
  ASSERT_EQ(marks.frames.size(), 5u);
  EXPECT_EQ(marks.energies.size(), 5u);
  for (const FrameMarks::Frame& frame : marks.frames) {
    const LoggedStep step = log_->read_states(3 * frame.frame);
    auto loads = physics::contact_loads(scenario_.scene, geometry, step.ids, step.states);
    std::erase_if(loads, [](const physics::ContactLoad& load) { return !load.point; });
    ASSERT_EQ(frame.contacts.size(), loads.size());
    if (frame.frame > 0) EXPECT_GT(loads.size(), 400u);
    for (std::size_t i = 0; i < loads.size(); ++i) {
      EXPECT_EQ(frame.contacts[i].a, physics::index_of(loads[i].a));
      EXPECT_EQ(frame.contacts[i].b, physics::index_of(loads[i].b));
      EXPECT_FLOAT_EQ(frame.contacts[i].normal_newton, static_cast<float>(loads[i].normal_newton));
    }
  }
}

// Looked for cell by cell.
TEST_F(ViewParts, GhostsAreBodiesWhoseSweptBoxReachesCellsOfOthers) {
  run("eight-corner", {"--steps", "30"});
  const Recording recording = record(*log_, scenario_, 10);
  const physics::Geometry geometry(scenario_.scene);
  const models::Grid& grid = recording.grid;
  std::size_t ghosts = 0;
  for (const FrameMarks::Frame& frame : recording.marks.frames) {
    std::set<std::pair<std::uint32_t, std::uint16_t>> wanted, shown;
    const LoggedStep step = log_->read_states(10 * frame.frame);
    for (std::size_t i = 0; i < step.ids.size(); ++i) {
      const auto box = physics::swept_aabb(scenario_.scene, geometry, step.ids[i], step.states[i]);
      const auto low = grid.cell_of(box.min), high = grid.cell_of(box.max);
      const auto owner_in = [&](const std::array<std::int32_t, 3>& cell) {
        return recording.cell_owners[grid.index_of_cell(cell)];
      };
      const std::uint16_t own = owner_in(grid.cell_of(step.states[i].position_m));
      for (std::int32_t x = low[0]; x <= high[0]; ++x)
        for (std::int32_t y = low[1]; y <= high[1]; ++y)
          for (std::int32_t z = low[2]; z <= high[2]; ++z)
            if (owner_in({x, y, z}) != own)
              wanted.insert({physics::index_of(step.ids[i]), owner_in({x, y, z})});
    }
    for (const FrameMarks::Ghost& ghost : frame.ghosts) shown.insert({ghost.body, ghost.world});
    EXPECT_EQ(shown, wanted);
    ghosts += shown.size();
  }
  EXPECT_GT(ghosts, 0u);
}

TEST_F(ViewParts, JointsBreakInTheFrameInWhichTheirBodiesHaveLostThem) {
  run("breaking-bridge", {"--steps", "120"});
  const FrameMarks marks = record(*log_, scenario_, 2).marks;
  ASSERT_EQ(marks.joints.size(), scenario_.scene.joints.size());
  std::size_t broken = 0;
  for (std::size_t i = 0; i < marks.joints.size(); ++i) {
    const physics::Joint& joint = scenario_.scene.joints[i];
    const auto is_broken_in = [&](std::int64_t frame) {
      return physics::is_broken(joint,
                                log_->read_states(2 * frame).states[physics::index_of(joint.a)]);
    };
    EXPECT_EQ(marks.joints[i].label, joint.label);
    const std::uint32_t from = marks.joints[i].broken_from;
    if (from > 60) {
      EXPECT_FALSE(is_broken_in(60));
      continue;
    }
    ++broken;
    EXPECT_TRUE(is_broken_in(from));
    EXPECT_FALSE(is_broken_in(from - 1));
  }
  EXPECT_GT(broken, 0u);
}

// 1000 boxes in a heap have some 4000 contacts in each frame.
TEST_F(ViewParts, MarksOfManyFramesAreThinnedOutEvenly) {
  run("bin-1000", {"--steps", "60", "--executor", "sequential", "--worlds", "1"});
  const physics::SceneDescription& scene = scenario_.scene;
  const models::TerritoryMap map(models::Grid(), 1, {models::WorldId{0}});
  LoggedStep step = log_->read_states(60);
  FrameMarker marker(scene, 300);
  for (int frame = 0; frame < 300; ++frame) marker.add(step, map);
  const FrameMarks marks = marker.finish();
  EXPECT_GT(marks.every, 1u);
  EXPECT_EQ(marks.energies.size(), 300u);
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < marks.frames.size(); ++i) {
    EXPECT_EQ(marks.frames[i].frame, i * marks.every);
    contacts += marks.frames[i].contacts.size();
  }
  EXPECT_LE(contacts * sizeof(FrameMarks::Contact), 6'000'000u);
  EXPECT_GT(contacts * sizeof(FrameMarks::Contact), 1'500'000u);
}

}  // namespace
}  // namespace soda::analysis
