#include "models/messages.hpp"

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::ContactImpulse;
using physics::ContactManifold;
using physics::ContactPoint;
using physics::Vec3;

static_assert(std::endian::native == std::endian::little,
              "the wire format is little-endian: big-endian machines need byte swaps here");

class Writer {
 public:
  explicit Writer(kernel::Bytes& out) : out_(out) {}

  template <class T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    const std::size_t at = out_.size();
    out_.resize(at + sizeof value);
    std::memcpy(out_.data() + at, &value, sizeof value);
  }
  void id(BodyId value) { number(physics::index_of(value)); }
  void world(WorldId value) { number(index_of(value)); }
  void vector(const Vec3& value) {
    for (int axis = 0; axis < 3; ++axis) number(value[axis]);
  }
  void impulse(const ContactImpulse& value) {
    id(value.other);
    number(value.part);
    number(value.feature);
    number(value.normal_newton_s);
    vector(value.friction_newton_s);
  }
  void state(const BodyState& value) {
    vector(value.position_m);
    number(value.orientation.w());
    number(value.orientation.x());
    number(value.orientation.y());
    number(value.orientation.z());
    vector(value.linear_velocity_m_s);
    vector(value.angular_velocity_rad_s);
    number(static_cast<std::uint32_t>(value.impulses.size()));
    for (const ContactImpulse& item : value.impulses) impulse(item);
  }
  void manifold(const ContactManifold& value) {
    id(value.a);
    id(value.b);
    number(value.part);
    number(value.count);
    vector(value.normal);
    for (std::uint32_t i = 0; i < value.count; ++i) {
      vector(value.points[i].position_m);
      number(value.points[i].separation_m);
      number(value.points[i].feature);
    }
  }

 private:
  kernel::Bytes& out_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> in) : in_(in) {}

  template <class T>
  T number() {
    if (in_.size() < sizeof(T)) {
      std::fprintf(stderr, "soda: message payload ends early\n");
      std::abort();
    }
    T value;
    std::memcpy(&value, in_.data(), sizeof value);
    in_ = in_.subspan(sizeof value);
    return value;
  }
  BodyId id() { return BodyId{number<std::uint32_t>()}; }
  WorldId world() { return WorldId{number<std::uint32_t>()}; }
  Vec3 vector() {
    const double x = number<double>(), y = number<double>(), z = number<double>();
    return {x, y, z};
  }
  ContactImpulse impulse() {
    ContactImpulse value;
    value.other = id();
    value.part = number<std::uint32_t>();
    value.feature = number<std::uint32_t>();
    value.normal_newton_s = number<double>();
    value.friction_newton_s = vector();
    return value;
  }
  BodyState state() {
    BodyState value;
    value.position_m = vector();
    value.orientation.w() = number<double>();
    value.orientation.x() = number<double>();
    value.orientation.y() = number<double>();
    value.orientation.z() = number<double>();
    value.linear_velocity_m_s = vector();
    value.angular_velocity_rad_s = vector();
    value.impulses.resize(number<std::uint32_t>());
    for (ContactImpulse& item : value.impulses) item = impulse();
    return value;
  }
  ContactManifold manifold() {
    ContactManifold value;
    value.a = id();
    value.b = id();
    value.part = number<std::uint32_t>();
    value.count = number<std::uint32_t>();
    value.normal = vector();
    for (std::uint32_t i = 0; i < value.count; ++i) {
      value.points[i].position_m = vector();
      value.points[i].separation_m = number<double>();
      value.points[i].feature = number<std::uint32_t>();
    }
    return value;
  }

 private:
  std::span<const std::byte> in_;
};

}  // namespace

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

kernel::Payload encode_ghosts(std::span<const Ghost> ghosts) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(static_cast<std::uint32_t>(ghosts.size()));
  for (const Ghost& ghost : ghosts) {
    writer.id(ghost.id);
    writer.world(ghost.owner);
    writer.vector(ghost.box.min);
    writer.vector(ghost.box.max);
    writer.state(ghost.state);
  }
  return kernel::Payload(std::move(bytes));
}

kernel::Payload encode_records(const Records& records) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.number(static_cast<std::uint32_t>(records.nodes.size()));
  for (const Node& node : records.nodes) {
    writer.id(node.id);
    writer.world(node.owner);
    writer.state(node.state);
  }
  writer.number(static_cast<std::uint32_t>(records.manifolds.size()));
  for (const ContactManifold& manifold : records.manifolds) writer.manifold(manifold);
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

void decode_ghosts(std::span<const std::byte> payload, std::vector<Ghost>& out) {
  Reader reader(payload);
  for (std::uint32_t left = reader.number<std::uint32_t>(); left > 0; --left) {
    Ghost ghost;
    ghost.id = reader.id();
    ghost.owner = reader.world();
    ghost.box.min = reader.vector();
    ghost.box.max = reader.vector();
    ghost.state = reader.state();
    out.push_back(std::move(ghost));
  }
}

Records decode_records(std::span<const std::byte> payload) {
  Reader reader(payload);
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

}  // namespace soda::models
