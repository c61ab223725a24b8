// The states of a step in an event log, as what has changed since the states before.
#pragma once

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

// A body that is as it was takes no byte. Of one that moves, each number is predicted from the
// states before and its velocity, a time of `between_s` later; what is stored is where its bits
// differ from that, without the leading zeros. So what is read back is the same bit for bit.
void put_difference(ByteBuffer& out, std::span<const physics::BodyId> ids,
                    std::span<const physics::BodyState> states, const LoggedStates& before,
                    double between_s);

// Throws DecodeError if `in` does not hold what put_difference writes; ids are not checked.
LoggedStates decode_difference(ByteReader& in, const LoggedStates& before, double between_s);

}  // namespace soda::analysis
