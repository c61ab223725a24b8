// Every order there is of the actions of small networks: deliver any message that is on its way,
// execute any LP, collect fossils. Depth-first, each order from the start; after each action GVT is
// checked (omniscient_schedule.hpp), at the end what was committed, against the sequential run.
#include <gtest/gtest.h>

#include <string>

#include "kernel/api/executor.hpp"
#include "kernel/api/hash_mix.hpp"
#include "tests/kernel/every_path.hpp"
#include "tests/kernel/omniscient_schedule.hpp"
#include "tests/kernel/scripted_process.hpp"

namespace soda::kernel {
namespace {

const ScriptedProcess& scripted(const Lps& lps, std::size_t i) {
  return static_cast<const ScriptedProcess&>(*lps[i]);
}

Lps make_lps(std::vector<ScriptedProcess::Script> scripts) {
  Lps lps;
  for (auto& script : scripts) lps.push_back(std::make_unique<ScriptedProcess>(std::move(script)));
  return lps;
}

using Network = std::function<Lps()>;

struct Orders {
  std::size_t all = 0;
  std::size_t with_rollback = 0;
  std::size_t with_anti_message = 0;
  std::size_t with_adoption = 0;
};

// `expected`: how many there are. Stops at the first that goes wrong.
void try_every_order(const Network& network, VirtualTime end, Collect collect, Orders expected) {
  const Lps oracle = network();
  run_sequential(oracle, end);
  EveryPath paths;
  Orders found;
  do {
    const Lps lps = network();
    Schedule schedule(lps, end, collect);
    schedule.run([&](std::size_t choices) { return paths.choose(choices); });
    for (std::size_t i = 0; i < lps.size(); ++i) {
      ASSERT_EQ(scripted(lps, i).commits, scripted(oracle, i).commits) << "order " << found.all;
      ASSERT_EQ(scripted(lps, i).state.sum, scripted(oracle, i).state.sum) << "order " << found.all;
    }
    ASSERT_FALSE(testing::Test::HasFailure()) << "order " << found.all;
    ++found.all;
    found.with_rollback += schedule.counters().rollbacks > 0;
    found.with_anti_message += schedule.counters().anti_messages > 0;
    found.with_adoption += schedule.counters().adopted > 0;
  } while (found.all < 3000000 && paths.next());
  EXPECT_EQ(found.all, expected.all);
  EXPECT_EQ(found.with_rollback, expected.with_rollback);
  EXPECT_EQ(found.with_anti_message, expected.with_anti_message);
  EXPECT_EQ(found.with_adoption, expected.with_adoption);
}

// LP 0 tells LP 1 at (0, 1). If LP 1 runs at (0, 2) without that, it sends LP 0 a false message for
// (0, 3), so that the sum with which LP 0 runs at (1, 0) is wrong, and so is what it then sends. So
// among the orders there are stragglers at both, chains of rollbacks, an anti-message that
// overtakes what it cancels, and an idle LP that must cancel.
Lps teller_and_listener() {
  ScriptedProcess::Script teller{.future_events = {{0, 0}, {1, 0}}};
  teller.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    if (now == VirtualTime{0, 0}) outbox.send(LpId{1}, {0, 1}, 0, number(1));
    if (now.t == 1) outbox.send(LpId{1}, {1, 1}, 0, number(self.state.sum + 1));
  };
  ScriptedProcess::Script listener{.future_events = {{0, 2}}};
  listener.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    if (now == VirtualTime{0, 2} && self.state.sum != 1) outbox.send(LpId{0}, {0, 3}, 0, number(9));
  };
  return make_lps({teller, listener});
}

TEST(EveryOrder, OfTwoLpsWithAFalseMessageCommitsTheSame) {
  try_every_order(teller_and_listener, {3, 0}, Collect::kAtOnce, {84532, 84522, 84522, 83645});
}

// The state depends on the order of the bag.
void take_in_order(ScriptedProcess& self, std::span<const MessageView> bag) {
  for (const MessageView& message : bag)
    self.state.sum = append(self.state.sum, 10 * index_of(message.source) + message.slot);
}

// A tie: what both LPs do at (0, 0) meets at LP 1 at (1, 0), two messages of LP 0 in two slots of
// one id and one of LP 1 itself. What LP 1 then sends depends on their order, and its time on
// their number: with a member missing it is a false message.
Lps two_with_ties() {
  ScriptedProcess::Script first{.future_events = {{0, 0}}};
  first.on_execute = [](ScriptedProcess& self, VirtualTime now, auto bag, Outbox& outbox) {
    take_in_order(self, bag);
    if (now == VirtualTime{0, 0})
      for (const std::uint64_t value : {1, 2}) outbox.send(LpId{1}, {1, 0}, 0, number(value));
  };
  ScriptedProcess::Script second{.future_events = {{0, 0}}};
  second.on_execute = [](ScriptedProcess& self, VirtualTime now, auto bag, Outbox& outbox) {
    take_in_order(self, bag);
    if (now == VirtualTime{0, 0}) outbox.send(LpId{1}, {1, 0}, 0, number(3));
    if (now == VirtualTime{1, 0})
      outbox.send(LpId{0}, {1, bag.size() < 3 ? 2u : 1u}, 0, number(self.state.sum));
  };
  return make_lps({first, second});
}

TEST(EveryOrder, OfTwoLpsWithTiesCommitsTheSame) {
  try_every_order(two_with_ties, {3, 0}, Collect::kAtOnce, {29720, 29700, 29700, 23980});
}

// LP 0 and LP 1 tell LP 2 at the same time. LP 2 wakes then, too; hearing only one of them or none
// it turns to LP 1 instead of LP 0, with its state or with a word that is always the same.
enum class Word { kState, kConstant };

Lps two_tell_a_third(Word word) {
  ScriptedProcess::Script teller{.future_events = {{0, 0}}};
  teller.on_execute = [](ScriptedProcess& self, VirtualTime now, auto bag, Outbox& outbox) {
    take_in_order(self, bag);
    if (now == VirtualTime{0, 0}) outbox.send(LpId{2}, {0, 1}, 0, number(1));
  };
  ScriptedProcess::Script third{.future_events = {{0, 1}}};
  third.on_execute = [word](ScriptedProcess& self, VirtualTime, auto bag, Outbox& outbox) {
    take_in_order(self, bag);
    outbox.send(LpId{bag.size() < 2}, {0, 2}, 0, number(word == Word::kState ? self.state.sum : 7));
  };
  return make_lps({teller, teller, third});
}

TEST(EveryOrder, OfThreeLpsWithTiesCommitsTheSame) {
  try_every_order([] { return two_tell_a_third(Word::kState); }, {3, 0}, Collect::kAtOnce,
                  {30831, 30825, 30825, 0});
}

// Fossils lie about for as long as one likes, so that they may be collected too late, too.
TEST(EveryOrder, OfThreeLpsAndTheCollectionOfFossilsCommitsTheSame) {
  try_every_order([] { return two_tell_a_third(Word::kConstant); }, {3, 0}, Collect::kWhenChosen,
                  {315642, 315492, 315492, 191628});
}

}  // namespace
}  // namespace soda::kernel
