#include "analysis/event_log/single_states.hpp"

#include <algorithm>

#include "analysis/event_log/log_states.hpp"

namespace soda::analysis {
namespace {

using physics::BodyId;
using physics::BodyState;

std::int64_t whole_before(const LogReader& log, std::int64_t step) {
  return step - (step - log.first_step()) % kStatesAWhole;
}

}  // namespace

SingleStates::Frame SingleStates::read_frame(std::int64_t step) {
  const StepParts parts = log_.step_parts_of(step);
  const FileBytes bytes = log_.read_part(step, parts.head_bytes, parts.index_bytes);
  try {
    ByteReader in(bytes.view());
    DifferenceHead head = decode_difference_head(in);
    in.expect_end();
    check_ids(head.ids, log_.labels().size());
    Frame frame;
    if (head.has_ids)
      frame.ids = std::make_shared<const std::vector<BodyId>>(std::move(head.ids));
    else if (whole_before(log_, step) < step)
      frame.ids = frame_of(step - 1).ids;
    else
      frame.ids = std::make_shared<const std::vector<BodyId>>();
    frame.groups = std::move(head.groups);
    frame.records_begin = parts.head_bytes + parts.index_bytes;
    return frame;
  } catch (const DecodeError& fault) {
    log_.refuse(step, fault.what());
  }
}

// Those before, back to the whole states, tell who is there: they are read first.
const SingleStates::Frame& SingleStates::frame_of(std::int64_t step) {
  if (const auto found = frames_.find(step); found != frames_.end()) return found->second;
  // Steps beside each other may lie on both sides of whole states.
  const std::int64_t whole = whole_before(log_, step);
  frames_.erase(frames_.begin(), frames_.lower_bound(whole - kStatesAWhole));
  for (std::int64_t next = whole; next < step; ++next)
    if (!frames_.contains(next)) frames_.emplace(next, read_frame(next));
  return frames_.emplace(step, read_frame(step)).first->second;
}

// From its state before to that after the step.
void SingleStates::advance(BodyId id, std::int64_t step, std::optional<BodyState>& state) {
  const Frame& frame = frame_of(step);
  const auto found = std::ranges::lower_bound(*frame.ids, id);
  if (found == frame.ids->end() || *found != id) {
    state.reset();
    return;
  }
  if (!state || whole_before(log_, step) == step) state = BodyState{};
  const auto place = static_cast<std::size_t>(found - frame.ids->begin());
  const auto group =
      std::ranges::lower_bound(frame.groups, place / kGroupBodies, {}, &LoggedGroup::group);
  const std::size_t body = place % kGroupBodies;
  if (group == frame.groups.end() || group->group != place / kGroupBodies ||
      (group->changed >> body & 1) == 0)
    return;
  const std::uint64_t begin = group == frame.groups.begin() ? 0 : std::prev(group)->end;
  const FileBytes records = log_.read_part(step, frame.records_begin + begin, group->end - begin);
  try {
    decode_record(records.view(), *group, body, log_.between_s(), *state);
  } catch (const DecodeError& fault) {
    log_.refuse(step, fault.what());
  }
}

std::optional<BodyState> SingleStates::read(BodyId id, std::int64_t step) {
  Body& body = bodies_[id];
  const std::int64_t whole = whole_before(log_, step);
  if (body.step < whole || body.step > step) body = {whole - 1, std::nullopt};
  while (body.step < step) advance(id, ++body.step, body.state);
  return body.state;
}

}  // namespace soda::analysis
