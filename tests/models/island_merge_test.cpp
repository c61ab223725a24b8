#include "models/islands/island_merge.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::ContactManifold;

// A contact graph over bodies with owners, and what each world knows of it: the merge rounds are
// run in lockstep, messages delivered by hand.
struct Network {
  std::vector<WorldId> owners;  // by body
  std::vector<ContactManifold> contacts;
  struct World {
    std::vector<BodyId> ids;
    std::vector<physics::BodyState> states;
    std::vector<ContactManifold> manifolds;
    IslandMerge merge;
  };
  std::vector<World> worlds;
};

physics::BodyState state_of(std::uint32_t body) {
  physics::BodyState state;
  state.position_m = physics::Vec3(body, 0, 0);
  return state;
}

void add_contact(Network& network, std::uint32_t a, std::uint32_t b, std::uint32_t tester) {
  ContactManifold manifold;
  manifold.a = BodyId{a};
  manifold.b = BodyId{b};
  manifold.count = 1;
  network.contacts.push_back(manifold);
  const WorldId owner_a = network.owners[a], owner_b = network.owners[b];
  if (owner_a == owner_b) {  // tested at home
    Network::World& world = network.worlds[index_of(owner_a)];
    const auto is_same = [&](const ContactManifold& known) {
      return known.a == manifold.a && known.b == manifold.b;
    };
    if (std::any_of(world.manifolds.begin(), world.manifolds.end(), is_same)) return;
    world.manifolds.push_back(manifold);
    std::sort(world.manifolds.begin(), world.manifolds.end(), canonical_before);
    return;
  }
  for (const auto& [owner, other] : {std::pair{owner_a, b}, std::pair{owner_b, a}}) {
    Network::World& world = network.worlds[index_of(owner)];
    const Records records{{{BodyId{other}, network.owners[other], state_of(other)}}, {manifold}};
    add_fragment(world.ids, WorldId{tester}, records, world.merge, world.manifolds);
  }
}

Network random_network(std::uint64_t seed, std::uint32_t worlds, std::uint32_t bodies,
                       std::uint32_t contacts) {
  test::Choices choices(seed);
  Network network;
  network.worlds.resize(worlds);
  for (std::uint32_t body = 0; body < bodies; ++body) {
    const auto owner = static_cast<std::uint32_t>(choices.below(worlds));
    network.owners.push_back(WorldId{owner});
    network.worlds[owner].ids.push_back(BodyId{body});
    network.worlds[owner].states.push_back(state_of(body));
  }
  for (std::uint32_t i = 0; i < contacts; ++i) {
    const auto a = static_cast<std::uint32_t>(choices.below(bodies));
    const auto b = static_cast<std::uint32_t>(choices.below(bodies));
    if (a == b) continue;
    add_contact(network, std::min(a, b), std::max(a, b),
                static_cast<std::uint32_t>(choices.below(worlds)));
  }
  return network;
}

// Runs rounds until nobody has anything to send; returns their number.
std::uint32_t run_rounds(Network& network) {
  for (std::uint32_t round = 0;; ++round) {
    struct Mail {
      std::uint32_t from, to;
      Records records;
    };
    std::vector<Mail> mail;
    for (std::uint32_t w = 0; w < network.worlds.size(); ++w) {
      Network::World& world = network.worlds[w];
      const KnownBodies known = known_bodies(world.ids, WorldId{w}, world.merge);
      for (auto& [to, records] :
           outgoing_records(round, WorldId{w}, known, world.states, world.manifolds, world.merge)) {
        mail.push_back({w, index_of(to), std::move(records)});
      }
    }
    if (mail.empty()) return round;
    for (const Mail& letter : mail) {
      Network::World& world = network.worlds[letter.to];
      add_records(world.ids, WorldId{letter.from}, letter.records, world.merge, world.manifolds);
    }
  }
}

// Bodies of the island with the given body, by flooding over `contacts`.
std::set<BodyId> flood(const std::vector<ContactManifold>& contacts, BodyId start) {
  std::set<BodyId> island{start};
  for (bool grown = true; grown;) {
    grown = false;
    for (const ContactManifold& contact : contacts) {
      if (island.contains(contact.a) == island.contains(contact.b)) continue;
      island.insert({contact.a, contact.b});
      grown = true;
    }
  }
  return island;
}

void expect_everybody_knows_their_islands(const Network& network, std::uint64_t seed) {
  for (const Network::World& world : network.worlds) {
    for (const BodyId id : world.ids) {
      const std::set<BodyId> truth = flood(network.contacts, id);
      ASSERT_EQ(flood(world.manifolds, id), truth) << "seed " << seed;
      std::set<RecordKey> true_contacts, known_contacts;
      for (const auto& contact : network.contacts)
        if (truth.contains(contact.a)) true_contacts.insert({contact.a, contact.b});
      for (const auto& contact : world.manifolds)
        if (truth.contains(contact.a)) known_contacts.insert({contact.a, contact.b});
      ASSERT_EQ(known_contacts, true_contacts) << "seed " << seed;
      for (const BodyId member : truth) {
        if (network.owners[index_of(member)] == network.owners[index_of(id)]) continue;
        const auto node = std::find_if(world.merge.nodes.begin(), world.merge.nodes.end(),
                                       [&](const Node& n) { return n.id == member; });
        ASSERT_NE(node, world.merge.nodes.end()) << "seed " << seed;
        ASSERT_TRUE(identical(node->state, state_of(index_of(member))));
      }
    }
  }
}

TEST(IslandMerge, EveryOwnerLearnsItsWholeIslandForAnyContactGraph) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    test::Choices choices(seed * 77);
    const auto worlds = static_cast<std::uint32_t>(1 + choices.below(9));
    const auto bodies = static_cast<std::uint32_t>(2 + choices.below(40));
    Network network =
        random_network(seed, worlds, bodies, static_cast<std::uint32_t>(choices.below(2 * bodies)));
    const std::uint32_t rounds = run_rounds(network);
    EXPECT_LE(rounds, worlds) << "seed " << seed;
    expect_everybody_knows_their_islands(network, seed);
  }
}

// 0 - 1 - 2 - ... - 8, each body in a world of its own. A fragment has told each world of its
// neighbours' bodies, so the last news, of the other end, has seven owners to pass.
TEST(IslandMerge, AChainThroughNineWorldsTakesSevenRounds) {
  Network network;
  network.worlds.resize(9);
  for (std::uint32_t body = 0; body < 9; ++body) {
    network.owners.push_back(WorldId{body});
    network.worlds[body].ids = {BodyId{body}};
    network.worlds[body].states = {state_of(body)};
  }
  for (std::uint32_t body = 0; body + 1 < 9; ++body) add_contact(network, body, body + 1, body);
  EXPECT_EQ(run_rounds(network), 7u);
  expect_everybody_knows_their_islands(network, 0);
}

// Else a record that was withdrawn and its anti-message could follow each other round a cycle of
// owners for ever, each world passing on what is news to the next. Two owners have nothing to tell
// each other beyond what a fragment from a third told both.
TEST(IslandMerge, NothingIsSentAfterAsManyRoundsAsThereAreOwners) {
  for (std::uint32_t owners = 3; owners <= 6; ++owners) {
    for (std::uint32_t round = 0; round < 8; ++round) {
      Network network;  // a chain, of which world 0 knows all and has told nothing
      network.worlds.resize(owners);
      for (std::uint32_t body = 0; body < owners; ++body) {
        network.owners.push_back(WorldId{body});
        network.worlds[body].ids = {BodyId{body}};
        network.worlds[body].states = {state_of(body)};
      }
      for (std::uint32_t body = 0; body + 1 < owners; ++body)
        add_contact(network, body, body + 1, owners);
      Network::World& world = network.worlds[0];
      for (std::uint32_t body = 2; body < owners; ++body) {
        ContactManifold manifold;
        manifold.a = BodyId{body - 1};
        manifold.b = BodyId{body};
        manifold.count = 1;
        add_records(world.ids, WorldId{body},
                    {{{BodyId{body}, WorldId{body}, state_of(body)}}, {manifold}}, world.merge,
                    world.manifolds);
      }
      const KnownBodies known = known_bodies(world.ids, WorldId{0}, world.merge);
      const auto sent =
          outgoing_records(round, WorldId{0}, known, world.states, world.manifolds, world.merge);
      EXPECT_EQ(sent.empty(), round >= owners) << owners << " owners, round " << round;
    }
  }
}

// It comes from a world that takes a body for its own which has moved here. An island of own bodies
// with such a contact would be taken over by repetitions, which no longer hear of it.
TEST(IslandMerge, AContactOfTwoOwnBodiesFromAnotherWorldIsNotBelieved) {
  const std::vector<BodyId> own{BodyId{1}, BodyId{2}};
  for (const BodyId other : {BodyId{2}, physics::static_id(0)}) {
    ContactManifold manifold;
    manifold.a = BodyId{1};
    manifold.b = other;
    manifold.count = 1;
    IslandMerge merge;
    std::vector<ContactManifold> manifolds;
    add_fragment(own, WorldId{3}, {{{BodyId{2}, WorldId{3}, state_of(2)}}, {manifold}}, merge,
                 manifolds);
    EXPECT_TRUE(manifolds.empty());
  }
}

TEST(IslandMerge, NothingIsSentTwiceNorBackToWhoSaidIt) {
  Network network = random_network(11, 4, 30, 40);
  run_rounds(network);
  for (std::uint32_t w = 0; w < 4; ++w) {
    Network::World& world = network.worlds[w];
    const KnownBodies known = known_bodies(world.ids, WorldId{w}, world.merge);
    EXPECT_TRUE(
        outgoing_records(0, WorldId{w}, known, world.states, world.manifolds, world.merge).empty());
  }
}

TEST(IslandMerge, KnownRecordsAreLeftAsTheyAreAndUnknownEndpointsAreDropped) {
  const std::vector<BodyId> own{BodyId{5}};
  IslandMerge merge;
  std::vector<ContactManifold> manifolds;
  ContactManifold known;
  known.a = BodyId{5};
  known.b = BodyId{7};
  known.count = 1;
  known.points[0].separation_m = -0.25;
  add_records(own, WorldId{1}, {{{BodyId{7}, WorldId{1}, state_of(7)}}, {known}}, merge, manifolds);
  ContactManifold other = known;
  other.points[0].separation_m = -0.5;
  ContactManifold dangling = known;
  dangling.b = BodyId{8};
  add_records(own, WorldId{2}, {{{BodyId{7}, WorldId{2}, state_of(1)}}, {other, dangling}}, merge,
              manifolds);
  ASSERT_EQ(manifolds.size(), 1u);
  EXPECT_EQ(manifolds[0].points[0].separation_m, -0.25);
  ASSERT_EQ(merge.nodes.size(), 1u);
  EXPECT_EQ(merge.nodes[0].owner, WorldId{1});
}

}  // namespace
}  // namespace soda::models
