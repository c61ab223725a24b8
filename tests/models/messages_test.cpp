#include "models/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;

physics::BodyState random_state(test::Choices& choices) {
  physics::BodyState state;
  state.position_m = choices.vector(-1e9, 1e9);
  state.orientation = physics::Quat(choices.between(-1, 1), choices.between(-1, 1),
                                    choices.between(-1, 1), choices.between(-1, 1));
  state.linear_velocity_m_s = choices.vector(-1, 1);
  state.angular_velocity_rad_s = choices.vector(-1, 1);
  for (std::uint64_t left = choices.below(4); left > 0; --left) {
    state.impulses.push_back({BodyId{static_cast<std::uint32_t>(choices.next())},
                              static_cast<std::uint32_t>(choices.next()),
                              static_cast<std::uint32_t>(choices.next()), choices.between(0, 1),
                              choices.vector(-1, 1)});
  }
  return state;
}

physics::ContactManifold random_manifold(test::Choices& choices) {
  physics::ContactManifold manifold;
  manifold.a = BodyId{static_cast<std::uint32_t>(choices.next())};
  manifold.b = BodyId{static_cast<std::uint32_t>(choices.next())};
  manifold.part = static_cast<std::uint32_t>(choices.next());
  manifold.count = 1 + static_cast<std::uint32_t>(choices.below(4));
  manifold.normal = choices.vector(-1, 1);
  for (std::uint32_t i = 0; i < manifold.count; ++i) {
    manifold.points[i] = {choices.vector(-1, 1), choices.between(-1, 1),
                          static_cast<std::uint32_t>(choices.next())};
  }
  return manifold;
}

TEST(Messages, MigrantsAndGhostsRoundTripBitForBit) {
  test::Choices choices(1);
  std::vector<Migrant> migrants;
  std::vector<Ghost> ghosts;
  for (std::uint32_t i = 0; i < 20; ++i) {
    migrants.push_back({BodyId{i}, random_state(choices)});
    ghosts.push_back({BodyId{i},
                      WorldId{i * 7},
                      {choices.vector(-9, 0), choices.vector(0, 9)},
                      random_state(choices)});
  }
  migrants[3].state.position_m.x() = -0.0;
  migrants[4].state.position_m.y() = std::nextafter(1.0, 2.0);

  std::vector<Migrant> migrants_back;
  decode_migrants(encode_migrants(migrants).bytes(), migrants_back);
  std::vector<Ghost> ghosts_back;
  decode_ghosts(encode_ghosts(ghosts).bytes(), ghosts_back);

  ASSERT_EQ(migrants_back.size(), migrants.size());
  ASSERT_EQ(ghosts_back.size(), ghosts.size());
  for (std::size_t i = 0; i < migrants.size(); ++i) {
    EXPECT_EQ(migrants_back[i].id, migrants[i].id);
    EXPECT_TRUE(identical(migrants_back[i].state, migrants[i].state));
    EXPECT_EQ(ghosts_back[i].id, ghosts[i].id);
    EXPECT_EQ(ghosts_back[i].owner, ghosts[i].owner);
    EXPECT_EQ(ghosts_back[i].box.min, ghosts[i].box.min);
    EXPECT_EQ(ghosts_back[i].box.max, ghosts[i].box.max);
    EXPECT_TRUE(identical(ghosts_back[i].state, ghosts[i].state));
  }
}

TEST(Messages, RecordsRoundTripAndEqualRecordsEncodeToEqualBytes) {
  test::Choices choices(2);
  Records records;
  for (std::uint32_t i = 0; i < 10; ++i) {
    records.nodes.push_back({BodyId{i}, WorldId{i}, random_state(choices)});
    records.manifolds.push_back(random_manifold(choices));
  }
  // Points beyond `count` are not part of a manifold and must not reach the wire.
  Records same = records;
  for (physics::ContactManifold& manifold : same.manifolds)
    for (std::uint32_t i = manifold.count; i < 4; ++i)
      manifold.points[i].separation_m = std::nan("");

  const Records back = decode_records(encode_records(records).bytes());

  ASSERT_EQ(back.nodes.size(), records.nodes.size());
  ASSERT_EQ(back.manifolds.size(), records.manifolds.size());
  EXPECT_EQ(encode_records(back), encode_records(records));
  EXPECT_EQ(encode_records(same), encode_records(records));
  EXPECT_EQ(back.manifolds[3].normal, records.manifolds[3].normal);
  EXPECT_EQ(back.manifolds[3].points[0].feature, records.manifolds[3].points[0].feature);
}

TEST(MessagesDeathTest, TruncatedPayloadAborts) {
  test::Choices choices(3);
  const std::vector<Migrant> migrants{{BodyId{1}, random_state(choices)}};
  const kernel::Payload payload = encode_migrants(migrants);
  std::vector<Migrant> out;
  EXPECT_DEATH(decode_migrants(payload.bytes().first(payload.size() - 1), out),
               "payload ends early");
}

}  // namespace
}  // namespace soda::models
