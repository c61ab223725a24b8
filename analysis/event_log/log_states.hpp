// The states of a step in an event log, as what has changed since the states before: each body's by
// itself, so that one can be read without the others.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "analysis/text/byte_codec.hpp"
#include "physics/model/body_state.hpp"

namespace soda::analysis {

// Of the bodies that are there; ids ascend.
struct LoggedStates {
  std::vector<physics::BodyId> ids;
  std::vector<physics::BodyState> states;
};

// So many bodies that follow each other among the ids are a group.
inline constexpr std::size_t kGroupBodies = 32;

// Where the records of a group's bodies are.
struct LoggedGroup {
  std::uint32_t group = 0;     // its place among the groups
  std::uint32_t changed = 0;   // bit i: its body i has a record, and is as it was without
  std::uint32_t contacts = 0;  // bit i: that tells of contacts or broken joints, too
  std::uint32_t end = 0;       // behind its records, in bytes from the first record of the step
};
inline constexpr std::size_t kGroupBytes = 4 * 4;

// A body that is as it was takes no byte. Of one that moves, each number is predicted from the
// state before and its velocity, a time of `between_s` later; what is stored is where its bits
// differ from that, without the leading zeros. So what is read back is the same bit for bit.
// Returns how many bytes stand before the records.
std::size_t put_difference(ByteBuffer& out, std::span<const physics::BodyId> ids,
                           std::span<const physics::BodyState> states, const LoggedStates& before,
                           double between_s);

// What stands before the records.
struct DifferenceHead {
  bool has_ids = false;              // else they are those of before
  std::vector<physics::BodyId> ids;  // not checked
  std::vector<LoggedGroup> groups;   // those with records, ascending
  std::uint64_t record_bytes = 0;    // of all records, which follow
};

// Each throws DecodeError if `in` does not hold what put_difference writes; ids are not checked.
DifferenceHead decode_difference_head(ByteReader& in);
LoggedStates decode_difference(ByteReader& in, const LoggedStates& before, double between_s);
// `records`: those of the group. `body` of kGroupBodies has one; `state` is that before, or
// BodyState{} for a body that was not there.
void decode_record(std::span<const unsigned char> records, const LoggedGroup& group,
                   std::size_t body, double between_s, physics::BodyState& state);

// Throws DecodeError unless they are those of a step: ascending, and below `bodies`.
void check_ids(std::span<const physics::BodyId> ids, std::size_t bodies);

// Of the last step, whole, in a block of its own; ids are checked.
ByteBuffer encode(const LoggedStates& states);
LoggedStates decode_last_states(std::span<const unsigned char> bytes, std::size_t bodies);

}  // namespace soda::analysis
