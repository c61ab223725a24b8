// The swarm itself: that it notices what goes wrong, survives it, and shrinks it.
#include <gtest/gtest.h>

#include "analysis/commands/swarm_command.hpp"
#include "analysis/text/exit_codes.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/api/run_observer.hpp"
#include "kernel/phold/phold.hpp"

namespace soda::analysis {
namespace {

// A model in which the given run fails.
class Faulty final : public SwarmSubject {
 public:
  using Fails = std::function<void(const TrialSize&, const kernel::VirtualResult&)>;
  explicit Faulty(Fails fails) : fails_(std::move(fails)) {}

  std::string file() const override { return ""; }
  TrialSize draw_size(std::uint64_t) const override { return {8, 30, 10, 4}; }
  kernel::Counters run(std::uint64_t seed, const TrialSize& size,
                       kernel::VirtualOptions cluster) const override {
    cluster.window = size.window;
    const auto lps = kernel::make_phold(
        {.lps = size.lps, .start_events_per_lp = 2, .remote_per_mille = 700, .seed = seed});
    const kernel::VirtualResult result = kernel::run_virtual(lps, {size.end, 0}, cluster);
    fails_(size, result);
    return result.run.counters;
  }

 private:
  const Fails fails_;
};

// The first seed from `seed` on whose adversary makes it fail as drawn, but not undisturbed.
Trial failing_trial(const SwarmSubject& subject, std::uint64_t seed) {
  for (;; ++seed) {
    Trial trial{seed, subject.draw_size(seed), std::vector<kernel::Decision>{}};
    if (run_isolated(subject, trial).failed) continue;
    trial.decisions.reset();
    if (run_isolated(subject, trial).failed) return trial;
  }
}

TEST(Swarm, ATrialThatHoldsHandsBackItsSums) {
  const Faulty subject([](const TrialSize&, const kernel::VirtualResult&) {});
  const Trial trial{3, subject.draw_size(3), std::nullopt};
  const TrialOutcome outcome = run_isolated(subject, trial);
  EXPECT_FALSE(outcome.failed) << outcome.what;
  const TrialSums sums = run_trial(subject, trial);
  EXPECT_GT(sums.committed, 0u);
  EXPECT_EQ(outcome.sums.committed, sums.committed);
  EXPECT_EQ(outcome.sums.executed, sums.executed);
}

TEST(Swarm, AViolationABrokenInvariantAndASignalAreOutcomes) {
  const auto outcome = [](Faulty::Fails fails) {
    const Faulty subject(std::move(fails));
    return run_isolated(subject, {1, subject.draw_size(1), std::nullopt});
  };
  const TrialOutcome violation =
      outcome([](const auto&, const auto&) { throw kernel::Violation("the rule and the time"); });
  EXPECT_TRUE(violation.failed);
  EXPECT_EQ(violation.what, "the rule and the time");
  const TrialOutcome invariant =
      outcome([](const TrialSize& size, const auto&) { SODA_ASSERT(size.lps == 0, "the values"); });
  EXPECT_TRUE(invariant.failed);
  EXPECT_NE(invariant.what.find("the values"), std::string::npos) << invariant.what;
  EXPECT_NE(invariant.what.find("ended by signal 6"), std::string::npos) << invariant.what;
}

TEST(Swarm, AFailureIsShrunkToTheLeastSize) {
  const Faulty subject([](const TrialSize& size, const kernel::VirtualResult&) {
    if (size.lps >= 3 && size.end >= 7 && size.window >= 2) throw kernel::Violation("too large");
  });
  const ShrunkTrial smallest =
      shrink(subject, {1, subject.draw_size(1), std::nullopt}, "too large", {400});
  EXPECT_EQ(smallest.trial.size, (TrialSize{3, 7, 2, 1}));
  EXPECT_EQ(smallest.what, "too large");
  ASSERT_TRUE(smallest.trial.decisions);
  EXPECT_TRUE(smallest.trial.decisions->empty()) << "no decision of the adversary matters";
}

TEST(Swarm, ShrinkingStartsNoTrialWhenItsTimeIsOver) {
  const Faulty subject([](const auto&, const auto&) { throw kernel::Violation("always"); });
  const Trial failing{1, subject.draw_size(1), std::nullopt};
  const auto over = [] { return true; };
  EXPECT_EQ(shrink(subject, failing, "always", {400, over}).tried, 0u);
  int asked = 0;
  EXPECT_EQ(shrink(subject, failing, "always", {400, [&] { return ++asked > 3; }}).tried, 3u);
}

TEST(Swarm, AFailureThatTheAdversaryBringsAboutKeepsTheDecisionsThatMatter) {
  const Faulty subject([](const TrialSize&, const kernel::VirtualResult& result) {
    if (result.report.makespan_ns > 1'200'000) throw kernel::Violation("takes long");
  });
  const Trial failing = failing_trial(subject, 1);
  const TrialOutcome recorded = run_isolated(subject, failing, true);
  const ShrunkTrial smallest = shrink(subject, failing, "takes long", {1000});
  EXPECT_TRUE(run_isolated(subject, smallest.trial).failed);
  ASSERT_TRUE(smallest.trial.decisions);
  EXPECT_LT(smallest.trial.decisions->size(), recorded.decisions.size());
  for (std::size_t i = 0; i < smallest.trial.decisions->size(); ++i) {
    std::vector<kernel::Decision> fewer = *smallest.trial.decisions;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    const Trial trial{smallest.trial.seed, smallest.trial.size, fewer};
    EXPECT_FALSE(run_isolated(subject, trial).failed) << "decision " << i << " does not matter";
  }
}

TEST(Swarm, TheCommandReproducesTheShrunkTrial) {
  const Faulty subject([](const TrialSize&, const kernel::VirtualResult&) {});
  const Trial trial{17, {3, 9, 2, 1}, std::vector<kernel::Decision>{{12, 3}, {40, 1}}};
  EXPECT_EQ(reproducing_command(subject, trial),
            "soda swarm --seeds 17..17 --lps 3 --end 9 --window 2 --processors 1 "
            "--decisions 12:3,40:1");
  const std::vector<kernel::Decision> read = parse_decisions("12:3,40:1");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].point, 40u);
  EXPECT_EQ(read[1].value, 1u);
  EXPECT_EQ(format_decisions(read), "12:3,40:1");
  EXPECT_TRUE(parse_decisions("none").empty());
  for (const char* wrong : {"", "1", "1:", ":2", "1:2,", "1:2;3:4", "x:1", "-1:2"})
    EXPECT_THROW(parse_decisions(wrong), UsageError) << wrong;
}

TEST(Swarm, SeedsAreARange) {
  for (const char* wrong : {"", "1", "1..", "..2", "2..1", "1...2", "a..b"})
    EXPECT_THROW(swarm({.seeds = wrong}), UsageError) << wrong;
  EXPECT_EQ(swarm({.seeds = "5..7"}).trials, 3u);
}

}  // namespace
}  // namespace soda::analysis
