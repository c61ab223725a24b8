// States of single bodies of a log, read without those of the others.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "analysis/event_log/log_reader.hpp"

namespace soda::analysis {

// Of a log with the states of each step. What it costs grows with the steps since the whole states
// before, or since the body was read last.
class SingleStates {
 public:
  // `log` must outlive this object.
  explicit SingleStates(LogReader& log) : log_(log) {}

  // Nothing if the body is not there. Throws FileError as read_step(), for what it reads.
  std::optional<physics::BodyState> read(physics::BodyId id, std::int64_t step);
  // Those that are there.
  const std::vector<physics::BodyId>& ids(std::int64_t step) { return *frame_of(step).ids; }

 private:
  // Where the records of a step are.
  struct Frame {
    std::shared_ptr<const std::vector<physics::BodyId>> ids;
    std::vector<LoggedGroup> groups;
    std::uint64_t records_begin = 0;  // in the block
  };
  struct Body {
    std::int64_t step = -1;
    std::optional<physics::BodyState> state;
  };

  const Frame& frame_of(std::int64_t step);
  Frame read_frame(std::int64_t step);
  void advance(physics::BodyId id, std::int64_t step, std::optional<physics::BodyState>& state);

  LogReader& log_;
  std::map<std::int64_t, Frame> frames_;  // of the last whole states that were asked for, and later
  std::map<physics::BodyId, Body> bodies_;
};

}  // namespace soda::analysis
