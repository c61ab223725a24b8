#include "analysis/trace/event_pattern.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <vector>

#include "analysis/text/exit_codes.hpp"
#include "analysis/text/nearest_name.hpp"
#include "analysis/trace/trace_words.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;
using EventKind = EventPattern::Kind;

struct Form {
  const char* name;
  EventKind kind;
  std::size_t least, most;  // parts behind the name
};
constexpr Form kForms[] = {{"world", EventKind::kWorld, 2, 4},
                           {"message", EventKind::kMessage, 2, 2},
                           {"rollback", EventKind::kRollback, 0, 2},
                           {"gvt", EventKind::kGvt, 1, 1},
                           {"happening", EventKind::kHappening, 1, 1}};

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

// By kind of execution, as words_of() has them.
std::vector<std::string> phase_names() {
  const auto kinds = models::event_kinds();
  std::vector<std::string> names(kinds.begin(), kinds.end());
  names[static_cast<std::size_t>(models::Phase::kBegin)] = "begin";
  return names;
}

class Parser {
 public:
  Parser(const std::string& text, std::uint32_t worlds, const std::string& where)
      : text_(text), worlds_(worlds), where_(where), parts_(parts_of(text)) {}

  EventPattern parse() {
    EventPattern event;
    if (const auto step = number_in(parts_[0]); step && parts_.size() == 1) {
      event.kind = EventKind::kStep;
      event.step = as_step(0);
      return event;
    }
    const Form& form = form_of_first();
    event.kind = form.kind;
    const std::size_t count = parts_.size() - 1;
    if (count < form.least || count > form.most) refuse("is no event", event_forms());
    if (form.kind == EventKind::kMessage || form.kind == EventKind::kHappening)
      event.number = as_number(count, form.kind == EventKind::kHappening,
                               std::numeric_limits<std::uint64_t>::max());
    if (form.kind == EventKind::kMessage && parts_[1] == "outside") {
      event.world = kernel::index_of(kernel::kExternalSource);
    } else if (form.kind != EventKind::kGvt && form.kind != EventKind::kHappening && count > 0) {
      event.world = static_cast<std::uint32_t>(as_number(1, 0, worlds_ - 1));
    }
    if (form.kind == EventKind::kGvt) event.step = as_step(1);
    if ((form.kind == EventKind::kWorld || form.kind == EventKind::kRollback) && count > 1)
      event.step = as_step(2);
    if (count > 2) event.phase = as_phase(3);
    if (count > 3) event.round = static_cast<std::uint32_t>(as_number(4, 0, 0xffff));
    return event;
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const std::string& allowed) const {
    throw UsageError(where_ + ": " + text_ + " " + what + "; allowed: " + allowed);
  }

  static std::optional<std::uint64_t> number_in(const std::string& part) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || end != part.data() + part.size()) return std::nullopt;
    return value;
  }

  std::uint64_t as_number(std::size_t place, std::uint64_t least, std::uint64_t most) const {
    const auto value = number_in(parts_[place]);
    if (!value || *value < least || *value > most)
      refuse("has \"" + parts_[place] + "\" for a number",
             std::to_string(least) + " to " + std::to_string(most));
    return *value;
  }
  std::int64_t as_step(std::size_t place) const {
    return static_cast<std::int64_t>(
        as_number(place, 0, std::numeric_limits<std::int64_t>::max() - 1));
  }

  const Form& form_of_first() const {
    const auto form =
        std::ranges::find_if(kForms, [this](const Form& f) { return parts_[0] == f.name; });
    if (form != std::end(kForms)) return *form;
    std::vector<std::string> names;
    for (const Form& known : kForms) names.push_back(known.name);
    const std::string nearest = nearest_name(parts_[0], names);
    refuse("is no event" + (nearest.empty() ? "" : " (did you mean " + nearest + "?)"),
           event_forms());
  }

  std::size_t as_phase(std::size_t place) const {
    std::string wanted = parts_[place];
    std::ranges::replace(wanted, ' ', '_');
    const std::vector<std::string> names = phase_names();
    std::vector<std::string> known;
    std::string allowed;
    for (std::size_t phase = 0; phase < names.size(); ++phase) {
      if (names[phase].empty()) continue;
      if (wanted == names[phase]) return phase;
      known.push_back(names[phase]);
      allowed += (allowed.empty() ? "" : ", ") + names[phase];
    }
    const std::string nearest = nearest_name(wanted, known);
    refuse("has \"" + parts_[place] + "\" for a phase" +
               (nearest.empty() ? "" : " (did you mean " + nearest + "?)"),
           allowed);
  }

  const std::string& text_;
  const std::uint32_t worlds_;
  const std::string& where_;
  const std::vector<std::string> parts_;
};

bool is_of_world(const EventPattern& event, kernel::LpId world) {
  return !event.world || *event.world == kernel::index_of(world);
}

bool is_of_time(const EventPattern& event, kernel::VirtualTime time) {
  return (!event.step || *event.step == time.t) &&
         (!event.phase || *event.phase == models::kind_of(time)) &&
         (!event.round || *event.round == models::merge_round_of(time));
}

// What a walk does not tell of is told by something else.
struct KnownOfTrace {
  bool has_executions = false;
  bool in_sequence = false;
};

bool fits(const EventPattern& event, const TraceRecord& record, const KnownOfTrace& known) {
  switch (event.kind) {
    case EventKind::kStep:
      return known.has_executions
                 ? record.what == Happening::kExecuted && is_of_time(event, record.time)
                 : record.time.t == *event.step;
    case EventKind::kWorld:
      return record.what == Happening::kExecuted && is_of_world(event, record.lp) &&
             is_of_time(event, record.time);
    case EventKind::kMessage:
      return record.version == event.number &&
             (known.in_sequence
                  ? record.what == Happening::kSent && is_of_world(event, record.lp)
                  : record.what == Happening::kArrived && is_of_world(event, record.peer));
    case EventKind::kRollback:
      return record.what == Happening::kRewound && is_of_world(event, record.lp) &&
             is_of_time(event, record.time);
    case EventKind::kGvt:
      return record.what == (known.in_sequence ? Happening::kExecuted : Happening::kGvt) &&
             record.time.t >= *event.step;
    case EventKind::kHappening:
      return false;
  }
  return false;
}

}  // namespace

const char* event_forms() {
  return "STEP, world:WORLD:STEP[:PHASE[:ROUND]], message:SOURCE:NUMBER, rollback[:WORLD[:STEP]], "
         "gvt:STEP, happening:NUMBER";
}

EventPattern parse_event(const std::string& text, std::uint32_t worlds, const std::string& where) {
  return Parser(text, worlds, where).parse();
}

std::string refusal_of(const RecordedWalk& walk, const EventPattern& event,
                       const std::string& name) {
  std::string text = "tells of no " + name + " in its " + counted(walk.size(), "happening");
  if (event.kind == EventKind::kRollback && is_in_sequence(walk))
    text += ": in a run in sequence nothing is rolled back";
  return text;
}

std::optional<std::size_t> find_event(const RecordedWalk& walk, const EventPattern& event,
                                      std::size_t number) {
  if (event.kind == EventKind::kHappening)
    return event.number <= walk.size() ? std::optional<std::size_t>(event.number) : std::nullopt;
  KnownOfTrace known;
  known.has_executions = std::ranges::any_of(walk, [](const WalkedHappening& happening) {
    return happening.record.what == Happening::kExecuted;
  });
  known.in_sequence = is_in_sequence(walk);
  for (std::size_t i = number; i < walk.size(); ++i)
    if (fits(event, walk[i].record, known)) return i + 1;
  return std::nullopt;
}

}  // namespace soda::analysis
