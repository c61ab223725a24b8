// Happenings of a walk and where worlds stand, in words.
#include "analysis/text/text_table.hpp"
#include "analysis/trace/recorded_walk.hpp"
#include "analysis/trace/trace_words.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

// "ghosts for step 84, pairs"; of an anti-message that it takes them back.
std::string what_of(const TraceRecord& record) {
  return message_words(record.kind) + " for " + words_of(record.time);
}

std::string message_text(const TraceRecord& record) {
  const std::string world = world_words(kernel::index_of(record.lp));
  const std::string peer = world_words(kernel::index_of(record.peer));
  const bool from_peer = record.what == Happening::kArrived || record.what == Happening::kLate;
  const std::string name =
      " (message " +
      message_name(kernel::index_of(from_peer ? record.peer : record.lp), record.version) + ")";
  switch (record.what) {
    case Happening::kSent:
      return world + (record.anti ? " took back from " : " sent ") +
             (record.anti ? peer + " " : "") + what_of(record) +
             (record.anti ? "" : " to " + peer) + name;
    case Happening::kAdopted:
      return world + " left with " + peer + " as they are " + what_of(record) + name;
    case Happening::kArrived:
      return world + (record.anti ? " heard that " : " received from ") + peer +
             (record.anti ? " takes back " : " ") + what_of(record) + name;
    default:
      return "and that is late: " + world + " has gone on without " +
             (record.anti ? "knowing it" : "it") + name;
  }
}

std::string execution_text(const TraceRecord& record) {
  const std::string world = world_words(kernel::index_of(record.lp)), time = words_of(record.time);
  switch (record.what) {
    case Happening::kExecuted:
      return world + (record.anew ? " repeated as it stood " : " executed ") + time +
             (record.took_ns > 0 ? ", in " + milliseconds(record.took_ns) : "");
    case Happening::kAbsorbed:
      return world + " absorbed what came for " + time + ": it changes nothing";
    case Happening::kRewound:
      return world + " rolls back to " + time + ", for " + words_of(record.other) + " has changed";
    case Happening::kRolledBack:
      return world + " undid " + time;
    case Happening::kPutBack:
      return world + " put back " + time + ", which stands again as it was";
    case Happening::kJumped:
      return world + " goes on at " + time;
    default:
      return world + " committed " + time;
  }
}

std::string gvt_words(kernel::VirtualTime gvt) {
  if (gvt == kernel::kNever) return "the end of the run";
  return gvt == kernel::kBeginning ? "not known yet" : words_of(gvt);
}

std::string time_or_none(const std::optional<kernel::VirtualTime>& time) {
  return time ? words_of(*time) : "none";
}

}  // namespace

std::string happening_text(const WalkedHappening& happening) {
  const TraceRecord& record = happening.record;
  if (is_of_message(record.what)) return message_text(record);
  const std::string world = world_words(kernel::index_of(record.lp));
  if (record.what == Happening::kGvt) return "GVT is " + gvt_words(record.time);
  if (record.what == Happening::kSettled) return world + " looks at what came late";
  if (record.what == Happening::kCost)
    return "what " + world + " executed last took " + milliseconds(record.took_ns);
  return execution_text(record);
}

std::string place_text(const RecordedWalk& walk, std::size_t number) {
  const std::string of = " of " + std::to_string(walk.size());
  if (number == 0) return "before happening 1" + of;
  const WalkedHappening& happening = walk[number - 1];
  return "happening " + std::to_string(number) + of + ", at " +
         milliseconds(happening.record.clock_ns) + ", worker " + std::to_string(happening.worker) +
         ": " + happening_text(happening);
}

std::string situation_text(const Situation& situation, std::int64_t buffer,
                           const std::optional<std::uint32_t>& only) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t id = 0; id < situation.worlds.size(); ++id) {
    if (only && id != *only) continue;
    const WorldSituation& world = situation.worlds[id];
    rows.push_back({std::to_string(id), time_or_none(world.executed), time_or_none(world.committed),
                    std::to_string(world.ahead),
                    std::to_string(world.entries) + " of " + std::to_string(buffer),
                    std::to_string(world.waiting), std::to_string(world.in_flight),
                    std::to_string(world.rollbacks)});
  }
  return "GVT: " + gvt_words(situation.gvt) + "\n\n" +
         format_table({{"world", Align::kRight},
                       {"executed up to (LVT)"},
                       {"committed up to"},
                       {"events ahead", Align::kRight},
                       {"entries", Align::kRight},
                       {"messages waiting", Align::kRight},
                       {"in flight to it", Align::kRight},
                       {"rollbacks so far", Align::kRight}},
                      rows);
}

}  // namespace soda::analysis
