#include "kernel/queues/input_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "kernel/api/hash_mix.hpp"
#include "kernel/queues/message_pool.hpp"

namespace soda::kernel {
namespace {

Message message_at(std::int64_t t, std::uint32_t source, std::uint64_t version, bool anti) {
  const OutputId id{{t, 0}, LpId{0}, 1, 0};
  return {id, LpId{source}, version, anti, anti ? Payload() : Payload::of(version)};
}

// More messages than are kept sorted near the front; executed, undone, annihilated, forgotten.
// What is undone can lie before GVT: it is coasted.
TEST(InputQueue, HoldsTheNewestVersionOfEachMessageInOrder) {
  SplitMix64 random(6);
  MessagePool pool;
  InputQueue queue(pool);
  std::map<std::pair<std::int64_t, std::uint32_t>, Message> plain;
  std::int64_t executed_to = 0;  // everything earlier has been
  std::int64_t kept = 0;
  std::int64_t gvt = 0;          // nothing earlier is sent or annihilated any more
  std::int64_t coast_until = 0;  // as far as it is executed again as it was
  std::uint64_t version = 0;
  SlidingVector<MessageView> bag;
  std::size_t most = 0;
  const auto next_of_plain = [&] {
    for (auto at = plain.lower_bound({executed_to, 0}); at != plain.end(); ++at)
      if (!at->second.anti) return VirtualTime{at->first.first, 0};
    return kNever;
  };
  for (int action = 0; action < 40000; ++action) {
    const std::uint64_t kind = random.below(100);
    if (kind < 78) {
      const std::int64_t t =
          kind < 74 ? std::max({gvt, executed_to, coast_until}) +
                          static_cast<std::int64_t>(random.below(300))
                    : gvt + static_cast<std::int64_t>(random.below(
                                static_cast<std::uint64_t>(std::max(gvt, executed_to) - gvt + 1)));
      coast_until = std::min(coast_until, t);
      const auto source = static_cast<std::uint32_t>(random.below(4));
      const auto found = plain.find({t, source});
      if (found != plain.end() && random.below(8) == 0) {  // overtaken on its way
        const bool anti = random.below(2) == 0;
        ASSERT_FALSE(queue.write(message_at(t, source, found->second.version - 1, anti)));
        continue;
      }
      const Message message = message_at(t, source, version += 2, random.below(5) == 0);
      const bool changes =
          found == plain.end() ? !message.anti : !(message.anti && found->second.anti);
      ASSERT_EQ(queue.write(Message(message)), changes);
      plain.insert_or_assign({t, source}, message);
    } else if (kind < 95) {
      const VirtualTime next = next_of_plain();
      ASSERT_EQ(queue.next_time(), next);
      if (next == kNever) continue;
      const std::uint32_t passed = queue.gather(next, bag);
      std::size_t count = 0;
      for (std::uint32_t source = 0; source < 4; ++source) {
        const auto found = plain.find({next.t, source});
        if (found == plain.end() || found->second.anti) continue;
        ASSERT_LT(count, bag.size());
        ASSERT_EQ(index_of(bag[count].source), source);
        ASSERT_EQ(Payload(bag[count].payload), found->second.payload);
        ++count;
      }
      ASSERT_EQ(bag.size(), count);
      queue.pass(next, passed);
      executed_to = next.t + 1;
    } else if (kind < 98) {
      coast_until = std::max(coast_until, executed_to);
      executed_to -= static_cast<std::int64_t>(
          random.below(static_cast<std::uint64_t>(executed_to - kept + 1)));
      queue.undo({executed_to, 0});
    } else {
      gvt = std::max({gvt, executed_to, coast_until});
      kept += std::max<std::int64_t>(0, (executed_to - kept) / 4);
      queue.forget({kept, 0}, {gvt, 0});
      plain.erase(plain.begin(), plain.lower_bound({kept, 0}));
      std::erase_if(plain,
                    [&](const auto& item) { return item.second.anti && item.first.first < gvt; });
      ASSERT_EQ(queue.has_antis(), std::any_of(plain.begin(), plain.end(),
                                               [](const auto& item) { return item.second.anti; }));
      ASSERT_EQ(queue.size(), plain.size());
    }
    most = std::max(most, plain.size());
  }
  EXPECT_GT(most, 200u);
}

// An LP is put back to an old state while GVT goes on to where it coasts to.
TEST(InputQueue, DropsAnnihilatedMessagesBeforeGvtThoughEarlierOnesAreExecutedAgain) {
  MessagePool pool;
  InputQueue queue(pool);
  SlidingVector<MessageView> bag;
  for (std::int64_t t = 1; t <= 200; ++t) {
    queue.write(message_at(t, 0, static_cast<std::uint64_t>(2 * t), t > 150));
    if (t <= 150) queue.pass({t, 0}, queue.gather({t, 0}, bag));
  }
  queue.undo({1, 0});
  for (std::int64_t t = 201; t <= 300; ++t)
    queue.write(message_at(t, 0, static_cast<std::uint64_t>(2 * t), false));
  queue.forget({1, 0}, {180, 0});
  ASSERT_TRUE(queue.has_antis());
  EXPECT_EQ(queue.first_anti(), (VirtualTime{180, 0}));
  EXPECT_EQ(queue.size(), 300u - 29u);
  queue.forget({1, 0}, {201, 0});
  EXPECT_FALSE(queue.has_antis());
  EXPECT_EQ(queue.size(), 250u);
}

}  // namespace
}  // namespace soda::kernel
