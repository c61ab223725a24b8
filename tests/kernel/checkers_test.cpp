// Each online checker against a history that keeps its rule and against histories that break it.
#include "kernel/checkers.hpp"

#include <gtest/gtest.h>

#include "kernel/phold.hpp"
#include "kernel/virtual_executor.hpp"

namespace soda::kernel {
namespace {

Message message(VirtualTime time, std::uint64_t incarnation, bool anti = false) {
  Message made;
  made.time = time;
  made.source = LpId{0};
  made.destination = LpId{1};
  made.incarnation = incarnation;
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
