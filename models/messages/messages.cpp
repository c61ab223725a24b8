#include "models/messages/messages.hpp"

#include "models/messages/codec.hpp"

namespace soda::models {

using physics::BodyId;
using physics::BodyState;
using physics::ContactManifold;

namespace {

void write_records(const Records& records, Writer& writer) {
  writer.number(static_cast<std::uint32_t>(records.nodes.size()));
  for (const Node& node : records.nodes) {
    writer.id(node.id);
    writer.world(node.owner);
    writer.state(node.state);
  }
  writer.number(static_cast<std::uint32_t>(records.manifolds.size()));
  for (const ContactManifold& manifold : records.manifolds) writer.manifold(manifold);
}

Records read_records(Reader& reader) {
  Records records;
  records.nodes.resize(reader.number<std::uint32_t>());
  for (Node& node : records.nodes) {
    node.id = reader.id();
    node.owner = reader.world();
    node.state = reader.state();
  }
  records.manifolds.resize(reader.number<std::uint32_t>());
  for (ContactManifold& manifold : records.manifolds) manifold = reader.manifold();
  return records;
}

void write_ghost(const Ghost& ghost, Writer& writer) {
  writer.id(ghost.id);
  writer.world(ghost.owner);
  writer.vector(ghost.box.min);
  writer.vector(ghost.box.max);
  writer.state(ghost.state);
}

Ghost read_ghost(Reader& reader) {
  Ghost ghost;
  ghost.id = reader.id();
  ghost.owner = reader.world();
  ghost.box.min = reader.vector();
  ghost.box.max = reader.vector();
  ghost.state = reader.state();
  return ghost;
}

}  // namespace

bool identical(const Ghost& a, const Ghost& b) {
  return a.id == b.id && a.owner == b.owner && physics::identical(a.box, b.box) &&
         physics::identical(a.state, b.state);
}

kernel::Payload encode_migrants(std::span<const Migrant> migrants) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(static_cast<std::uint32_t>(migrants.size()));
  for (const Migrant& migrant : migrants) {
    writer.id(migrant.id);
    writer.state(migrant.state);
  }
  return kernel::Payload(std::move(bytes));
}

kernel::Payload encode_transfers(std::span<const CellTransfer> transfers) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(static_cast<std::uint32_t>(transfers.size()));
  for (const CellTransfer& transfer : transfers) {
    writer.number(transfer.cell);
    writer.world(transfer.to);
  }
  return kernel::Payload(std::move(bytes));
}

kernel::Payload encode_ghosts(std::span<const Ghost> ghosts) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(static_cast<std::uint32_t>(ghosts.size()));
  for (const Ghost& ghost : ghosts) write_ghost(ghost, writer);
  return kernel::Payload(std::move(bytes));
}

kernel::Payload encode_sent(std::span<const SentBody> bodies) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(static_cast<std::uint32_t>(bodies.size()));
  for (const SentBody& body : bodies) {
    write_ghost(body.ghost, writer);
    writer.state(body.end);
    writer.id(body.linked);
  }
  return kernel::Payload(std::move(bytes));
}

kernel::Payload encode_records(const Records& records) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  write_records(records, writer);
  return kernel::Payload(std::move(bytes));
}

kernel::Payload encode_fragment(const Fragment& fragment) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  write_records(fragment.records, writer);
  writer.number(static_cast<std::uint32_t>(fragment.groups.size()));
  for (const Fragment::OfGroup& group : fragment.groups) {
    writer.id(group.label);
    write_records(group.records, writer);
  }
  return kernel::Payload(std::move(bytes));
}

void decode_migrants(std::span<const std::byte> payload, std::vector<Migrant>& out) {
  Reader reader(payload);
  for (std::uint32_t left = reader.number<std::uint32_t>(); left > 0; --left) {
    Migrant migrant;
    migrant.id = reader.id();
    migrant.state = reader.state();
    out.push_back(std::move(migrant));
  }
}

void decode_transfers(std::span<const std::byte> payload, std::vector<CellTransfer>& out) {
  Reader reader(payload);
  for (std::uint32_t left = reader.number<std::uint32_t>(); left > 0; --left) {
    CellTransfer transfer;
    transfer.cell = reader.number<std::uint32_t>();
    transfer.to = reader.world();
    out.push_back(transfer);
  }
}

void decode_ghosts(std::span<const std::byte> payload, std::vector<Ghost>& out) {
  Reader reader(payload);
  for (std::uint32_t left = reader.number<std::uint32_t>(); left > 0; --left) {
    out.push_back(read_ghost(reader));
  }
}

void decode_sent(std::span<const std::byte> payload, std::vector<SentBody>& out) {
  Reader reader(payload);
  for (std::uint32_t left = reader.number<std::uint32_t>(); left > 0; --left) {
    SentBody& body = out.emplace_back();
    body.ghost = read_ghost(reader);
    body.end = reader.state();
    body.linked = reader.id();
  }
}

Records decode_records(std::span<const std::byte> payload) {
  Reader reader(payload);
  return read_records(reader);
}

Fragment decode_fragment(std::span<const std::byte> payload) {
  Reader reader(payload);
  Fragment fragment;
  fragment.records = read_records(reader);
  fragment.groups.resize(reader.number<std::uint32_t>());
  for (Fragment::OfGroup& group : fragment.groups) {
    group.label = reader.id();
    group.records = read_records(reader);
  }
  return fragment;
}

void append_for_all(kernel::Message message, std::uint32_t worlds,
                    std::vector<kernel::Message>& out) {
  for (std::uint32_t world = 0; world < worlds; ++world) {
    message.destination = kernel::LpId{world};
    out.push_back(message);
  }
}

void encode_island(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                   std::span<const BodyState> states, kernel::Bytes& out) {
  out.clear();
  Writer writer(out);
  writer.number(static_cast<std::uint32_t>(ids.size()));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    writer.id(ids[i]);
    writer.state(states[i]);
  }
  for (const ContactManifold& manifold : manifolds) writer.manifold(manifold);
}

void encode_changeable(const physics::SceneDescription& scene, std::span<const BodyId> ids,
                       std::span<const ContactManifold> manifolds, kernel::Bytes& out) {
  Writer writer(out);
  for (const BodyId id : ids) {
    const physics::Material& material = scene.bodies[physics::index_of(id)].material;
    writer.number(material.friction);
    writer.number(material.restitution);
    writer.number(material.rolling_friction_m);
    writer.number(material.torsional_friction_m);
  }
  for (const ContactManifold& manifold : manifolds) {
    if (!physics::is_joint(manifold)) continue;
    const std::optional<physics::JointMotor>& motor =
        scene.joints[physics::joint_of(manifold)].motor;
    if (!motor) continue;
    writer.number(motor->speed);
    writer.number(motor->most_push);
    writer.number(static_cast<std::uint8_t>(motor->target.has_value()));
    writer.number(motor->target.value_or(0.0));
  }
}

}  // namespace soda::models
