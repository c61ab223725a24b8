// A process on its way back to where it was: what else comes meanwhile.
#include <gtest/gtest.h>

#include "tests/kernel/time_warp_bench.hpp"

namespace soda::kernel {
namespace {

using bench::at;
using bench::Bench;
using Texts = std::vector<std::string>;

// It would have to be said that what it repeats may come out differently now.
TEST(TimeWarp, CoastingProcessExecutesNothingAsItArrives) {
  Bench bench({.mark_every_t = 10});
  bench.deliver(at(10), 1, 1);
  bench.deliver(at(12), 1, 2);
  bench.deliver(at(14), 1, 3);
  bench.execute_all();
  EXPECT_TRUE(bench.process.takes_in_order(at(15)));
  bench.deliver(at(13), 1, 4);
  bench.process.execute(bench.effects);
  ASSERT_EQ(bench.process.next_time(), at(12)) << "10 has been repeated, 12 has not";
  EXPECT_FALSE(bench.process.takes_in_order(at(11)));
  bench.execute_all();
  EXPECT_TRUE(bench.process.takes_in_order(at(15)));
}

// Executes 1, 2, 3 and sends what it has received so far to ten later; restarts at 1 always. A late
// member of bag 1 makes no difference to what is sent at 1, but to what is sent later.
ScriptedProcess::Script sums_after_one() {
  return {.future_events = {at(1), at(2), at(3)},
          .on_execute =
              [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
                const std::uint64_t sum = now == at(1) ? 0 : self.state.sum;
                outbox.send(bench::kPeer, {now.t + 10, 0}, 0, number(sum));
              },
          .mark_every_t = 100,
          .on_absorb =
              [](ScriptedProcess& self, VirtualTime now, auto bag) {
                if (now != at(1) || self.next_time() != at(2)) return false;
                self.state.sum = number_in(bag.front().payload);
                return true;
              }};
}

// 1 2 3, then a straggler at 3: back to 1, and 1 2 coast. After 1 its bag changes and is absorbed:
// 2 has not been executed again, so it may and does send something else.
TEST(Absorption, EndsCoastingForWhatHasNotBeenExecutedAgain) {
  Bench bench(sums_after_one());
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), (Texts{"+(11, 0) k0=0", "+(12, 0) k0=0", "+(13, 0) k0=0"}));
  bench.deliver(at(3), 7, 1);
  bench.process.execute(bench.effects);
  EXPECT_EQ(bench.process.next_time(), at(2));
  EXPECT_EQ(bench.process.floor(), at(3)) << "2 coasts";
  bench.deliver(at(1), 5, 2);
  EXPECT_EQ(bench.effects.counters.absorbed, 1u);
  EXPECT_EQ(bench.process.floor(), at(2));
  bench.execute_all();
  EXPECT_EQ(bench.take_outgoing(), (Texts{"+(12, 0) k0=5", "+(13, 0) k0=12"}));
  EXPECT_EQ(bench.effects.counters.rollbacks, 1u);
}

}  // namespace
}  // namespace soda::kernel
