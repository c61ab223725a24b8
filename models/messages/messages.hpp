// Message payloads and their encoding: named fields, little-endian, no padding.
#pragma once

#include <span>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/api/message.hpp"
#include "models/territory/territory.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/scene.hpp"
#include "physics/step/sent_on.hpp"

namespace soda::models {

// A body on its way to a new owner.
struct Migrant {
  physics::BodyId id{};
  physics::BodyState state;
};

// A read-only copy of a foreign body. The owner travels with it: derived from the map it would be
// wrong while the body changes hands.
struct Ghost {
  physics::BodyId id{};
  WorldId owner{};
  physics::Aabb box;  // swept; what the owner's border test used
  physics::BodyState state;
};

// A body that an impact has sent on, where it ends, and the linked label of its island
// (physics/step/sent_on.hpp): its ghost's box is that of all its ways.
struct SentBody {
  Ghost ghost;
  physics::BodyState end;
  physics::BodyId linked = physics::kNotLinked;
};

// Bitwise equality of every field.
bool identical(const Ghost& a, const Ghost& b);

// Records of islands: foreign bodies and contacts, in fragments as in merge rounds.
struct Node {
  physics::BodyId id{};
  WorldId owner{};
  physics::BodyState state;
};
struct Records {
  std::vector<Node> nodes;                          // ascending by id
  std::vector<physics::ContactManifold> manifolds;  // canonical order
};

// What a world sends another one of cross-owner contacts, once a step.
struct Fragment {
  struct OfGroup {
    physics::BodyId label{};  // of the group (dependencies.hpp)
    Records records;
  };
  Records records;              // contacts with a body of the receiver that the sender has tested
  std::vector<OfGroup> groups;  // ascending by label
};

kernel::Payload encode_migrants(std::span<const Migrant> migrants);
kernel::Payload encode_transfers(std::span<const CellTransfer> transfers);
kernel::Payload encode_ghosts(std::span<const Ghost> ghosts);
kernel::Payload encode_sent(std::span<const SentBody> bodies);
kernel::Payload encode_records(const Records& records);
kernel::Payload encode_fragment(const Fragment& fragment);

// Append what the payload holds. A payload that does not decode is a broken program: aborts.
void decode_migrants(std::span<const std::byte> payload, std::vector<Migrant>& out);
void decode_transfers(std::span<const std::byte> payload, std::vector<CellTransfer>& out);
void decode_ghosts(std::span<const std::byte> payload, std::vector<Ghost>& out);
void decode_sent(std::span<const std::byte> payload, std::vector<SentBody>& out);
Records decode_records(std::span<const std::byte> payload);
Fragment decode_fragment(std::span<const std::byte> payload);

// A message to each world.
void append_for_all(kernel::Message message, std::uint32_t worlds,
                    std::vector<kernel::Message>& out);

// The encoding of an island's whole input, as an exact key for shared solves.
void encode_island(std::span<const physics::BodyId> ids,
                   std::span<const physics::ContactManifold> manifolds,
                   std::span<const physics::BodyState> states, kernel::Bytes& out);
// What the key needs beside, where user input has changed the scene: the materials of the bodies
// and the motors of the joints; appended.
void encode_changeable(const physics::SceneDescription& scene, std::span<const physics::BodyId> ids,
                       std::span<const physics::ContactManifold> manifolds, kernel::Bytes& out);

}  // namespace soda::models
