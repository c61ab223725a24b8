#include "models/transform_buffer/packed_state.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <utility>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::ContactImpulse;

constexpr std::size_t kBodyWords = 13, kImpulseWords = 6;

std::uint64_t word(double value) { return std::bit_cast<std::uint64_t>(value); }
double number(std::uint64_t word) { return std::bit_cast<double>(word); }

std::array<std::uint64_t, kBodyWords> body_words(const BodyState& state) {
  const physics::Vec3 &x = state.position_m, &v = state.linear_velocity_m_s,
                      &w = state.angular_velocity_rad_s;
  const physics::Quat& q = state.orientation;
  return {word(x[0]), word(x[1]), word(x[2]),  word(v[0]),  word(v[1]),  word(v[2]), word(w[0]),
          word(w[1]), word(w[2]), word(q.w()), word(q.x()), word(q.y()), word(q.z())};
}

std::array<std::uint64_t, kImpulseWords> impulse_words(const ContactImpulse& impulse) {
  return {std::uint64_t{physics::index_of(impulse.other)} << 32 | impulse.part,
          impulse.feature,
          word(impulse.normal_newton_s),
          word(impulse.friction_newton_s[0]),
          word(impulse.friction_newton_s[1]),
          word(impulse.friction_newton_s[2])};
}

// Broken joints come last, a word each, and the number of them after some zeros: so many that what
// follows the body is one word more than impulses take. Nothing where none is broken.
std::size_t broken_words(std::size_t broken) {
  if (broken == 0) return 0;
  return (broken + kImpulseWords - 1) / kImpulseWords * kImpulseWords + 1;
}

std::size_t broken_words(std::span<const std::uint64_t> words) {
  return (words.size() - kBodyWords) % kImpulseWords == 0 ? 0 : broken_words(words.back());
}

template <std::size_t N>
bool begins_with(std::span<const std::uint64_t> words, const std::array<std::uint64_t, N>& wanted) {
  for (std::size_t i = 0; i < N; ++i)
    if (words[i] != wanted[i]) return false;
  return true;
}

void pack(const BodyState& state, std::uint64_t* out) {
  out = std::ranges::copy(body_words(state), out).out;
  for (const ContactImpulse& impulse : state.impulses)
    out = std::ranges::copy(impulse_words(impulse), out).out;
  const std::size_t broken = state.broken_joints.size();
  if (broken == 0) return;
  out = std::ranges::copy(state.broken_joints, out).out;
  out = std::fill_n(out, broken_words(broken) - broken - 1, std::uint64_t{0});
  *out = broken;
}

bool are_of(std::span<const std::uint64_t> words, const BodyState& state) {
  if (words.size() != packed_words(state)) return false;
  if (words[0] != word(state.position_m[0])) return false;  // decides for most that move
  if (!begins_with(words, body_words(state))) return false;
  words = words.subspan(kBodyWords);
  for (const ContactImpulse& impulse : state.impulses) {
    if (!begins_with(words, impulse_words(impulse))) return false;
    words = words.subspan(kImpulseWords);
  }
  const std::vector<std::uint32_t>& broken = state.broken_joints;
  return broken.empty() ||
         (words.back() == broken.size() && std::ranges::equal(broken, words.first(broken.size())));
}

void unpack_from(std::span<const std::uint64_t> words, BodyState& state) {
  const auto vector = [&words](std::size_t at) {
    return physics::Vec3(number(words[at]), number(words[at + 1]), number(words[at + 2]));
  };
  state.position_m = vector(0);
  state.linear_velocity_m_s = vector(3);
  state.angular_velocity_rad_s = vector(6);
  state.orientation.w() = number(words[9]);
  state.orientation.x() = number(words[10]);
  state.orientation.y() = number(words[11]);
  state.orientation.z() = number(words[12]);
  const std::size_t of_broken = broken_words(words);
  state.impulses.resize((words.size() - kBodyWords - of_broken) / kImpulseWords);
  std::size_t at = kBodyWords;
  for (ContactImpulse& impulse : state.impulses) {
    impulse.other = BodyId{static_cast<std::uint32_t>(words[at] >> 32)};
    impulse.part = static_cast<std::uint32_t>(words[at]);
    impulse.feature = static_cast<std::uint32_t>(words[at + 1]);
    impulse.normal_newton_s = number(words[at + 2]);
    impulse.friction_newton_s = vector(at + 3);
    at += kImpulseWords;
  }
  state.broken_joints.resize(of_broken == 0 ? 0 : words.back());
  for (std::uint32_t& joint : state.broken_joints) joint = static_cast<std::uint32_t>(words[at++]);
}

// What moves has other low bits in one of these, nearly always.
std::uint32_t fingerprint(const BodyState& state) {
  const physics::Vec3 &x = state.position_m, &v = state.linear_velocity_m_s;
  const std::uint64_t bits = word(x[0]) ^ std::rotl(word(x[1]), 11) ^ std::rotl(word(x[2]), 23) ^
                             std::rotl(word(v[0]), 37) ^ std::rotl(word(v[2]), 49);
  return static_cast<std::uint32_t>(bits ^ bits >> 32);
}

}  // namespace

std::size_t packed_words(const BodyState& state) {
  return kBodyWords + kImpulseWords * state.impulses.size() +
         broken_words(state.broken_joints.size());
}

PackedState::PackedState(SharedMemory& memory, const BodyState& state)
    : words_(memory, packed_words(state), [&state](std::uint64_t* out) { pack(state, out); }) {}

bool PackedState::holds(const BodyState& state) const { return are_of(words_.items(), state); }

void PackedState::unpack(BodyState& state) const { unpack_from(words_.items(), state); }

StateInChunk::StateInChunk(const BodyState& state, std::uint64_t* room)
    : fingerprint_(fingerprint(state)),
      count_(static_cast<std::uint32_t>(packed_words(state))),
      room_(room) {
  pack(state, room);
}

StateInChunk::StateInChunk(const BodyState& state, PackedState packed)
    : fingerprint_(fingerprint(state)), packed_(std::move(packed)) {}

std::span<const std::uint64_t> StateInChunk::words() const {
  return in_room() ? std::span(room_, count_) : packed_.words();
}

bool StateInChunk::holds(const BodyState& state) const {
  return fingerprint_ == fingerprint(state) && are_of(words(), state);
}

void StateInChunk::unpack(BodyState& state) const { unpack_from(words(), state); }

}  // namespace soda::models
