#include "analysis/event_log/log_states.hpp"

#include <algorithm>
#include <cstring>
#include <memory>

#include "analysis/event_log/state_codes.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::ContactImpulse;
using physics::Vec3;

static_assert(std::endian::native == std::endian::little, "bytes of numbers, the lowest first");

// How many bytes a count of 32 and of 64 bits takes at most.
constexpr std::size_t kMost32 = 5, kMost64 = 10;

// Bytes that are written one after the other, of which it is known how many there can be at most.
class BoundedBytes {
 public:
  explicit BoundedBytes(std::size_t most)
      : bytes_(std::make_unique_for_overwrite<unsigned char[]>(most)), end_(bytes_.get()) {}

  void put_byte(unsigned value) { *end_++ = static_cast<unsigned char>(value); }
  void put_count(std::uint64_t count) {
    for (; count >= 0x80; count >>= 7) put_byte(static_cast<unsigned>(count & 0x7f) | 0x80);
    put_byte(static_cast<unsigned>(count));
  }
  // Eight bytes are written, which is faster than to count them.
  void put_bits(std::uint64_t bits, unsigned code) {
    bits >>= is_rounded(code) ? kZeroBits : 0;
    std::memcpy(end_, &bits, sizeof bits);
    end_ += bytes_of(code);
  }
  std::size_t size() const { return static_cast<std::size_t>(end_ - bytes_.get()); }
  std::span<const unsigned char> written() const { return {bytes_.get(), end_}; }

 private:
  std::unique_ptr<unsigned char[]> bytes_;
  unsigned char* end_;
};

bool same(const ContactImpulse& a, const ContactImpulse& b) {
  const Vec3 &x = a.friction_newton_s, &y = b.friction_newton_s;
  return contact_key_of(a) == contact_key_of(b) &&
         (changed_bits(a.normal_newton_s, b.normal_newton_s) | changed_bits(x.x(), y.x()) |
          changed_bits(x.y(), y.y()) | changed_bits(x.z(), y.z())) == 0;
}

// Of the records of all these bodies.
std::size_t most_bytes(std::span<const BodyState> states) {
  std::size_t most = sizeof(std::uint64_t);
  for (const BodyState& state : states)
    most += 2 + 8 * kNumbers + 1 + 2 * kMost64 +
            state.impulses.size() * (3 * kMost32 + 1 + 4 * sizeof(double)) +
            state.broken_joints.size() * kMost32;
  return most;
}

class Encoder {
 public:
  Encoder(double between_s, std::size_t most) : between_s_(between_s), records_(most) {}

  void add(std::size_t place, const BodyState& now, const BodyState& before) {
    const auto number = static_cast<std::uint32_t>(place / kGroupBodies);
    if (groups_.empty() || groups_.back().group != number) groups_.push_back({.group = number});
    LoggedGroup& group = groups_.back();
    const std::uint32_t bit = 1u << place % kGroupBodies;
    group.changed |= bit;
    put_motion(numbers_of(now), numbers_of(before));
    if (put_contacts(now, before)) group.contacts |= bit;
    group.end = static_cast<std::uint32_t>(records_.size());
  }

  // Where the records begin in `out`.
  std::size_t finish(ByteBuffer& out) const {
    put(out, static_cast<std::uint64_t>(groups_.size()));
    for (const LoggedGroup& group : groups_)
      for (const std::uint32_t field : {group.group, group.changed, group.contacts, group.end})
        put(out, field);
    const std::span<const unsigned char> bytes = records_.written();
    put(out, static_cast<std::uint64_t>(bytes.size()));
    const std::size_t begin = out.size();
    out.insert(out.end(), bytes.begin(), bytes.end());
    return begin;
  }

 private:
  void put_motion(const Numbers& numbers, const Numbers& old) {
    Numbers guess = old;
    predict_rest(old, numbers, between_s_, guess);
    std::array<std::uint64_t, kNumbers> bits;
    for (std::size_t i = 0; i < kNumbers; ++i) bits[i] = changed_bits(numbers[i], guess[i]);
    std::array<unsigned, kVectors.size()> codes{};
    for (std::size_t v = 0; v < kVectors.size(); ++v) {
      std::uint64_t any = 0;
      for (std::size_t i = kVectors[v].begin; i < kVectors[v].end; ++i) any |= bits[i];
      codes[v] = code_of(any);
    }
    records_.put_byte(codes[0] | codes[1] << 4);
    records_.put_byte(codes[2] | codes[3] << 4);
    for (std::size_t v = 0; v < kVectors.size(); ++v)
      for (std::size_t i = kVectors[v].begin; codes[v] != 0 && i < kVectors[v].end; ++i)
        records_.put_bits(bits[i], codes[v]);
  }

  // Whether there is anything to tell.
  bool put_contacts(const BodyState& now, const BodyState& before) {
    const bool impulses = !std::ranges::equal(now.impulses, before.impulses, same);
    const bool broken = now.broken_joints != before.broken_joints;
    if (!impulses && !broken) return false;
    records_.put_byte((impulses ? kImpulsesChanged : 0) | (broken ? kBrokenChanged : 0));
    if (impulses) put_impulses(now.impulses, before.impulses);
    if (!broken) return true;
    records_.put_count(now.broken_joints.size());
    for (const std::uint32_t joint : now.broken_joints) records_.put_count(joint);
    return true;
  }

  void put_impulses(const std::vector<ContactImpulse>& now,
                    const std::vector<ContactImpulse>& before) {
    const bool same_keys = std::ranges::equal(now, before, {}, contact_key_of, contact_key_of);
    records_.put_count(2 * now.size() + (same_keys ? 0 : 1));
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (same_keys) {
        put_impulse(now[i], before[i]);
        continue;
      }
      records_.put_count(physics::index_of(now[i].other));
      records_.put_count(now[i].part);
      records_.put_count(now[i].feature);
      put_impulse(now[i], found_in(before, now[i]));
    }
  }

  void put_impulse(const ContactImpulse& impulse, const ContactImpulse& old) {
    const std::uint64_t normal = changed_bits(impulse.normal_newton_s, old.normal_newton_s);
    std::array<std::uint64_t, 3> bits;
    for (int axis = 0; axis < 3; ++axis)
      bits[static_cast<std::size_t>(axis)] =
          changed_bits(impulse.friction_newton_s[axis], old.friction_newton_s[axis]);
    const unsigned code = code_of(normal), friction = code_of(bits[0] | bits[1] | bits[2]);
    records_.put_byte(code | friction << 4);
    records_.put_bits(normal, code);
    for (const std::uint64_t axis : bits) records_.put_bits(axis, friction);
  }

  const double between_s_;
  std::vector<LoggedGroup> groups_;
  BoundedBytes records_;
};

}  // namespace

std::size_t put_difference(ByteBuffer& out, std::span<const physics::BodyId> ids,
                           std::span<const BodyState> states, const LoggedStates& before,
                           double between_s) {
  const std::size_t begin = out.size();
  const bool same_ids = std::ranges::equal(ids, before.ids);
  put(out, static_cast<std::uint8_t>(!same_ids));
  if (!same_ids) {
    put(out, static_cast<std::uint64_t>(ids.size()));
    for (const physics::BodyId id : ids) put(out, physics::index_of(id));
  }
  const BodyState nothing;
  Encoder encoder(between_s, most_bytes(states));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyState* const found = same_ids ? &before.states[i] : state_of(ids[i], before);
    const BodyState& old = found != nullptr ? *found : nothing;
    if (!physics::identical(states[i], old)) encoder.add(i, states[i], old);
  }
  return encoder.finish(out) - begin;
}

ByteBuffer encode(const LoggedStates& states) {
  ByteBuffer out;
  put_difference(out, states.ids, states.states, {}, 0.0);
  return out;
}

}  // namespace soda::analysis
