#include <algorithm>
#include <string>
#include <utility>

#include "analysis/event_log/log_states.hpp"
#include "analysis/event_log/state_codes.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::ContactImpulse;

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

// A count of what takes a byte at least.
std::size_t take_at_most(ByteReader& in) {
  const std::uint64_t count = take_count(in);
  if (count > in.left()) throw DecodeError("a count exceeds the bytes left");
  return count;
}

[[noreturn]] void refuse_code(unsigned code) {
  throw DecodeError("holds a number of length " + std::to_string(code));
}

unsigned checked(unsigned code) {
  if (code > kMostCode) refuse_code(code);
  return code;
}

double take_number(ByteReader& in, unsigned code, double guess) {
  const std::uint64_t bits = in.take_bits(bytes_of(code)) << (is_rounded(code) ? kZeroBits : 0);
  return std::bit_cast<double>(bits ^ std::bit_cast<std::uint64_t>(guess));
}

void take_impulses(ByteReader& in, std::vector<ContactImpulse>& impulses) {
  const std::uint64_t count = take_count(in);
  const bool has_keys = count % 2 == 1;
  if (count / 2 > in.left()) throw DecodeError("a count exceeds the bytes left");
  if (!has_keys && count / 2 != impulses.size())
    throw DecodeError("holds other contacts than the states before");
  std::vector<ContactImpulse> before;
  if (has_keys) {
    before = std::move(impulses);
    impulses.assign(count / 2, {});
  }
  for (ContactImpulse& impulse : impulses) {
    if (has_keys) {
      impulse.other = physics::BodyId{take_32(in)};
      impulse.part = take_32(in);
      impulse.feature = take_32(in);
      const ContactImpulse old = found_in(before, impulse);
      impulse.normal_newton_s = old.normal_newton_s;
      impulse.friction_newton_s = old.friction_newton_s;
    }
    const auto codes = in.take<std::uint8_t>();
    const unsigned normal = checked(codes & 15), friction = checked(codes >> 4);
    impulse.normal_newton_s = take_number(in, normal, impulse.normal_newton_s);
    for (int axis = 0; axis < 3; ++axis)
      impulse.friction_newton_s[axis] = take_number(in, friction, impulse.friction_newton_s[axis]);
  }
}

// Returns what follows; a reader whose address nobody has stays in registers.
ByteReader take_motion(ByteReader in, double between_s, BodyState& state) {
  const Numbers before = numbers_of(state);
  Numbers numbers{}, guess = before;
  const auto codes = in.take<std::uint16_t>();
  for (std::size_t v = 0; v < kVectors.size(); ++v) {
    if (v == kVelocityVectors) predict_rest(before, numbers, between_s, guess);
    const unsigned code = checked(codes >> 4 * v & 15), shift = is_rounded(code) ? kZeroBits : 0;
    const std::size_t bytes = bytes_of(code);
    for (std::size_t i = kVectors[v].begin; i < kVectors[v].end; ++i) {
      const std::uint64_t changed = in.take_bits(bytes) << shift;
      numbers[i] = std::bit_cast<double>(changed ^ std::bit_cast<std::uint64_t>(guess[i]));
    }
  }
  set_numbers(numbers, state);
  return in;
}

void take_record(ByteReader& in, bool has_contacts, double between_s, BodyState& state) {
  in = take_motion(in, between_s, state);
  if (!has_contacts) return;
  const auto what = in.take<std::uint8_t>();
  if (what == 0 || what > (kImpulsesChanged | kBrokenChanged))
    throw DecodeError("holds a change of nothing that there is");
  if ((what & kImpulsesChanged) != 0) take_impulses(in, state.impulses);
  if ((what & kBrokenChanged) == 0) return;
  state.broken_joints.resize(take_at_most(in));
  for (std::uint32_t& joint : state.broken_joints) joint = take_32(in);
}

void skip_record(ByteReader& in, bool has_contacts) {
  const auto codes = in.take<std::uint16_t>();
  std::size_t bytes = 0;
  for (std::size_t v = 0; v < kVectors.size(); ++v)
    bytes += (kVectors[v].end - kVectors[v].begin) * bytes_of(checked(codes >> 4 * v & 15));
  in.skip(bytes);
  if (!has_contacts) return;
  const auto what = in.take<std::uint8_t>();
  const std::uint64_t count = (what & kImpulsesChanged) != 0 ? take_count(in) : 0;
  if (count / 2 > in.left()) throw DecodeError("a count exceeds the bytes left");
  for (std::uint64_t i = 0; i < count / 2; ++i) {
    for (int key = 0; key < 3 && count % 2 == 1; ++key) take_count(in);
    const auto lengths = in.take<std::uint8_t>();
    in.skip(bytes_of(checked(lengths & 15)) + 3 * bytes_of(checked(lengths >> 4)));
  }
  if ((what & kBrokenChanged) == 0) return;
  for (std::size_t joints = take_at_most(in); joints > 0; --joints) take_count(in);
}

bool bit_of(std::uint32_t bits, std::size_t body) { return (bits >> body & 1) != 0; }

// Before the records are read.
LoggedStates unchanged(DifferenceHead& head, const LoggedStates& before) {
  if (!head.has_ids) return before;
  LoggedStates now;
  now.ids = std::move(head.ids);
  now.states.resize(now.ids.size());
  for (std::size_t i = 0; i < now.ids.size() && !before.ids.empty(); ++i)
    if (const BodyState* const found = state_of(now.ids[i], before)) now.states[i] = *found;
  return now;
}

}  // namespace

DifferenceHead decode_difference_head(ByteReader& in) {
  DifferenceHead head;
  head.has_ids = in.take_flag();
  if (head.has_ids) {
    head.ids.resize(in.take_count(sizeof(std::uint32_t)));
    for (physics::BodyId& id : head.ids) id = physics::BodyId{in.take<std::uint32_t>()};
  }
  head.groups.resize(in.take_count(kGroupBytes));
  const LoggedGroup* before = nullptr;
  for (LoggedGroup& group : head.groups) {
    group.group = in.take<std::uint32_t>();
    group.changed = in.take<std::uint32_t>();
    group.contacts = in.take<std::uint32_t>();
    group.end = in.take<std::uint32_t>();
    if (before != nullptr && (group.group <= before->group || group.end < before->end))
      throw DecodeError("holds groups of bodies out of order");
    before = &group;
  }
  head.record_bytes = in.take<std::uint64_t>();
  if (head.record_bytes != (before != nullptr ? before->end : 0))
    throw DecodeError("holds other records than those of its groups");
  return head;
}

LoggedStates decode_difference(ByteReader& in, const LoggedStates& before, double between_s) {
  DifferenceHead head = decode_difference_head(in);
  LoggedStates now = unchanged(head, before);
  std::size_t begin = 0;
  for (const LoggedGroup& group : head.groups) {
    ByteReader records(in.take_span(group.end - std::exchange(begin, group.end)));
    for (std::size_t body = 0; body < kGroupBodies; ++body) {
      if (!bit_of(group.changed, body)) continue;
      const std::size_t place = group.group * kGroupBodies + body;
      if (place >= now.states.size()) throw DecodeError("changes a body that is not there");
      take_record(records, bit_of(group.contacts, body), between_s, now.states[place]);
    }
    records.expect_end();
  }
  return now;
}

void decode_record(std::span<const unsigned char> records, const LoggedGroup& group,
                   std::size_t body, double between_s, BodyState& state) {
  ByteReader in(records);
  for (std::size_t before = 0; before < body; ++before)
    if (bit_of(group.changed, before)) skip_record(in, bit_of(group.contacts, before));
  take_record(in, bit_of(group.contacts, body), between_s, state);
}

void check_ids(std::span<const physics::BodyId> ids, std::size_t bodies) {
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::uint32_t id = physics::index_of(ids[i]);
    if (id >= bodies)
      throw DecodeError("holds body id " + std::to_string(id) + " of " + std::to_string(bodies));
    if (i > 0 && id <= physics::index_of(ids[i - 1]))
      throw DecodeError("holds body id " + std::to_string(id) + " out of order");
  }
}

LoggedStates decode_last_states(std::span<const unsigned char> bytes, std::size_t bodies) {
  ByteReader in(bytes);
  LoggedStates states = decode_difference(in, {}, 0.0);
  in.expect_end();
  check_ids(states.ids, bodies);
  return states;
}

}  // namespace soda::analysis
