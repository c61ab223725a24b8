// Jump forward: what a rollback has undone is revalidated where it would come out as before.
#include <gtest/gtest.h>

#include <map>

#include "kernel/time_warp/time_warp_process.hpp"
#include "tests/kernel/time_warp_bench.hpp"

namespace soda::kernel {
namespace {

using namespace bench;

// Adds up what it receives. Runs at 0, 5, 10 .. 25 by itself, can restart at 0, 10, 20, and keeps
// the sums that it had there when they are undone.
class Adder final : public LogicalProcess {
 public:
  struct Script {};
  explicit Adder(Script) {}

  VirtualTime next_time() const override { return next_ < 30 ? at(next_) : kNever; }
  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox&) override {
    executions.push_back(now);
    for (const MessageView& message : bag) sum += number_in(message.payload);
    while (next_ <= now.t) next_ += 5;
  }
  void mark(VirtualTime now) override {
    if (now.t % 10 == 0) points_[now.t] = sum;
  }
  VirtualTime rewind(VirtualTime to) override {
    next_ = to.t / 10 * 10;
    for (auto point = points_.upper_bound(next_); point != points_.end();
         point = points_.erase(point))
      undone_[point->first] = point->second;
    sum = points_.at(next_);
    return at(next_);
  }
  VirtualTime forget(VirtualTime) override { return at(0); }
  void commit(VirtualTime) override {}

  bool jumps() const override { return true; }
  bool is_as_before() const override {
    const auto point = undone_.find(next_);
    return point != undone_.end() && point->second == sum;
  }
  void jump(VirtualTime limit) override {
    for (; undone_.contains(next_ + 10) && at(next_ + 10) <= limit; next_ += 10) {
      points_[next_] = sum;
      sum = undone_.at(next_ + 10);
    }
  }

  std::uint64_t sum = 0;
  Times executions;

 private:
  std::int64_t next_ = 0;
  std::map<std::int64_t, std::uint64_t> points_, undone_;  // sums before what runs then
};
using AdderBench = BenchOf<Adder>;

TEST(JumpForward, StepsThatWouldComeOutAsTheyDidAreNotExecutedAgain) {
  AdderBench bench({});
  bench.deliver(at(12), 100, 1);
  bench.execute_all();
  bench.lp.executions.clear();
  bench.deliver(at(7), 0, 2);
  bench.execute_all();
  EXPECT_EQ(bench.lp.executions, (Times{at(0), at(5), at(7), at(20), at(25)}));
  EXPECT_EQ(bench.lp.sum, 100u);
  EXPECT_EQ(bench.effects.counters.jumps, 1u);
}

TEST(JumpForward, EndsAtTheFirstInputThatHasChanged) {
  AdderBench bench({});
  bench.execute_all();
  bench.deliver(at(17), 40, 1);
  bench.deliver(at(7), 0, 2);
  bench.execute_all();
  EXPECT_EQ(bench.lp.sum, 40u);
}

TEST(JumpForward, IsNotOverWhatCameBeforeHalfAStepExecutedSince) {
  AdderBench bench({});
  bench.execute_all();
  bench.deliver(at(12), 100, 1);
  bench.process.execute(bench.effects);
  bench.process.execute(bench.effects);
  ASSERT_EQ(bench.lp.executions.back(), at(12)) << "the step from 10 is half done";
  bench.deliver(at(7), 0, 2);
  bench.execute_all();
  EXPECT_EQ(bench.lp.sum, 100u);
}

TEST(JumpForward, IsNotFromAnotherState) {
  AdderBench bench({});
  bench.deliver(at(12), 100, 1);
  bench.execute_all();
  bench.deliver(at(7), 1, 2);
  bench.execute_all();
  EXPECT_EQ(bench.lp.sum, 101u);
  EXPECT_EQ(bench.effects.counters.jumps, 0u);
}

}  // namespace
}  // namespace soda::kernel
