// What users call an event of a traced run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "analysis/trace/recorded_walk.hpp"

namespace soda::analysis {

// One of
//   STEP                               some world first executes something of this step
//   world:WORLD:STEP[:PHASE[:ROUND]]   this world executes that
//   message:SOURCE:NUMBER              this message arrives
//   rollback[:WORLD[:STEP]]            a world rolls back; this one; to this step
//   gvt:STEP                           GVT comes to this step
//   happening:NUMBER                   by its number in the order recorded, from 1
struct EventPattern {
  enum class Kind { kStep, kWorld, kMessage, kRollback, kGvt, kHappening };
  Kind kind{};
  std::optional<std::uint32_t> world;  // of a message its source
  std::optional<std::int64_t> step;
  std::optional<std::size_t> phase;  // of models::event_kinds()
  std::optional<std::uint32_t> round;
  std::uint64_t number = 0;
};

// How events are called, a line for each form, for helps.
const char* event_forms();
// Throws UsageError with what was found and what is allowed, beginning with `where`.
EventPattern parse_event(const std::string& text, std::uint32_t worlds, const std::string& where);

// The number of the first such happening after the first `number`.
std::optional<std::size_t> find_event(const RecordedWalk& walk, const EventPattern& event,
                                      std::size_t number);

// What of a log that has no such event: "tells of no rollback in its 9 happenings".
std::string refusal_of(const RecordedWalk& walk, const EventPattern& event,
                       const std::string& name);

}  // namespace soda::analysis
