// GVT rounds of two workers that never wait, in every order of what they do.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/gvt/gvt.hpp"
#include "kernel/queues/inbox.hpp"
#include "tests/kernel/every_path.hpp"

namespace soda::kernel {
namespace {

VirtualTime at(std::int64_t t) { return {t, 0}; }

// What a worker has to do with GVT, and nothing else: times stand for events. Its loop is cut where
// another worker can come between.
class RoundsWorker {
 public:
  RoundsWorker(GvtRounds& rounds, Inbox& own, Inbox& other, std::set<std::int64_t> times)
      : rounds_(rounds), part_(rounds), own_(own), other_(other), times_(std::move(times)) {}

  // The next piece of the loop, of `loops`; `random` chooses what is sent. False if none is left.
  bool go_on(std::size_t loops, SplitMix64& random) {
    switch (piece_++ % 3) {
      case 0:
        take_in();
        execute(random);
        break;
      case 1:
        for (const Message& message : staged_) part_.note_sent(message.time);
        if (!staged_.empty()) other_.put(staged_);
        break;
      case 2:
        rounds_.request();
        if (part_.look()) take_part();
        break;
    }
    return piece_ < 3 * loops;
  }

  // Of what lies here, in the own inbox, or is about to be put into the other's.
  VirtualTime floor() {
    take_in();
    VirtualTime floor = times_.empty() ? kNever : at(*times_.begin());
    for (const Message& message : staged_) floor = std::min(floor, message.time);
    return floor;
  }

  VirtualTime gvt() const { return gvt_; }

  void take_part() {
    if (!part_.awaits_outcome()) {
      take_in();
      part_.report({times_.empty() ? kNever : at(*times_.begin()), {}, {}});
      return;
    }
    EXPECT_GE(part_.outcome().gvt, gvt_);
    gvt_ = part_.outcome().gvt;
    if (part_.finish({})) rounds_.end_round();
  }

 private:
  void take_in() {
    std::vector<Message> arrived;
    own_.take(arrived);
    for (const Message& message : arrived) {
      EXPECT_GE(message.time, rounds_.outcome().gvt);
      times_.insert(message.time.t);
    }
  }

  void execute(SplitMix64& random) {
    if (times_.empty()) return;
    const std::int64_t now = *times_.begin();
    times_.erase(times_.begin());
    EXPECT_GE(at(now), rounds_.outcome().gvt);
    const std::int64_t next = now + 1 + static_cast<std::int64_t>(random.below(3));
    if (random.below(3) == 0)
      times_.insert(next);
    else
      staged_.emplace_back(OutputId{at(next), LpId{1}, 0, 0}, LpId{0}, 1, false, Payload{});
  }

  GvtRounds& rounds_;
  GvtPart part_;
  Inbox& own_;
  Inbox& other_;
  std::set<std::int64_t> times_;
  std::vector<Message> staged_;
  std::size_t piece_ = 0;
  VirtualTime gvt_ = kBeginning;
};

struct Seen {
  std::size_t orders = 0;
  std::uint64_t rounds = 0;
  std::int64_t latest_gvt = 0;
};

// GVT is never later than anything that is still to be executed; `seed` chooses what is sent.
void run_in_every_order(std::uint64_t seed, Seen& seen) {
  constexpr std::size_t kLoops = 3;
  EveryPath path;
  do {
    GvtRounds rounds(2, 2);
    std::vector<Inbox> inboxes(2);
    RoundsWorker workers[2] = {{rounds, inboxes[0], inboxes[1], {1, 4}},
                               {rounds, inboxes[1], inboxes[0], {2, 3}}};
    SplitMix64 random[2] = {SplitMix64(2 * seed), SplitMix64(2 * seed + 1)};
    for (const int i : {0, 1, 1, 0}) workers[i].take_part();  // the first round
    bool goes_on[2] = {true, true};
    while (goes_on[0] || goes_on[1]) {
      const std::size_t i = goes_on[0] && goes_on[1] ? path.choose(2) : goes_on[0] ? 0 : 1;
      goes_on[i] = workers[i].go_on(kLoops, random[i]);
    }
    const VirtualTime gvt = std::max(workers[0].gvt(), workers[1].gvt());
    ASSERT_LE(gvt, std::min(workers[0].floor(), workers[1].floor())) << "seed " << seed;
    seen.latest_gvt = std::max(seen.latest_gvt, gvt.t);
    seen.rounds += rounds.rounds();
    ++seen.orders;
  } while (path.next());
}

TEST(GvtRounds, NothingIsLeftBehindGvtInAnyOrderOfTwoWorkers) {
  Seen seen;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) run_in_every_order(seed, seen);
  EXPECT_GT(seen.orders, 100'000u);
  EXPECT_GT(seen.rounds, seen.orders);
  EXPECT_GE(seen.latest_gvt, 3);
}

TEST(GvtRounds, TheNextBeginsWhenAllHaveTakenTheOutcome) {
  GvtRounds rounds(2, 2);
  GvtPart a(rounds), b(rounds);
  EXPECT_TRUE(a.is_asked() && b.is_asked());
  EXPECT_FALSE(a.report({at(5), {}, {}}));
  EXPECT_FALSE(a.is_asked());
  EXPECT_TRUE(b.report({at(4), {}, {}}));
  EXPECT_EQ(a.outcome().gvt, at(4));
  EXPECT_FALSE(a.finish({}));
  EXPECT_FALSE(rounds.request()) << "b has not taken it";
  EXPECT_FALSE(a.is_asked());
  EXPECT_EQ(b.outcome().gvt, at(4));
  EXPECT_TRUE(b.finish({}));
  EXPECT_FALSE(a.is_asked() || b.is_asked()) << "its end was not told";
  EXPECT_TRUE(rounds.end_round());
  EXPECT_TRUE(a.is_asked() && b.is_asked()) << "a has asked for it";
  EXPECT_FALSE(rounds.request()) << "it is under way";
}

TEST(GvtRounds, WhoIsGivenUpIsAsked) {
  GvtRounds rounds(2, 2);
  GvtPart part(rounds);
  part.report({});
  EXPECT_FALSE(part.is_asked());
  rounds.stop_run();
  EXPECT_TRUE(part.is_asked());
}

}  // namespace
}  // namespace soda::kernel
