// One process under Time Warp, driven by hand: what it executes, sends and reports.
#include "kernel/time_warp/time_warp_process.hpp"

#include <gtest/gtest.h>

#include "tests/kernel/time_warp_bench.hpp"

namespace soda::kernel {
namespace {

using namespace bench;

using Texts = std::vector<std::string>;

// At each time, one message that never changes (kind 0) and one with the sum so far (kind 1).
ScriptedProcess::Script constant_and_sum() {
  return {.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    outbox.send(kPeer, at(now.t + 10), 0, number(1));
    outbox.send(kPeer, at(now.t + 10), 1, number(self.state.sum));
  }};
}

TEST(TimeWarp, StragglerRestoresStateBeforeItAndResendsOnlyChangedMessages) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 100, 1);
  bench.deliver(at(3), 300, 2);
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(),
            (Texts{"+(11, 0) k0=1", "+(11, 0) k1=100", "+(13, 0) k0=1", "+(13, 0) k1=400"}));
  bench.deliver(at(2), 20, 3);
  EXPECT_EQ(bench.lp.state.sum, 0u) << "the newest saved state not after 2 is that before 1";
  bench.execute_all();
  EXPECT_EQ(bench.lp.state.sum, 420u);
  EXPECT_EQ(bench.lp.executions, (Times{at(1), at(3), at(1), at(2), at(3)}));
  EXPECT_EQ(bench.take_outgoing(), (Texts{"+(12, 0) k0=1", "+(12, 0) k1=120", "+(13, 0) k1=420"}));
  EXPECT_EQ(bench.effects.counters.adopted, 3u);
  EXPECT_EQ(bench.effects.counters.rollbacks, 1u);
  EXPECT_EQ(bench.effects.counters.rolled_back, 2u);
  EXPECT_EQ(bench.effects.counters.stragglers, 1u);
}

TEST(TimeWarp, LateBagMemberOfTheSameTimeIsAStragglerAndBagsAreInCanonicalOrder) {
  std::vector<std::string> bags;
  Bench bench({.on_execute = [&](auto&, VirtualTime, auto bag, Outbox&) {
    std::string text;
    for (const MessageView& m : bag) text += describe(m.slot, ':', number_in(m.payload), ' ');
    bags.push_back(text);
  }});
  bench.deliver(at(1), 5, 2, 1);
  bench.execute_all();
  bench.deliver(at(1), 4, 1, 0);
  bench.execute_all();
  EXPECT_EQ(bags, (Texts{"1:5 ", "0:4 1:5 "}));
  EXPECT_EQ(bench.lp.state.sum, 9u);
}

TEST(TimeWarp, BagsOfWhatWaitsAreInCanonicalOrderWhateverTheOrderOfArrival) {
  std::vector<std::size_t> arrival = {0, 1, 2, 3, 4, 5};  // (source, kind, slot), numbered in order
  do {
    std::vector<std::size_t> bag_order;
    Bench bench({.on_execute = [&](auto&, VirtualTime, auto bag, Outbox&) {
      for (const MessageView& m : bag) bag_order.push_back(number_in(m.payload));
    }});
    for (const std::size_t i : arrival) {
      const auto at_place = static_cast<std::uint32_t>(i);
      bench.process.deliver({{at(1), kSelf, at_place % 3 / 2, at_place % 3 % 2},
                             LpId{1 + at_place / 3},
                             i + 1,
                             false,
                             number(i)},
                            bench.effects);
      bench.process.settle(bench.effects);
    }
    bench.execute_all();
    ASSERT_EQ(bag_order, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  } while (std::next_permutation(arrival.begin(), arrival.end()));
}

TEST(TimeWarp, AntiMessageAnnihilatesWhatHasNotBeenExecuted) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 100, 1);
  bench.deliver_anti(at(1), 2);
  EXPECT_EQ(bench.process.next_time(), kNever);
  bench.execute_all();
  EXPECT_EQ(bench.lp.executions, Times{});
}

TEST(TimeWarp, IdleProcessCancelsWhatItsUndoneExecutionSent) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 100, 1);
  bench.execute_all();
  bench.take_outgoing();
  bench.deliver_anti(at(1), 2);
  EXPECT_EQ(bench.process.next_time(), kNever);
  EXPECT_EQ(bench.take_outgoing(), (Texts{"-(11, 0) k0", "-(11, 0) k1"}));
}

TEST(TimeWarp, CancelsAsSoonAsTheNextTimeLiesBeyondTheSendTime) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 100, 1);
  bench.deliver(at(3), 300, 2);
  bench.execute_all();
  bench.take_outgoing();
  bench.deliver_anti(at(1), 3);
  EXPECT_EQ(bench.process.next_time(), at(3));
  EXPECT_EQ(bench.take_outgoing(), (Texts{"-(11, 0) k0", "-(11, 0) k1"}));
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), (Texts{"+(13, 0) k1=300"}));
}

TEST(TimeWarp, OlderVersionAfterANewerOneIsIgnored) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 200, 2);
  bench.deliver(at(1), 100, 1);
  bench.execute_all();
  EXPECT_EQ(bench.lp.state.sum, 200u);
  bench.deliver_anti(at(2), 4);
  bench.deliver(at(2), 50, 3);
  EXPECT_EQ(bench.process.next_time(), kNever);
  bench.deliver(at(2), 60, 5);
  EXPECT_EQ(bench.process.next_time(), at(2));
}

TEST(TimeWarp, NewerVersionWithTheSameContentChangesNothing) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 100, 1);
  bench.execute_all();
  bench.deliver(at(1), 100, 5);
  bench.deliver_anti(at(1), 4);
  EXPECT_EQ(bench.effects.counters.rollbacks, 0u);
  EXPECT_EQ(bench.lp.executions, Times{at(1)});
  bench.deliver_anti(at(1), 6);
  EXPECT_EQ(bench.effects.counters.rollbacks, 1u);
}

TEST(TimeWarp, AntiMessageWithoutItsMessageCausesNoRollback) {
  Bench bench(constant_and_sum());
  bench.deliver(at(3), 300, 1);
  bench.execute_all();
  bench.deliver_anti(at(2), 3);
  bench.deliver(at(2), 200, 2);
  EXPECT_EQ(bench.effects.counters.rollbacks, 0u);
  bench.deliver(at(4), 400, 4);
  bench.execute_all();
  EXPECT_EQ(bench.lp.executions, (Times{at(3), at(4)}));
  EXPECT_EQ(bench.lp.state.sum, 700u);
}

TEST(TimeWarp, EqualSendFromAnotherTimeIsAdoptedAndThenBelongsToThatTime) {
  // Whoever comes first sends the greeting.
  Bench bench({.on_execute = [](ScriptedProcess& self, VirtualTime, auto bag, Outbox& outbox) {
    if (self.state.sum == number_in(bag[0].payload)) outbox.send(kPeer, at(50), 3, nullptr);
  }});
  bench.deliver(at(3), 1, 1);
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), Texts{"+(50, 0) k3=0"});
  bench.deliver(at(2), 1, 2);
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), Texts{});
  bench.deliver_anti(at(3), 3);
  EXPECT_EQ(bench.take_outgoing(), Texts{});
  bench.deliver_anti(at(2), 4);
  EXPECT_EQ(bench.take_outgoing(), Texts{"-(50, 0) k3"});
}

// Executes at 0 .. 9 by itself and marks at 0 and 5; sends its sum to the peer each time.
ScriptedProcess::Script marks_every_fifth() {
  ScriptedProcess::Script script = constant_and_sum();
  for (std::int64_t t = 0; t < 10; ++t) script.future_events.push_back(at(t));
  script.mark_every_t = 5;
  return script;
}

TEST(TimeWarp, CoastingProcessReportsTheStragglerNotItsRestartPoint) {
  Bench bench(marks_every_fifth());
  bench.execute_all();
  bench.take_outgoing();
  bench.deliver(at(8), 1, 1);
  EXPECT_EQ(bench.process.next_time(), at(5));
  EXPECT_EQ(bench.process.floor(), at(8));
  for (int i = 0; i < 3; ++i) {
    bench.process.execute(bench.effects);
    EXPECT_EQ(bench.process.floor(), at(8));
  }
  EXPECT_EQ(bench.take_outgoing(), Texts{});
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), (Texts{"+(18, 0) k1=1", "+(19, 0) k1=1"}));
}

TEST(TimeWarp, ChangeBeforeTheStragglerLowersTheFloorOfACoastingProcess) {
  Bench bench(marks_every_fifth());
  bench.execute_all();
  bench.take_outgoing();
  bench.deliver(at(8), 1, 1);
  bench.process.execute(bench.effects);
  bench.deliver(at(7), 1, 2);
  EXPECT_EQ(bench.process.next_time(), at(6));
  EXPECT_EQ(bench.process.floor(), at(7));
  bench.process.execute(bench.effects);
  bench.deliver(at(6), 1, 3);
  EXPECT_EQ(bench.process.next_time(), at(5));
  EXPECT_EQ(bench.process.floor(), at(6));
  bench.execute_all();
  EXPECT_EQ(bench.lp.state.sum, 3u);
  EXPECT_EQ(bench.take_outgoing(),
            (Texts{"+(16, 0) k1=1", "+(17, 0) k1=2", "+(18, 0) k1=3", "+(19, 0) k1=3"}));
}

TEST(TimeWarp, AnAntiMessageBeforeTheStragglerLowersTheFloorOfACoastingProcess) {
  Bench bench(marks_every_fifth());
  bench.deliver(at(7), 1, 1);
  bench.execute_all();
  bench.take_outgoing();
  bench.deliver(at(8), 1, 2);
  bench.process.execute(bench.effects);
  bench.deliver_anti(at(7), 3);
  EXPECT_EQ(bench.process.next_time(), at(6));
  EXPECT_EQ(bench.process.floor(), at(7));
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), Texts{"+(17, 0) k1=0"});
}

TEST(TimeWarp, RestartBehindGvtCommitsOnceAndInOrder) {
  Bench bench(marks_every_fifth());
  bench.execute_all();
  bench.advance_gvt(at(8));
  EXPECT_EQ(bench.lp.commits.size(), 8u);
  bench.deliver(at(8), 1, 1);
  EXPECT_EQ(bench.process.next_time(), at(5));
  bench.execute_all();
  bench.advance_gvt(kNever);
  Times expected;
  for (std::int64_t t = 0; t < 10; ++t) expected.push_back(at(t));
  EXPECT_EQ(bench.lp.commits, expected);
}

TEST(TimeWarp, TimesThatGvtPassesWhileTheyAreExecutedAgainAreCommittedLater) {
  Bench bench(marks_every_fifth());
  bench.execute_all();
  bench.deliver(at(9), 1, 1);
  EXPECT_EQ(bench.process.floor(), at(9));
  bench.advance_gvt(at(9));
  EXPECT_EQ(bench.lp.commits.size(), 5u);
  bench.execute_all();
  bench.advance_gvt(kNever);
  Times expected;
  for (std::int64_t t = 0; t < 10; ++t) expected.push_back(at(t));
  EXPECT_EQ(bench.lp.commits, expected);
}

TEST(TimeWarp, WhatIsExecutedAgainBehindGvtIsCommittedBeforeItIsCollected) {
  Bench bench(marks_every_fifth());
  bench.execute_all();
  bench.deliver(at(9), 1, 1);
  bench.advance_gvt(at(9));
  bench.execute_all();
  EXPECT_EQ(bench.lp.commits.size(), 5u);
  bench.process.collect(at(9), bench.effects);
  EXPECT_EQ(bench.lp.commits.size(), 9u);
  bench.process.commit(kEnd, bench.effects);
  Times expected;
  for (std::int64_t t = 0; t < 10; ++t) expected.push_back(at(t));
  EXPECT_EQ(bench.lp.commits, expected);
}

TEST(TimeWarp, MessageForAFreeTimeNeedsNoSettling) {
  Bench bench(constant_and_sum());
  const auto deliver = [&](VirtualTime time, std::uint64_t version) {
    return bench.process.deliver({{time, kSelf, 7, 0}, LpId{2}, version, false, number(1)},
                                 bench.effects);
  };
  EXPECT_FALSE(deliver(at(5), 1));
  EXPECT_EQ(bench.process.next_time(), at(5));
  EXPECT_EQ(bench.process.floor(), at(5));
  bench.execute_all();
  EXPECT_TRUE(deliver(at(4), 2)) << "it rolls back";
}

TEST(TimeWarp, ChangeBetweenTheLastExecutedTimeAndTheRestartPointRollsBackFurther) {
  Bench bench(constant_and_sum());
  bench.deliver(at(1), 1, 1);
  bench.deliver(at(5), 5, 2);
  bench.execute_all();
  bench.deliver_anti(at(5), 3);
  bench.deliver(at(3), 3, 4);
  bench.execute_all();
  bench.deliver(at(5), 50, 5);
  bench.execute_all();
  bench.deliver(at(4), 4, 6);
  bench.execute_all();
  EXPECT_EQ(bench.lp.state.sum, 1u + 3u + 4u + 50u);
}

TEST(TimeWarp, SlotOfAMessageStaysTakenWhenItsSendTimeHasBeenForgotten) {
  ScriptedProcess::Script script{.on_execute = [](auto&, VirtualTime, auto, Outbox& outbox) {
    outbox.send(kPeer, at(50), 4, number(9));
  }};
  for (std::int64_t t = 0; t < 3; ++t) script.future_events.push_back(at(10 * t));
  Bench bench(script);
  bench.process.execute(bench.effects);
  bench.process.execute(bench.effects);
  bench.advance_gvt(at(20));
  bench.process.execute(bench.effects);
  EXPECT_EQ(bench.take_outgoing(), (Texts{"+(50, 0) k4=9", "+(50, 0) k4.1=9", "+(50, 0) k4.2=9"}));
}

// More than the few outputs that are looked through, so that some have entered the slot table.
TEST(TimeWarp, SlotsOfManyUndoneSendsAreFreeAgain) {
  Bench bench({.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    for (std::uint32_t kind = 0; kind < 6; ++kind)
      outbox.send(kPeer, at(now.t + 10), kind, number(self.state.sum));
  }});
  bench.deliver(at(1), 100, 1);
  bench.execute_all();
  bench.take_outgoing();
  bench.deliver(at(1), 20, 1, 1);
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(),
            (Texts{"+(11, 0) k0=120", "+(11, 0) k1=120", "+(11, 0) k2=120", "+(11, 0) k3=120",
                   "+(11, 0) k4=120", "+(11, 0) k5=120"}));
}

TEST(TimeWarp, ForgettingKeepsWhatARestartNeedsAndDropsTheRest) {
  Bench bench(marks_every_fifth());
  for (std::int64_t t = 0; t < 10; ++t) bench.deliver(at(t), 1, static_cast<std::uint64_t>(t) + 1);
  bench.deliver(at(6), 1, 11, 1);
  bench.deliver_anti(at(6), 12, 1);
  bench.execute_all();
  bench.advance_gvt(at(7));
  const TimeWarpProcess::HistorySize size = bench.process.history_size();
  EXPECT_EQ(size.inputs, 5u);  // of 5 .. 9, without the annihilated one
  EXPECT_EQ(size.executed, 5u);
  EXPECT_EQ(size.outputs, 10u);
  EXPECT_EQ(bench.lp.history.size(), 1u);
  bench.deliver(at(7), 100, 20);
  bench.execute_all();
  EXPECT_EQ(bench.lp.state.sum, 109u);
}

TEST(TimeWarp, FaultStandsUntilItsExecutionIsUndoneForGood) {
  ScriptedProcess::Script script = marks_every_fifth();
  script.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    if (now.t >= 6 && self.state.sum == 0) outbox.fault({7, describe("nothing by ", now)});
  };
  Bench bench(script);
  bench.execute_all();
  ASSERT_TRUE(bench.process.first_fault());
  EXPECT_EQ(bench.process.first_fault()->when, at(6));
  EXPECT_EQ(bench.process.first_fault()->fault.what, "nothing by (6, 0)");
  bench.deliver(at(8), 1, 1);
  EXPECT_EQ(bench.process.next_time(), at(5));
  ASSERT_TRUE(bench.process.first_fault()) << "it will come out again: 6 is before the straggler";
  EXPECT_EQ(bench.process.first_fault()->when, at(6));
  bench.execute_all();
  EXPECT_EQ(bench.process.first_fault()->when, at(6));
  bench.deliver(at(6), 1, 2);
  EXPECT_FALSE(bench.process.first_fault());
  bench.execute_all();
  EXPECT_FALSE(bench.process.first_fault());
}

TEST(TimeWarpDeathTest, SendThatIsNotLaterAborts) {
  Bench bench(
      {.future_events = {at(5)}, .on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
         outbox.send(kPeer, now, 3, nullptr);
       }});
  EXPECT_DEATH(bench.execute_all(), "LP 0 executing \\(5, 0\\) sends kind 3 to LP 1 at \\(5, 0\\)");
}

TEST(TimeWarpDeathTest, SendToAnLpThatDoesNotExistAborts) {
  Bench bench(
      {.future_events = {at(5)}, .on_execute = [](auto&, VirtualTime, auto, Outbox& outbox) {
         outbox.send(LpId{3}, at(6), 3, nullptr);
       }});
  EXPECT_DEATH(bench.execute_all(), "sends to LP 3 of 3");
}

TEST(TimeWarpDeathTest, HandlerThatIsNotAPureFunctionAborts) {
  int calls = 0;
  ScriptedProcess::Script script = marks_every_fifth();
  script.on_execute = [&calls](auto&, VirtualTime now, auto, Outbox& outbox) {
    outbox.send(kPeer, at(now.t + 10), 0, number(static_cast<std::uint64_t>(++calls)));
  };
  Bench bench(script);
  bench.execute_all();
  bench.deliver(at(8), 1, 1);
  EXPECT_DEATH(bench.execute_all(), "LP 0 executing \\(5, 0\\).*not a pure function");
}

TEST(TimeWarpDeathTest, MessageBehindGvtAborts) {
  Bench bench(marks_every_fifth());
  bench.execute_all();
  bench.advance_gvt(at(7));
  EXPECT_DEATH(bench.deliver(at(6), 1, 1), "behind GVT \\(7, 0\\)");
}

}  // namespace
}  // namespace soda::kernel
