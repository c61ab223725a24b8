// A renderer's view of a run, on a virtual clock where time matters.
#include "models/real_time/buffer_interface.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <thread>

#include "models/messages/schedule.hpp"
#include "models/real_time/playback.hpp"
#include "physics/measures/measures.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

constexpr double kFrameS = 1.0 / 60.0;

test::Scene few_balls() {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  for (int i = 0; i < 6; ++i) scene.body(ball, Vec3(i - 2.7, 0.1 * i, 1 + 0.2 * i), Vec3(2, 1, 0));
  return scene;
}

CommittedStep step_of(std::int64_t step) {
  return {.step = step,
          .ids = {},
          .states = {},
          .owners = {},
          .islands = {},
          .inputs = {},
          .territory_changes = {}};
}

TEST(BufferInterface, AnswersWithTheClockAskedForOrTheLargestBeforeIt) {
  BufferInterface buffer({}, 1, {});
  EXPECT_EQ(buffer.show(3)->clock, 0);
  for (std::int64_t step = 1; step <= 4; ++step) buffer.add(step_of(step));
  EXPECT_EQ(buffer.show(3)->clock, 3);
  EXPECT_EQ(buffer.show(9)->clock, 4);
  EXPECT_EQ(buffer.show(9)->clock, 4) << "again";
}

TEST(BufferInterface, HoldsGvtByWhatWasShown) {
  BufferInterface buffer({}, 1, {.steps = 2});
  EXPECT_EQ(buffer.floor(), time_of(2, Phase::kBegin));
  buffer.add(step_of(1));
  EXPECT_EQ(buffer.floor(), time_of(2, Phase::kBegin)) << "what is final need not be shown";
  buffer.show(1);
  EXPECT_EQ(buffer.floor(), time_of(3, Phase::kBegin));
}

// A renderer at one step a frame, and a GVT that follows what it may be by so many frames.
std::int64_t lead_with_gvt_behind(std::int64_t frames_behind, const Lead& lead) {
  BufferInterface buffer({}, 1, lead);
  std::vector<std::int64_t> floors;
  std::int64_t final_step = 0;
  for (std::int64_t frame = 1; frame <= 300; ++frame) {
    floors.push_back(buffer.floor().t);
    const std::int64_t known = std::max<std::int64_t>(std::ssize(floors) - 1 - frames_behind, 0);
    for (; final_step < floors[static_cast<std::size_t>(known)]; ++final_step)
      buffer.add(step_of(final_step + 1));
    buffer.on_newest(WorldId{0}, final_step + 10);
    buffer.show(buffer.shown() + 1);
  }
  return buffer.lead_steps();
}

TEST(BufferInterface, AnAdaptingLeadGrowsToTwiceAsFarAsGvtIsBehind) {
  EXPECT_EQ(lead_with_gvt_behind(0, {.steps = 2, .frame = 1, .most = 48}), 2);
  const std::int64_t five = lead_with_gvt_behind(5, {.steps = 2, .frame = 1, .most = 48});
  EXPECT_GE(five, 12);  // twice as far
  EXPECT_LE(five, 16);
  EXPECT_EQ(lead_with_gvt_behind(5, {.steps = 2, .frame = 0, .most = 48}), 2) << "it stays";
  EXPECT_EQ(lead_with_gvt_behind(30, {.steps = 2, .frame = 1, .most = 8}), 8) << "no further";
}

TEST(BufferInterface, AnAdaptingLeadShrinksWhenGvtKeepsUpAgain) {
  BufferInterface buffer({}, 1, {.steps = 2, .frame = 1, .most = 48});
  buffer.on_newest(WorldId{0}, 10000);
  for (std::int64_t step = 1; step <= 10; ++step) {  // final just in time
    buffer.add(step_of(step));
    buffer.show(step);
  }
  const std::int64_t grown = buffer.lead_steps();
  EXPECT_GE(grown, 8);
  for (std::int64_t step = 11; step <= 20; ++step) buffer.add(step_of(step));
  for (std::int64_t step = 21; step <= 5000; ++step) {
    buffer.add(step_of(step));
    buffer.show(step - 10);
  }
  EXPECT_EQ(buffer.lead_steps(), 2);
  EXPECT_EQ(buffer.most_lead_steps(), grown);
}

TEST(BufferInterface, ReachedIsWhatAllWorldsHaveAndGoesBackWithThem) {
  BufferInterface buffer({}, 2, {});
  buffer.on_newest(WorldId{0}, 7);
  EXPECT_EQ(buffer.reached(), 0);
  buffer.on_newest(WorldId{1}, 9);
  EXPECT_EQ(buffer.reached(), 7);
  buffer.on_newest(WorldId{1}, 4);
  EXPECT_EQ(buffer.reached(), 4);
}

// A sequential run on a virtual clock: a step takes what `cost_s` says, frames are shown when they
// are due, and where the run waits for the renderer, time goes on to the next frame.
class VirtualPlayback final : public kernel::ExternalSource {
 public:
  VirtualPlayback(std::int64_t buffer, const PlaybackOptions& options,
                  std::function<double(double)> cost_s)
      : scene_(few_balls()),
        buffer_(scene_.states, 1, {.steps = buffer}),
        options_(options),
        cost_s_(std::move(cost_s)) {}

  const std::vector<ShownFrame>& run() {
    const CommitObserver observer{
        .wants_states = true, .on_step = [this](const CommittedStep& step) { take_step(step); }};
    RunOptions options{.steps = options_.steps};
    options.external_sources = {this};
    options.entries = &buffer_;
    simulate(scene_.description, scene_.states, blocks(1), options, observer);
    while (!playback_->finished()) playback_->show_next();
    return playback_->frames();
  }

  kernel::VirtualTime floor() override { return buffer_.floor(); }
  void take(kernel::VirtualTime gvt, kernel::VirtualTime, std::vector<kernel::Message>&) override {
    while (gvt >= buffer_.floor()) {
      if (!playback_) playback_.emplace(buffer_, options_, now_s_);  // it is full
      now_s_ = std::max(now_s_, playback_->next_due_s());
      playback_->show_next();
    }
  }

 private:
  // `cost_s` gets the time since the first frame, negative before it.
  void take_step(const CommittedStep& step) {
    const double since_s = playback_ ? now_s_ - (playback_->next_due_s() - shown_s()) : -1.0;
    now_s_ += cost_s_(since_s);
    while (playback_ && playback_->next_due_s() < now_s_) playback_->show_next();
    buffer_.add(step);
  }
  double shown_s() const {
    return static_cast<double>(playback_->frames().size()) * options_.frame_s;
  }

  const test::Scene scene_;
  BufferInterface buffer_;
  const PlaybackOptions options_;
  const std::function<double(double)> cost_s_;
  double now_s_ = 0.0;
  std::optional<Playback> playback_;
};

// Half a frame a step, but `ratio` frames from second 2 for `length_s`.
std::function<double(double)> peak_of(double ratio, double length_s) {
  return [=](double since_s) {
    const bool peak = since_s >= 2.0 && since_s < 2.0 + length_s;
    return kFrameS * (peak ? ratio : 0.5);
  };
}

TEST(RealTime, ABufferOf48KeepsTheFrameRateThroughASecondOf150PercentLoad) {
  const PlaybackOptions options{.frame_s = kFrameS, .steps = 600};
  VirtualPlayback playback(48, options, peak_of(1.5, 1.0));
  const std::vector<ShownFrame>& frames = playback.run();
  const PlaybackSummary sum = summary_of(frames, options);
  EXPECT_EQ(sum.frames, 601);
  EXPECT_EQ(sum.on_time, 601);
  EXPECT_EQ(sum.slow_motion_s, 0.0);
  // 60 frames are shown while 40 steps are computed.
  EXPECT_NEAR(static_cast<double>(sum.least_fill), 48 - 20, 1);
  // Refilled at one entry a frame.
  EXPECT_GE(frames[120 + 60 + 25].fill, 47);
}

TEST(RealTime, WithoutEnoughBufferTheSamePeakGivesSlowMotionAndTheRateComesBack) {
  const PlaybackOptions options{.frame_s = kFrameS, .steps = 600};
  VirtualPlayback playback(8, options, peak_of(1.5, 1.0));
  const std::vector<ShownFrame>& frames = playback.run();
  const PlaybackSummary sum = summary_of(frames, options);
  EXPECT_EQ(frames.back().clock, 600) << "no step is left out";
  EXPECT_GT(sum.late, 8);
  EXPECT_EQ(sum.slow, 0) << "one step a frame: there is nothing between";
  EXPECT_NEAR(sum.slow_motion_s, static_cast<double>(sum.late) * kFrameS, 1e-9);
  for (std::size_t i = 200; i < frames.size(); ++i) EXPECT_EQ(frames[i].fate, FrameFate::kOnTime);
}

// A = B r / (r - 1), from the frame at which the peak begins.
TEST(RealTime, ALastingPeakIsHiddenForAsManyFramesAsTheLawSays) {
  for (const std::int64_t buffer : {8, 48}) {
    for (const double ratio : {1.25, 1.5, 2.0, 4.0}) {
      const PlaybackOptions options{.frame_s = kFrameS, .steps = 700};
      VirtualPlayback playback(buffer, options, peak_of(ratio, 1e9));
      const std::vector<ShownFrame>& frames = playback.run();
      std::size_t first_late = 0;
      while (frames[first_late].fate == FrameFate::kOnTime) ++first_late;
      // One entry less is in store while its successor is computed.
      const double lasted = static_cast<double>(first_late) - 120.0;
      const auto law = [ratio](std::int64_t entries) {
        return static_cast<double>(entries) * ratio / (ratio - 1.0);
      };
      EXPECT_LE(lasted, law(buffer) + 1.0) << buffer << " " << ratio;
      EXPECT_GE(lasted, law(buffer - 1) - 1.0) << buffer << " " << ratio;
    }
  }
}

TEST(RealTime, FrameRatesThatAreNotTheRateOfStepsShowTheirClocks) {
  const auto clocks = [](double steps_per_frame) {
    const PlaybackOptions options{
        .frame_s = kFrameS, .steps_per_frame = steps_per_frame, .steps = 60};
    VirtualPlayback playback(16, options, [](double) { return 0.01 * kFrameS; });
    std::vector<std::int64_t> result;
    for (const ShownFrame& frame : playback.run()) {
      EXPECT_EQ(frame.fate, FrameFate::kOnTime);
      result.push_back(frame.clock);
    }
    return result;
  };
  EXPECT_EQ(clocks(2.0).size(), 31u);
  EXPECT_EQ(clocks(2.0)[7], 14);
  EXPECT_EQ(clocks(0.5).size(), 121u);
  EXPECT_EQ(clocks(0.5)[7], 3);
  EXPECT_EQ(clocks(1.0 - 1e-12)[30], 30) << "1/60 s is not a binary number";
}

// What an external source is offered as the earliest time, beside what is on the screen.
struct EarliestInput final : kernel::ExternalSource {
  explicit EarliestInput(const BufferInterface& shown) : buffer(shown) {}
  kernel::VirtualTime floor() override { return kernel::kNever; }
  void take(kernel::VirtualTime, kernel::VirtualTime earliest,
            std::vector<kernel::Message>&) override {
    most_steps_away = std::max(most_steps_away, earliest.t - buffer.shown());
  }
  const BufferInterface& buffer;
  std::int64_t most_steps_away = 0;
};

TEST(BufferInterface, WorldsFillTheirBuffersWhileInputsStillTakeEffectAtOnce) {
  const test::Scene scene = few_balls();
  std::vector<std::uint64_t> expected;
  const CommitObserver plain{.wants_states = true, .on_step = [&](const CommittedStep& step) {
                               expected.push_back(physics::digest(step.ids, step.states));
                             }};
  simulate(scene.description, scene.states, blocks(1), {.steps = 80}, plain);

  BufferInterface buffer(scene.states, 4, {});
  EarliestInput input(buffer);
  RunOptions options{.executor = ExecutorKind::kThreads, .threads = 2, .steps = 80, .buffer = 16};
  options.external_sources = {&buffer, &input};
  options.entries = &buffer;
  std::thread run([&] {
    const CommitObserver observer{.wants_states = true,
                                  .on_step = [&](const CommittedStep& step) { buffer.add(step); }};
    simulate(scene.description, scene.states, blocks(4), options, observer);
  });
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  const auto wait_for = [&](const auto& condition) {
    while (!condition() && std::chrono::steady_clock::now() < give_up)
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    return condition();
  };
  for (std::int64_t clock = 1; clock <= 80; ++clock) {
    std::shared_ptr<const Frame> frame;
    ASSERT_TRUE(wait_for([&] { return (frame = buffer.show(clock))->clock == clock; })) << clock;
    EXPECT_EQ(physics::digest(frame->ids, frame->states), expected[clock - 1]) << clock;
    // GVT stops one step beyond; the worlds go on by what their buffers hold.
    if (clock % 20 != 0) continue;
    const std::int64_t most = std::min<std::int64_t>(clock + 1 + 16, 80);
    EXPECT_TRUE(wait_for([&] { return buffer.reached() == most; })) << buffer.reached();
  }
  run.join();
  EXPECT_EQ(input.most_steps_away, 1);
}

}  // namespace
}  // namespace soda::models
