// Each online checker against a history that keeps its rule and against histories that break it.
#include "kernel/api/checkers.hpp"

#include <gtest/gtest.h>

#include <string>

#include "kernel/api/invariant.hpp"
#include "kernel/phold/phold.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"

namespace soda::kernel {
namespace {

Message message(VirtualTime time, std::uint64_t version, bool anti = false) {
  Message made;
  made.time = time;
  made.source = LpId{0};
  made.destination = LpId{1};
  made.version = version;
  made.anti = anti;
  return made;
}

const MessageView kMember{LpId{0}, 0, 0, {}};

TEST(GvtChecker, ObjectsToAGvtThatGoesBack) {
  GvtChecker checker;
  checker.on_gvt({3, 1}, {});
  checker.on_gvt({3, 1}, {});
  EXPECT_THROW(checker.on_gvt({3, 0}, {}), Violation);
}

TEST(GvtChecker, ObjectsToAGvtAboveAFloor) {
  GvtChecker checker;
  const std::vector<VirtualTime> floors = {{5, 0}, {4, 2}};
  checker.on_gvt({4, 2}, floors);
  EXPECT_THROW(checker.on_gvt({4, 3}, floors), Violation);
}

TEST(GvtChecker, ObjectsToAGvtAboveAMessageOnItsWayOnly) {
  GvtChecker checker;
  checker.on_send(message({4, 0}, 1));
  checker.on_gvt({4, 0}, {});
  EXPECT_THROW(checker.on_gvt({4, 1}, {}), Violation);
  checker.on_deliver(message({4, 0}, 1));
  checker.on_gvt({4, 1}, {});
}

TEST(GvtChecker, ObjectsToASendAndToACommitOnTheWrongSide) {
  GvtChecker checker;
  checker.on_gvt({4, 0}, {});
  EXPECT_THROW(checker.on_send(message({4, 0}, 1)), Violation);
  checker.on_send(message({4, 1}, 1));
  EXPECT_THROW(checker.on_commit(LpId{0}, {4, 0}), Violation);
  checker.on_commit(LpId{0}, {3, 9});
}

TEST(WindowChecker, ObjectsToAnExecutionBeyondTheWindow) {
  WindowChecker checker(3);
  EXPECT_THROW(checker.on_execute(LpId{0}, {0, 0}, {}, 0), Violation) << "before the first GVT";
  checker.on_gvt({10, 5}, {});
  checker.on_execute(LpId{0}, {12, 9}, {}, 0);
  checker.on_execute(LpId{0}, {2, 0}, {}, 0);  // coasts
  EXPECT_THROW(checker.on_execute(LpId{0}, {13, 0}, {}, 0), Violation);
}

TEST(ConservationChecker, AcceptsMessagesReplacedAnnihilatedAndConsumed) {
  ConservationChecker checker;
  for (const Message& sent :
       {message({1, 0}, 1), message({1, 0}, 2), message({2, 0}, 3), message({2, 0}, 4, true)}) {
    checker.on_send(sent);
    checker.on_deliver(sent);
  }
  checker.on_execute(LpId{1}, {1, 0}, {&kMember, 1}, 0);
  checker.on_commit(LpId{1}, {1, 0});
  checker.on_end();
}

TEST(ConservationChecker, ObjectsToAnAntiMessageThatAnnihilatesNothing) {
  ConservationChecker checker;
  EXPECT_THROW(checker.on_send(message({1, 0}, 1, true)), Violation);
  checker.on_send(message({1, 0}, 2));
  checker.on_send(message({1, 0}, 3, true));
  EXPECT_THROW(checker.on_send(message({1, 0}, 4, true)), Violation);
}

TEST(ConservationChecker, ObjectsToAMessageThatIsLost) {
  ConservationChecker checker;
  checker.on_send(message({1, 0}, 1));
  EXPECT_THROW(checker.on_end(), Violation) << "on its way";
  checker.on_deliver(message({1, 0}, 1));
  EXPECT_THROW(checker.on_end(), Violation) << "not consumed";
  checker.on_execute(LpId{1}, {1, 0}, {}, 0);
  EXPECT_THROW(checker.on_commit(LpId{1}, {1, 0}), Violation) << "not in the bag";
}

TEST(ConservationChecker, ObjectsToACommitOfWhatWasTakenBackUndoneOrCommitted) {
  ConservationChecker checker;
  checker.on_send(message({1, 0}, 1));
  checker.on_execute(LpId{1}, {1, 0}, {&kMember, 1}, 0);
  checker.on_send(message({1, 0}, 2, true));
  EXPECT_THROW(checker.on_commit(LpId{1}, {1, 0}), Violation) << "taken back";
  checker.on_execute(LpId{1}, {2, 0}, {}, 0);
  checker.on_rewind(LpId{1}, {2, 0});
  EXPECT_THROW(checker.on_commit(LpId{1}, {2, 0}), Violation) << "undone";
  checker.on_execute(LpId{1}, {3, 0}, {}, 0);
  checker.on_commit(LpId{1}, {3, 0});
  EXPECT_THROW(checker.on_commit(LpId{1}, {3, 0}), Violation) << "twice";
}

TEST(TraceChecker, ObjectsToAnotherBagAnotherStateAnotherTimeAndToWhatIsMissing) {
  const CommitTrace oracle = {{}, {{{1, 0}, digest_of({&kMember, 1}), 7}}};
  const auto commit = [&](VirtualTime now, std::span<const MessageView> bag, std::uint64_t state) {
    TraceChecker checker(oracle);
    checker.on_execute(LpId{1}, now, bag, state);
    checker.on_commit(LpId{1}, now);
    checker.on_end();
  };
  commit({1, 0}, {&kMember, 1}, 7);
  EXPECT_THROW(commit({1, 0}, {}, 7), Violation);
  EXPECT_THROW(commit({1, 0}, {&kMember, 1}, 8), Violation);
  EXPECT_THROW(commit({1, 1}, {&kMember, 1}, 7), Violation);
  EXPECT_THROW(TraceChecker(oracle).on_end(), Violation);
}

// Writes down what is asked of it.
class Asked final : public LogicalProcess {
 public:
  explicit Asked(std::string& calls) : calls_(calls) {}
  VirtualTime next_time() const override { return {1, 2}; }
  void execute(VirtualTime now, std::span<const MessageView>, Outbox&) override {
    calls_ += describe("execute ", now, ' ');
  }
  void mark(VirtualTime now) override { calls_ += describe("mark ", now, ' '); }
  VirtualTime rewind(VirtualTime to) override {
    calls_ += describe("rewind ", to, ' ');
    return {3, 0};
  }
  VirtualTime rewind_before(VirtualTime undone, VirtualTime to) override {
    calls_ += describe("rewind_before ", undone, ' ', to, ' ');
    return {4, 0};
  }
  VirtualTime forget(VirtualTime horizon) override {
    calls_ += describe("forget ", horizon, ' ');
    return {5, 0};
  }
  std::span<std::byte> state_bytes() override { return bytes_; }
  void rewound(VirtualTime to) override { calls_ += describe("rewound ", to, ' '); }
  void commit(VirtualTime now) override { calls_ += describe("commit ", now, ' '); }
  std::uint64_t digest() const override { return 77; }

 private:
  std::byte bytes_[8] = {};
  std::string& calls_;
};

class Rewinds final : public RunObserver {
 public:
  void on_rewind(LpId, VirtualTime restart) override { restarts.push_back(restart); }
  std::vector<VirtualTime> restarts;
};

class Nowhere final : public Outbox {
 public:
  void send(LpId, VirtualTime, std::uint32_t, Payload) override {}
  void fault(Fault) override {}
};

TEST(ObservedProcess, ForwardsEveryCallWithItsAnswerAndTellsOfEveryKindOfRewind) {
  std::string calls;
  Asked asked(calls);
  Rewinds observer;
  ObservedProcess lp(LpId{0}, asked, observer);
  Nowhere outbox;
  EXPECT_EQ(lp.next_time(), (VirtualTime{1, 2}));
  EXPECT_EQ(lp.digest(), 77u);
  lp.mark({1, 0});
  lp.execute({1, 0}, {}, outbox);
  EXPECT_EQ(lp.rewind({2, 0}), (VirtualTime{3, 0}));
  EXPECT_EQ(lp.rewind_before({9, 0}, {8, 0}), (VirtualTime{4, 0}));
  EXPECT_EQ(lp.forget({6, 0}), (VirtualTime{5, 0}));
  EXPECT_EQ(lp.state_bytes().data(), asked.state_bytes().data());
  lp.rewound({5, 1});
  lp.commit({7, 0});
  EXPECT_EQ(calls,
            "mark (1, 0) execute (1, 0) rewind (2, 0) rewind_before (9, 0) (8, 0) forget (6, 0) "
            "rewound (5, 1) commit (7, 0) ");
  EXPECT_EQ(observer.restarts, (std::vector<VirtualTime>{{3, 0}, {4, 0}, {5, 1}}));
}

TEST(ObservedProcess, ARunIsTheSameExecutionWithAnObserverAsWithout) {
  std::uint64_t rollbacks = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto execute = [&](RunObserver* observer) {
      const auto lps = make_phold({.lps = 6, .remote_per_mille = 600, .seed = seed});
      return run_virtual(
          lps, {40, 0},
          {.processors = 6, .window = 20, .gvt_interval_ns = 3000, .observer = observer});
    };
    RunObserver nothing;
    const VirtualResult seen = execute(&nothing);
    const VirtualResult unseen = execute(nullptr);
    EXPECT_EQ(seen.report.execution_digest, unseen.report.execution_digest) << "seed " << seed;
    EXPECT_EQ(seen.run.counters.rolled_back, unseen.run.counters.rolled_back) << "seed " << seed;
    rollbacks += seen.run.counters.rollbacks;
  }
  EXPECT_GT(rollbacks, 100u);
}

TEST(TraceRecorder, ATimeWarpRunHasTheTraceOfTheSequentialOne) {
  const PholdOptions model{.lps = 6, .remote_per_mille = 600, .zero_delay_rounds = 2, .seed = 4};
  const auto oracle = make_phold(model);
  TraceRecorder expected(6);
  run_sequential(observed(oracle, expected), {40, 0});
  const auto lps = make_phold(model);
  TraceRecorder found(6);
  const VirtualResult result =
      run_virtual(lps, {40, 0}, {.processors = 6, .window = 9, .observer = &found});
  EXPECT_EQ(found.trace(), expected.trace());
  EXPECT_GT(result.run.counters.rollbacks, 0u);
}

}  // namespace
}  // namespace soda::kernel
