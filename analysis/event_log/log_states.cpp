#include "analysis/event_log/log_states.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::ContactImpulse;
using physics::Quat;
using physics::Vec3;

// Velocity, angular velocity, orientation, position: what the next ones are predicted from comes
// first.
constexpr std::size_t kNumbers = 13;
using Numbers = std::array<double, kNumbers>;
// Of a step: what fits into a block of 64 MiB, where they are written whole.
constexpr std::size_t kMostImpulses = (std::size_t{64} << 20) / 44;
constexpr std::uint16_t kImpulsesBit = 1u << kNumbers, kBrokenBit = 1u << (kNumbers + 1);

static_assert(std::endian::native == std::endian::little, "bytes of numbers, the lowest first");

Numbers numbers_of(const BodyState& state) {
  const Vec3 &v = state.linear_velocity_m_s, &w = state.angular_velocity_rad_s,
             &x = state.position_m;
  const Quat& q = state.orientation;
  return {v.x(), v.y(), v.z(), w.x(), w.y(), w.z(), q.w(),
          q.x(), q.y(), q.z(), x.x(), x.y(), x.z()};
}

void set_numbers(const Numbers& n, BodyState& state) {
  state.linear_velocity_m_s = {n[0], n[1], n[2]};
  state.angular_velocity_rad_s = {n[3], n[4], n[5]};
  state.orientation = Quat(n[6], n[7], n[8], n[9]);
  state.position_m = {n[10], n[11], n[12]};
}

// Velocities are taken to stay; where they have led to is known when they are.
constexpr std::size_t kVelocities = 6;

// What the numbers behind the velocities may be, when those are `now`'s. Only sums and products, in
// a fixed order: it must come out alike wherever the log is read.
void predict_rest(const Numbers& before, const Numbers& now, double dt_s, Numbers& guess) {
  const double x = 0.5 * dt_s * now[3], y = 0.5 * dt_s * now[4], z = 0.5 * dt_s * now[5];
  const double square = x * x + y * y + z * z;
  const double c = 1.0 - square * (0.5 - square * (1.0 / 24.0));
  const double s = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0));
  const double qw = before[6], qx = before[7], qy = before[8], qz = before[9];
  guess[6] = c * qw - s * (x * qx + y * qy + z * qz);
  guess[7] = c * qx + s * (x * qw + y * qz - z * qy);
  guess[8] = c * qy + s * (y * qw + z * qx - x * qz);
  guess[9] = c * qz + s * (z * qw + x * qy - y * qx);
  for (std::size_t axis = 0; axis < 3; ++axis)
    guess[10 + axis] = before[10 + axis] + dt_s * now[axis];
}

// The parts of a difference lie apart: alike bytes beside each other are compressed.
enum Part { kBodies, kKeys, kLengths, kBytes, kParts };

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
  // The lowest `length` bytes. Eight are written, which is faster than to count them.
  void put_bits(std::uint64_t bits, unsigned length) {
    std::memcpy(end_, &bits, sizeof bits);
    end_ += length;
  }
  std::span<const unsigned char> written() const { return {bytes_.get(), end_}; }

 private:
  std::unique_ptr<unsigned char[]> bytes_;
  unsigned char* end_;
};

std::uint64_t take_count(ByteReader& in) {
  std::uint64_t count = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const auto group = in.take<std::uint8_t>();
    count |= std::uint64_t{group & 0x7fu} << shift;
    if ((group & 0x80) == 0) return count;
  }
  throw DecodeError("holds a number of more than 64 bits");
}

std::uint32_t take_32(ByteReader& in) {
  const std::uint64_t count = take_count(in);
  if (count > 0xffffffffu) throw DecodeError("holds a number of more than 32 bits");
  return static_cast<std::uint32_t>(count);
}

auto key_of(const ContactImpulse& impulse) {
  return std::tuple(impulse.other, impulse.part, impulse.feature);
}

// Of the same contact point before; of a new one nothing. A step has them in the order of keys.
ContactImpulse found_in(const std::vector<ContactImpulse>& impulses, const ContactImpulse& key) {
  const auto found = std::ranges::lower_bound(impulses, key_of(key), {}, key_of);
  const bool is_there = found != impulses.end() && key_of(*found) == key_of(key);
  return is_there ? *found : ContactImpulse{};
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same(const ContactImpulse& a, const ContactImpulse& b) {
  const Vec3 &x = a.friction_newton_s, &y = b.friction_newton_s;
  return key_of(a) == key_of(b) && same_bits(a.normal_newton_s, b.normal_newton_s) &&
         same_bits(x.x(), y.x()) && same_bits(x.y(), y.y()) && same_bits(x.z(), y.z());
}

// What a difference holds at most.
struct DifferenceSize {
  std::size_t bodies = 0, impulses = 0, broken_joints = 0;

  explicit DifferenceSize(std::span<const BodyState> states) : bodies(states.size()) {
    for (const BodyState& state : states) {
      impulses += state.impulses.size();
      broken_joints += state.broken_joints.size();
    }
  }
  std::size_t numbers() const { return kNumbers * bodies + 4 * impulses; }
  std::size_t keys() const {
    return 2 * kMost64 * bodies + 3 * kMost32 * impulses + kMost32 * broken_joints;
  }
};

class Encoder {
 public:
  Encoder(double between_s, const DifferenceSize& most)
      : between_s_(between_s),
        bodies_((kMost64 + 2) * most.bodies + kMost64),
        keys_(most.keys()),
        lengths_(most.numbers()),
        bytes_(8 * most.numbers() + 8) {}

  void add(std::size_t skipped, const BodyState& now, const BodyState& before) {
    const Numbers numbers = numbers_of(now), old = numbers_of(before);
    Numbers guess = old;
    predict_rest(old, numbers, between_s_, guess);
    std::uint16_t mask = 0;
    for (std::size_t i = 0; i < kNumbers; ++i) {
      if (same_bits(numbers[i], guess[i])) continue;
      mask |= static_cast<std::uint16_t>(1u << i);
      put_number(numbers[i], guess[i]);
    }
    if (!std::ranges::equal(now.impulses, before.impulses, same)) {
      mask |= kImpulsesBit;
      put_impulses(now.impulses, before.impulses);
    }
    if (now.broken_joints != before.broken_joints) {
      mask |= kBrokenBit;
      keys_.put_count(now.broken_joints.size());
      for (const std::uint32_t joint : now.broken_joints) keys_.put_count(joint);
    }
    bodies_.put_count(skipped);
    bodies_.put_byte(mask & 0xff);
    bodies_.put_byte(mask >> 8);
  }

  // `skipped` bodies at the end are as they were.
  void finish(std::size_t skipped, ByteBuffer& out) {
    bodies_.put_count(skipped);
    for (const BoundedBytes* part : {&bodies_, &keys_, &lengths_, &bytes_}) {
      const std::span<const unsigned char> bytes = part->written();
      put(out, static_cast<std::uint64_t>(bytes.size()));
      out.insert(out.end(), bytes.begin(), bytes.end());
    }
  }

 private:
  void put_number(double value, double guess) {
    const std::uint64_t bits =
        std::bit_cast<std::uint64_t>(value) ^ std::bit_cast<std::uint64_t>(guess);
    const auto length = static_cast<unsigned>(8 - std::countl_zero(bits) / 8);
    lengths_.put_byte(length);
    bytes_.put_bits(bits, length);
  }

  void put_impulses(const std::vector<ContactImpulse>& now,
                    const std::vector<ContactImpulse>& before) {
    const bool same_keys = std::ranges::equal(now, before, {}, key_of, key_of);
    keys_.put_count(same_keys ? 0 : now.size() + 1);
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (same_keys) {
        put_impulse(now[i], before[i]);
        continue;
      }
      keys_.put_count(physics::index_of(now[i].other));
      keys_.put_count(now[i].part);
      keys_.put_count(now[i].feature);
      put_impulse(now[i], found_in(before, now[i]));
    }
  }

  void put_impulse(const ContactImpulse& impulse, const ContactImpulse& old) {
    put_number(impulse.normal_newton_s, old.normal_newton_s);
    for (int axis = 0; axis < 3; ++axis)
      put_number(impulse.friction_newton_s[axis], old.friction_newton_s[axis]);
  }

  const double between_s_;
  BoundedBytes bodies_, keys_, lengths_, bytes_;
};

class Decoder {
 public:
  Decoder(ByteReader& in, double between_s)
      : between_s_(between_s),
        texts_{in.take_string(), in.take_string(), in.take_string(), in.take_string()} {
    for (const std::string& text : texts_)
      parts_.emplace_back(
          std::span(reinterpret_cast<const unsigned char*>(text.data()), text.size()));
  }

  // How many bodies are as they were, before one that is not.
  std::uint64_t take_skipped() { return take_count(parts_[kBodies]); }

  void change(BodyState& state) {
    const auto mask = parts_[kBodies].take<std::uint16_t>();
    const Numbers before = numbers_of(state);
    Numbers numbers{}, guess = before;
    for (std::size_t i = 0; i < kNumbers; ++i) {
      if (i == kVelocities) predict_rest(before, numbers, between_s_, guess);
      numbers[i] = (mask >> i & 1) != 0 ? take_number(guess[i]) : guess[i];
    }
    set_numbers(numbers, state);
    if ((mask & kImpulsesBit) != 0) take_impulses(state.impulses);
    if ((mask & kBrokenBit) != 0) {
      state.broken_joints.resize(take_at_most(parts_[kKeys]));
      for (std::uint32_t& joint : state.broken_joints) joint = take_32(parts_[kKeys]);
    }
    if (mask >> (kNumbers + 2) != 0) throw DecodeError("holds a change of nothing that there is");
  }

  void expect_end() const {
    for (const ByteReader& part : parts_) part.expect_end();
  }

 private:
  double take_number(double guess) {
    const auto length = parts_[kLengths].take<std::uint8_t>();
    if (length > 8) throw DecodeError("holds a double of " + std::to_string(length) + " bytes");
    const std::uint64_t bits = parts_[kBytes].take_bits(length);
    return std::bit_cast<double>(bits ^ std::bit_cast<std::uint64_t>(guess));
  }

  // A count of what takes a byte at least.
  static std::size_t take_at_most(ByteReader& in) {
    const std::uint64_t count = take_count(in);
    if (count > in.left()) throw DecodeError("a count exceeds the bytes left");
    return count;
  }

  void take_impulses(std::vector<ContactImpulse>& impulses) {
    const std::vector<ContactImpulse> before = impulses;
    const std::uint64_t count = take_count(parts_[kKeys]);
    if (count > parts_[kKeys].left() + 1) throw DecodeError("a count exceeds the bytes left");
    if (count > 0) impulses.assign(count - 1, {});
    impulses_ += impulses.size();
    if (impulses_ > kMostImpulses) throw DecodeError("holds more impulses than any step");
    for (ContactImpulse& impulse : impulses) {
      if (count > 0) {
        impulse.other = physics::BodyId{take_32(parts_[kKeys])};
        impulse.part = take_32(parts_[kKeys]);
        impulse.feature = take_32(parts_[kKeys]);
      }
      const ContactImpulse old = found_in(before, impulse);
      impulse.normal_newton_s = take_number(old.normal_newton_s);
      for (int axis = 0; axis < 3; ++axis)
        impulse.friction_newton_s[axis] = take_number(old.friction_newton_s[axis]);
    }
  }

  const double between_s_;
  std::size_t impulses_ = 0;
  const std::array<std::string, kParts> texts_;
  std::vector<ByteReader> parts_;
};

// Null if it was not there.
const BodyState* state_of(physics::BodyId id, const LoggedStates& before) {
  const auto found = std::ranges::lower_bound(before.ids, id);
  if (found == before.ids.end() || *found != id) return nullptr;
  return &before.states[static_cast<std::size_t>(found - before.ids.begin())];
}

}  // namespace

void put_difference(ByteBuffer& out, std::span<const physics::BodyId> ids,
                    std::span<const BodyState> states, const LoggedStates& before,
                    double between_s) {
  const bool same_ids = std::ranges::equal(ids, before.ids);
  put(out, static_cast<std::uint8_t>(same_ids));
  if (!same_ids) {
    put(out, static_cast<std::uint64_t>(ids.size()));
    for (const physics::BodyId id : ids) put(out, physics::index_of(id));
  }
  const BodyState nothing;
  Encoder encoder(between_s, DifferenceSize(states));
  std::size_t next = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyState* const found = same_ids ? &before.states[i] : state_of(ids[i], before);
    const BodyState& old = found != nullptr ? *found : nothing;
    if (physics::identical(states[i], old)) continue;
    encoder.add(i - std::exchange(next, i + 1), states[i], old);
  }
  encoder.finish(ids.size() - next, out);
}

LoggedStates decode_difference(ByteReader& in, const LoggedStates& before, double between_s) {
  LoggedStates now;
  if (in.take_flag()) {
    now = before;
  } else {
    now.ids.resize(in.take_count(sizeof(std::uint32_t)));
    for (physics::BodyId& id : now.ids) id = physics::BodyId{in.take<std::uint32_t>()};
    for (const physics::BodyId id : now.ids) {
      const BodyState* const found = state_of(id, before);
      now.states.push_back(found != nullptr ? *found : BodyState{});
    }
  }
  Decoder decoder(in, between_s);
  for (std::size_t next = 0;; ++next) {
    const std::uint64_t skipped = decoder.take_skipped();
    if (skipped > now.states.size() - next) throw DecodeError("changes a body that is not there");
    next += skipped;
    if (next == now.states.size()) break;
    decoder.change(now.states[next]);
  }
  decoder.expect_end();
  return now;
}

}  // namespace soda::analysis
