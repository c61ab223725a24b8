// Parts of a world by themselves: who arrives, and whom it waits for.
#include <gtest/gtest.h>

#include "models/world/arrivals.hpp"
#include "models/world/dependency_waits.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

BodyState at(double x) {
  BodyState state;
  state.position_m = Vec3(x, 0, 0);
  return state;
}

kernel::MessageView message_of(std::uint32_t source, MessageKind kind,
                               const kernel::Payload& payload) {
  return {kernel::LpId{source}, static_cast<std::uint32_t>(kind), 0, payload.bytes()};
}

TEST(Arrivals, SourcesAreThoseThatSentABody) {
  const std::vector<Migrant> one = {{BodyId{4}, at(1)}};
  const kernel::Payload none = encode_migrants({}), some = encode_migrants(one),
                        cells = encode_transfers(std::vector<CellTransfer>(2));
  const std::vector<kernel::MessageView> bag = {message_of(1, MessageKind::kMigrants, none),
                                                message_of(2, MessageKind::kMigrants, some),
                                                message_of(3, MessageKind::kTransfers, cells)};
  const Arrivals arrivals = read_arrivals(bag);
  EXPECT_EQ(arrivals.sources, (std::vector<WorldId>{WorldId{2}}));
  ASSERT_EQ(arrivals.migrants.size(), 1u);
  EXPECT_EQ(arrivals.migrants[0].id, BodyId{4});
  EXPECT_EQ(arrivals.transfers.size(), 2u);
}

TEST(Arrivals, OwnBodiesWinThenTheLowestSource) {
  std::vector<BodyId> ids = {BodyId{2}, BodyId{5}};
  std::vector<BodyState> states = {at(2), at(5)};
  const std::vector<Migrant> joined = merge_migrants(
      {{BodyId{5}, at(50)}, {BodyId{3}, at(31)}, {BodyId{3}, at(32)}, {BodyId{1}, at(1)}}, ids,
      states);
  EXPECT_EQ(ids, (std::vector<BodyId>{BodyId{1}, BodyId{2}, BodyId{3}, BodyId{5}}));
  std::vector<double> places;
  for (const BodyState& state : states) places.push_back(state.position_m.x());
  EXPECT_EQ(places, (std::vector<double>{1, 2, 31, 5}));
  ASSERT_EQ(joined.size(), 2u);
  EXPECT_EQ(joined[0].id, BodyId{1});
  EXPECT_EQ(joined[1].state.position_m.x(), 31.0);
}

TEST(Arrivals, WhoseCentreIsInNoOwnCellIsDropped) {
  const WorldId west{0}, east{1};
  const TerritoryMap map{Grid{Vec3(-16, -8, -8), 16.0, {2, 1, 1}}, 2, {west, east}};
  std::vector<BodyId> ids = {BodyId{1}, BodyId{2}, BodyId{3}};
  std::vector<BodyState> states = {at(3), at(-3), at(0)};
  drop_foreign(map, east, ids, states);
  EXPECT_EQ(ids, (std::vector<BodyId>{BodyId{1}, BodyId{3}}));
  drop_foreign(map, west, ids, states);
  EXPECT_TRUE(ids.empty() && states.empty());
}

TEST(DependencyWaits, TheNextStepWaitsForWhoHasMatteredInThisOne) {
  DependencyWaits waits(true, WorldId{1});
  Dependencies before;
  before.left_to = {WorldId{5}};
  waits.start(before);
  waits.note_migrants_from(std::vector<WorldId>{WorldId{7}, WorldId{3}});
  std::map<WorldId, std::vector<Migrant>> leaving = {{WorldId{4}, {}}};
  waits.note_migrants_to(leaving);
  EXPECT_TRUE(leaving.contains(WorldId{3}) && leaving.contains(WorldId{5}));
  EXPECT_EQ(leaving.size(), 4u);
  waits.note_tester(WorldId{2});
  waits.note_records_to(3, WorldId{6});
  const Dependencies next = waits.next();
  EXPECT_EQ(next.left_to, (std::vector<WorldId>{WorldId{4}}));
  EXPECT_EQ(next.migrants, (std::vector<WorldId>{WorldId{3}, WorldId{5}, WorldId{7}}));
  waits.start(next);
  EXPECT_EQ(waits.expected().fragments_from, (std::vector<WorldId>{WorldId{2}}));
  EXPECT_EQ(waits.partners_in(3), (std::vector<WorldId>{WorldId{6}}));
  EXPECT_TRUE(waits.partners_in(2).empty());
}

TEST(DependencyWaits, OffNothingIsKept) {
  DependencyWaits waits(false, WorldId{1});
  waits.start({});
  waits.note_migrants_from(std::vector<WorldId>{WorldId{7}});
  std::map<WorldId, std::vector<Migrant>> leaving = {{WorldId{4}, {}}};
  waits.note_migrants_to(leaving);
  waits.note_tester(WorldId{2});
  waits.note_tested_for(WorldId{2});
  waits.note_records_to(1, WorldId{2});
  waits.note_records_from(1, WorldId{2});
  waits.note_island(std::vector<BodyId>{BodyId{1}, BodyId{2}},
                    std::vector<WorldId>{WorldId{1}, WorldId{2}});
  EXPECT_EQ(leaving.size(), 1u);
  EXPECT_EQ(waits.next(), Dependencies{});
}

}  // namespace
}  // namespace soda::models
