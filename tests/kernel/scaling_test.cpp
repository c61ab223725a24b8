// What an optimistic run on one thread costs beside the sequential one: with very many LPs, and
// with very many messages outstanding. Both in one run, in processor time of this thread.
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <limits>

#include "kernel/api/executor.hpp"
#include "kernel/phold/standard_phold.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace soda::kernel {
namespace {

using Lps = std::vector<std::unique_ptr<LogicalProcess>>;

constexpr double kMostRatio = 4.0;
constexpr std::int64_t kEndless = std::numeric_limits<std::int64_t>::max();

double cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Cost {
  double sequential_s = kEndless, optimistic_s = kEndless;  // the least of a few runs by turns
  std::uint64_t executed = 0, rounds = 0;
};

template <class Make>
Cost cost_of(const Make& make, VirtualTime end, int turns) {
  Cost cost;
  for (int turn = 0; turn < turns; ++turn) {
    const Lps oracle = make();
    double start = cpu_s();
    const RunResult expected = run_sequential(oracle, end);
    cost.sequential_s = std::min(cost.sequential_s, cpu_s() - start);
    const Lps lps = make();
    start = cpu_s();
    const RunResult found = run_threads(lps, end, {.threads = 1, .window = kEndless});
    cost.optimistic_s = std::min(cost.optimistic_s, cpu_s() - start);
    EXPECT_EQ(found.counters.committed, expected.counters.committed);
    cost.executed = found.counters.executed;
    cost.rounds = found.counters.gvt_rounds;
  }
  return cost;
}

TEST(Scaling, AHundredThousandLpsOnOneThreadCostAFewTimesTheSequentialRun) {
  const auto make = [] { return make_standard_phold({.lps = 131'072}); };
  const Cost cost = cost_of(make, {2 * kTicksPerUnit, 0}, 2);
  RecordProperty("sequential_s", std::to_string(cost.sequential_s));
  RecordProperty("optimistic_s", std::to_string(cost.optimistic_s));
  EXPECT_LE(cost.optimistic_s, kMostRatio * cost.sequential_s);
}

// LP 0 sends so many messages, each to a time of its own, before anything else happens.
class Burst final : public SmallProcess<std::uint64_t> {
 public:
  explicit Burst(std::int64_t messages) : messages_(messages) {}
  VirtualTime next_time() const override {
    return state_ == 0 && messages_ > 0 ? VirtualTime{0, 0} : kNever;
  }
  void execute(VirtualTime, std::span<const MessageView> bag, Outbox& outbox) override {
    for (std::int64_t i = 0; state_ == 0 && i < messages_; ++i)
      outbox.send(LpId{1}, {1 + i * 7919 % messages_ * 3, 0}, 0, Payload::of(i));
    state_ += bag.size() + 1;
  }
  void commit(VirtualTime) override {}

 private:
  const std::int64_t messages_;
};

TEST(Scaling, FortyThousandMessagesAheadCostAFewTimesTheSequentialRun) {
  const auto make = [] {
    Lps lps;
    lps.push_back(std::make_unique<Burst>(40'000));
    lps.push_back(std::make_unique<Burst>(0));
    return lps;
  };
  const Cost cost = cost_of(make, {1'000'000, 0}, 5);
  RecordProperty("sequential_s", std::to_string(cost.sequential_s));
  RecordProperty("optimistic_s", std::to_string(cost.optimistic_s));
  EXPECT_LE(cost.optimistic_s, kMostRatio * cost.sequential_s);
}

}  // namespace
}  // namespace soda::kernel
