#include "models/transform_buffer/shared_list.hpp"

#include <gtest/gtest.h>

#include <map>

#include "models/transform_buffer/stored_entry.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::ContactManifold;

// Manifolds have several items of one key.
using List = SharedList<ContactManifold>;

ContactManifold manifold(std::uint32_t a, std::uint32_t b, double separation_m = 0.0) {
  ContactManifold made;
  made.a = BodyId{a};
  made.b = BodyId{b};
  made.count = 1;
  made.points[0].separation_m = separation_m;
  return made;
}

TEST(SharedList, HasWhatItWasMadeOfWhateverItSharesWith) {
  test::Choices choices(5);
  SharedMemory memory;
  {
    List list;
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> expected;
    for (int version = 0; version < 300; ++version) {
      for (int change = 0; change < 5; ++change) {
        const std::pair key(static_cast<std::uint32_t>(choices.below(200)),
                            static_cast<std::uint32_t>(choices.below(4)));
        if (choices.below(3) == 0)
          expected.erase(key);
        else
          expected[key] = choices.below(2) == 0 ? 0.0 : -0.0;
      }
      std::vector<ContactManifold> items;
      for (const auto& [key, value] : expected)
        items.push_back(manifold(key.first, key.second, value));
      list = List(memory, items, list);
      ASSERT_EQ(list.size(), items.size());
      std::size_t next = 0;
      list.for_each([&](const ContactManifold& item) {
        EXPECT_TRUE(ListItem<ContactManifold>::same(item, items[next])) << version;
        ++next;
      });
      List::Cursor cursor(list);
      for (std::uint32_t key = 0; key < 200; ++key) {
        std::size_t count = 0;
        for (std::uint32_t b = 0; b < 4; ++b) count += expected.contains({key, b});
        ASSERT_EQ(list.range(BodyId{key}).size(), count) << version << " " << key;
        const ContactManifold* const first = list.find(BodyId{key});
        ASSERT_EQ(first != nullptr, count > 0);
        ASSERT_EQ(cursor.advance_to(BodyId{key}), first);
      }
    }
    EXPECT_GT(memory.live_bytes, 0u);
  }
  EXPECT_EQ(memory.live_bytes, 0u) << "all is given back";
}

TEST(SharedList, AnEqualListTakesNoMemoryAndAChangedItemItsChunkAndTheTable) {
  SharedMemory memory;
  std::vector<ContactManifold> items;
  for (std::uint32_t a = 0; a < 2000; ++a) items.push_back(manifold(a, a + 1));
  const List first(memory, items, {});
  const std::uint64_t whole = memory.taken_bytes;
  const List equal(memory, items, first);
  EXPECT_EQ(memory.taken_bytes, whole);
  items[1000].points[0].separation_m = -0.0;
  const List changed(memory, items, equal);
  EXPECT_GT(memory.taken_bytes, whole);
  EXPECT_LT(memory.taken_bytes - whole, whole / 20);
}

}  // namespace
}  // namespace soda::models
