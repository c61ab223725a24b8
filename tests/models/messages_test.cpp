#include "models/messages/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

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
  for (std::uint64_t left = choices.below(3); left > 0; --left)
    state.broken_joints.push_back(static_cast<std::uint32_t>(choices.next()));
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

// The encoding is the key of shared solves: with an input left out, a world could be given the
// solution of an island that only looks the same. Warm-start impulses above all: two speculative
// versions of an island may differ in them alone.
TEST(Messages, EncodedIslandsDifferWhereAnyInputOfTheSolveDiffers) {
  test::Choices choices(4);
  const std::vector<BodyId> ids{BodyId{2}, BodyId{9}};
  physics::BodyState state = random_state(choices);
  state.broken_joints.clear();
  state.impulses.assign(2, {BodyId{9}, 1, 2, 0.5, physics::Vec3(1, 2, 3)});
  physics::ContactManifold contact = random_manifold(choices);
  contact.count = 2;
  const auto key_of = [&] {
    kernel::Bytes key;
    encode_island(ids, std::vector{contact}, std::vector{state, physics::BodyState{}}, key);
    return key;
  };
  const kernel::Bytes key = key_of();
  const auto expect_difference_from = [&](const kernel::Bytes& key, auto& input, const char* name) {
    const auto before = input;
    if constexpr (std::is_floating_point_v<std::remove_reference_t<decltype(input)>>)
      input = std::nextafter(input, 1e300);
    else
      input = static_cast<std::remove_reference_t<decltype(input)>>(
          static_cast<std::uint32_t>(input) + 1);
    EXPECT_NE(key_of(), key) << name;
    input = before;
    EXPECT_EQ(key_of(), key) << name;
  };
  const auto expect_difference = [&](auto& input, const char* name) {
    expect_difference_from(key, input, name);
  };
  for (int axis = 0; axis < 3; ++axis) {
    expect_difference(state.position_m[axis], "position");
    expect_difference(state.linear_velocity_m_s[axis], "linear velocity");
    expect_difference(state.angular_velocity_rad_s[axis], "angular velocity");
    expect_difference(state.impulses[1].friction_newton_s[axis], "friction impulse");
    expect_difference(contact.normal[axis], "normal");
    expect_difference(contact.points[1].position_m[axis], "point");
  }
  for (int part = 0; part < 4; ++part)
    expect_difference(state.orientation.coeffs()[part], "orientation");
  expect_difference(state.impulses[1].other, "impulse: other body");
  expect_difference(state.impulses[1].part, "impulse: part");
  expect_difference(state.impulses[1].feature, "impulse: feature");
  expect_difference(state.impulses[1].normal_newton_s, "normal impulse");
  expect_difference(contact.a, "first body");
  expect_difference(contact.b, "second body");
  expect_difference(contact.part, "part");
  expect_difference(contact.points[1].separation_m, "separation");
  expect_difference(contact.points[1].feature, "feature");
  state.broken_joints.push_back(0);
  EXPECT_NE(key_of(), key) << "broken joints";
  const kernel::Bytes broken = key_of();
  expect_difference_from(broken, state.broken_joints.back(), "which joint is broken");
  state.broken_joints.pop_back();
  state.impulses.pop_back();
  EXPECT_NE(key_of(), key) << "number of impulses";
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
