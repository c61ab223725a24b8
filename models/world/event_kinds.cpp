#include "models/world/event_kinds.hpp"

#include <algorithm>
#include <vector>

#include "models/messages/codec.hpp"
#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"
#include "models/user_input/user_input.hpp"

namespace soda::models {
namespace {

// By Phase, and by MessageKind.
constexpr const char* kEventKinds[] = {
    "step", "", "border_traversal", "pairs", "sync", "split", "solve", "finish"};
constexpr const char* kMessageKinds[] = {"migration", "ghosts",  "contacts", "records", "input",
                                         "transfer",  "borders", "work",     "blocks",  "sent_on"};

using Ids = std::vector<physics::BodyId>;

void add_records(const Records& records, Ids& ids) {
  for (const Node& node : records.nodes) ids.push_back(node.id);
  for (const physics::ContactManifold& manifold : records.manifolds)
    ids.insert(ids.end(), {manifold.a, manifold.b});
}

void add_fragment(const Fragment& fragment, Ids& ids) {
  add_records(fragment.records, ids);
  for (const Fragment::OfGroup& group : fragment.groups) add_records(group.records, ids);
}

Ids bodies_in(MessageKind kind, std::span<const std::byte> payload) {
  Ids ids;
  std::vector<Migrant> migrants;
  std::vector<Ghost> ghosts;
  std::vector<SentBody> sent;
  if (kind == MessageKind::kMigrants) decode_migrants(payload, migrants);
  if (kind == MessageKind::kGhosts) decode_ghosts(payload, ghosts);
  if (kind == MessageKind::kSent) decode_sent(payload, sent);
  if (kind == MessageKind::kFragments) add_fragment(decode_fragment(payload), ids);
  if (kind == MessageKind::kRecords) add_records(decode_records(payload), ids);
  if (kind == MessageKind::kInputs) ids.push_back(decode_input(payload).body);
  for (const Migrant& migrant : migrants) ids.push_back(migrant.id);
  for (const Ghost& ghost : ghosts) ids.push_back(ghost.id);
  for (const SentBody& body : sent) ids.push_back(body.ghost.id);
  return ids;
}

}  // namespace

std::uint8_t kind_of(kernel::VirtualTime time) { return static_cast<std::uint8_t>(phase_of(time)); }

std::span<const char* const> event_kinds() { return kEventKinds; }
std::span<const char* const> message_kinds() { return kMessageKinds; }

void note_bodies(std::uint32_t kind, std::span<const std::byte> payload, kernel::Bytes& note) {
  if (payload.empty()) return;  // an anti-message whose message has not come
  Ids ids = bodies_in(static_cast<MessageKind>(kind), payload);
  std::erase_if(ids, [](physics::BodyId id) { return physics::is_static(id); });
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  Writer writer(note);
  for (std::size_t i = 0; i < std::min(ids.size(), kMostNoted); ++i) writer.id(ids[i]);
}

}  // namespace soda::models
