#include "analysis/commands/replay_session.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <ostream>
#include <sstream>

#include "analysis/commands/line_editor.hpp"
#include "analysis/commands/replay_until.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/event_log/state_text.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/nearest_name.hpp"
#include "analysis/trace/event_pattern.hpp"
#include "analysis/trace/message_life.hpp"
#include "analysis/trace/recorded_order.hpp"
#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/why_command.hpp"

namespace soda::analysis {
namespace {

using Words = std::vector<std::string>;

Words words_in(const std::string& line) {
  std::istringstream in(line);
  Words words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::uint64_t number_in(const std::string& word, const std::string& what, std::uint64_t least,
                        std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || value < least || value > most)
    throw UsageError(what + ": found " + word + "; allowed: " + std::to_string(least) + " to " +
                     std::to_string(most));
  return value;
}

class Session {
 public:
  Session(LogReader& log, std::ostream& out)
      : log_(log),
        out_(out),
        scenario_(logged_scenario(log, {})),
        has_trace_(log.options().level == LogLevel::kTrace) {
    const std::uint32_t worlds = scenario_.territory.worlds;
    walk_ = has_trace_ ? recorded_walk(log, worlds) : committed_walk(log);
    if (has_trace_) trace_ = read_trace(log, worlds);
  }

  void greet() const {
    out_ << log_.file() << ": ";
    if (has_trace_)
      out_ << counted(walk_.size(), "happening") << ", "
           << counted(trace_.rollbacks.size(), "rollback") << " in "
           << counted(trace_.worlds, "world");
    else
      out_ << counted(walk_.size(), "step")
           << "; without a trace (soda run --log-level trace) there is nothing between them";
    out_ << "; help lists the commands\n";
  }

  // False if that was all.
  bool carry_out(const std::string& line) {
    Words words = words_in(line);
    if (words.empty()) return true;
    const Command& command = command_of(words.front());
    words.erase(words.begin());
    if (words.size() < command.least || words.size() > command.most)
      throw UsageError("usage: " + std::string(command.usage));
    if (command.needs_trace && !has_trace_)
      throw UsageError(std::string(command.name) + ": " + log_.file() +
                       " has no trace; soda run --log-level trace writes it");
    if (command.function == nullptr) return false;
    (this->*command.function)(words);
    return true;
  }

  // What can stand for the last word.
  std::vector<std::string> completions(const std::string& line) const {
    const Words words = words_in(line);
    const bool is_first = words.empty() || (words.size() == 1 && line.back() != ' ');
    if (is_first || words.front() == "help") return command_names();
    if (words.front() == "goto") return {"world:", "message:", "rollback", "gvt:", "happening:"};
    std::vector<std::string> names;
    if (words.front() == "body")
      for (const std::uint32_t label : log_.labels()) names.push_back(std::to_string(label));
    if (words.front() == "world")
      for (std::uint32_t id = 0; id < scenario_.territory.worlds; ++id)
        names.push_back(std::to_string(id));
    return names;
  }

 private:
  struct Command {
    const char* name;
    const char* usage;
    const char* purpose;
    std::size_t least, most;  // words behind it
    bool needs_trace;
    void (Session::*function)(const Words& words);  // null: ends the session
  };
  static const std::array<Command, 10> kCommands;

  static std::vector<std::string> command_names() {
    std::vector<std::string> names;
    names.reserve(kCommands.size());
    for (const Command& command : kCommands) names.push_back(command.name);
    return names;
  }

  // By its name, or a beginning of it that no other has.
  static const Command& command_of(const std::string& word) {
    const Command* found = nullptr;
    for (const Command& command : kCommands) {
      if (word == command.name) return command;
      if (!std::string_view(command.name).starts_with(word)) continue;
      if (found != nullptr)
        throw UsageError(word + " may be " + found->name + " or " + command.name);
      found = &command;
    }
    if (found != nullptr) return *found;
    const std::string nearest = nearest_name(word, command_names());
    throw UsageError("unknown command " + word +
                     (nearest.empty() ? "" : " (did you mean " + nearest + "?)") +
                     "; help lists them");
  }

  void tell_place() const {
    if (has_trace_) {
      out_ << place_text(walk_, number_) << "\n";
    } else {
      out_ << "step " << committed_step() << " of " << log_.last_step() << " is committed, digest "
           << format_digest(log_.read_step(committed_step()).digest) << "\n";
    }
  }

  std::size_t count_in(const Words& words) const {
    return words.empty() ? 1 : number_in(words[0], "how many", 1, std::numeric_limits<int>::max());
  }

  void next(const Words& words) {
    if (number_ == walk_.size()) throw UsageError("the log ends here");
    for (std::size_t left = count_in(words); left > 0 && number_ < walk_.size(); --left) {
      ++number_;
      tell_place();
    }
  }

  void back(const Words& words) {
    if (number_ == 0) throw UsageError("the log begins here");
    for (std::size_t left = count_in(words); left > 0 && number_ > 0; --left) {
      --number_;
      tell_place();
    }
  }

  void go_to(const Words& words) {
    go_to_event(parse_event(words[0], scenario_.territory.worlds, "goto"), words[0], true);
  }

  // If it is only before the cursor, that is meant.
  void go_to_event(const EventPattern& event, const std::string& name, bool anywhere) {
    const bool is_begin =
        !has_trace_ && event.kind == EventPattern::Kind::kStep && event.step == log_.first_step();
    auto found = find_event(walk_, event, number_);
    if (!found && anywhere) found = find_event(walk_, event, 0);
    if (!found && !is_begin)
      throw UsageError("there is no " + name + (anywhere ? "" : " after this") + "; " +
                       counted(walk_.size(), has_trace_ ? "happening" : "step") + " in all");
    number_ = is_begin ? 0 : *found;
    tell_place();
  }

  void rollback(const Words& words) {
    const std::string name = words.empty() ? "rollback" : "rollback:" + words[0];
    go_to_event(parse_event(name, scenario_.territory.worlds, "rollback"), name, false);
  }

  void why(const Words& words) {
    if (trace_.rollbacks.empty()) throw UsageError("nothing was rolled back");
    std::optional<RollbackNumber> wanted = last_rollback(walk_, number_, trace_);
    if (!words.empty()) wanted = number_in(words[0], "rollback", 1, trace_.rollbacks.size()) - 1;
    if (!wanted) throw UsageError("nothing has been rolled back yet; rollback goes to the first");
    out_ << chain_text(trace_, *wanted, log_.labels());
  }

  void body(const Words& words) {
    const auto label = static_cast<std::uint32_t>(
        number_in(words[0], "body", 0, std::numeric_limits<std::uint32_t>::max()));
    const physics::BodyId id = body_of_label(log_.labels(), label, "body: " + log_.file());
    if (words.size() > 1) {
      if (words[1] != "now") throw UsageError("usage: body ID [now]");
      if (!has_trace_) throw UsageError("body: without a trace there is only what was committed");
      out_ << stands_text(stands_as_executed(log_, scenario_, walk_, number_), log_.labels(), id);
      return;
    }
    log_.last_states();  // there are some
    std::vector<std::vector<std::string>> rows;
    const std::int64_t committed = committed_step(), step = cursor_step();
    add_state(id, label, committed, "committed by now", rows);
    if (step != committed) add_state(id, label, step, "committed later", rows);
    std::vector<Column> columns = {{"state"}, {"after step", Align::kRight}};
    std::ranges::copy(state_columns(), std::back_inserter(columns));
    out_ << format_table(columns, rows);
  }

  void add_state(physics::BodyId id, std::uint32_t label, std::int64_t step, const char* title,
                 std::vector<std::vector<std::string>>& rows) const {
    std::vector<std::string> row = {title, std::to_string(step)};
    if (!has_states(log_.options(), step)) {
      row.push_back("not logged");
      row.resize(state_columns().size() + 2);
    } else {
      const LoggedStep logged = log_.read_states(step);
      const auto place = std::ranges::lower_bound(logged.ids, id);
      if (place == logged.ids.end() || *place != id) {
        row.push_back("not there");
        row.resize(state_columns().size() + 2);
      } else {
        const auto at = static_cast<std::size_t>(place - logged.ids.begin());
        std::ranges::copy(state_cells(label, logged.states[at]), std::back_inserter(row));
      }
    }
    rows.push_back(std::move(row));
  }

  // The nearest step that the log has.
  std::int64_t as_logged(std::int64_t step) const {
    return std::clamp(step, log_.first_step(), log_.last_step());
  }

  std::int64_t committed_step() const {
    if (!has_trace_) return log_.first_step() + static_cast<std::int64_t>(number_);
    const kernel::VirtualTime gvt = gvt_after(walk_, number_);
    return gvt == kernel::kBeginning ? log_.first_step() : as_logged(gvt.t);
  }

  // The step that the last happening belongs to, or else the committed one.
  std::int64_t cursor_step() const {
    if (!has_trace_ || number_ == 0) return committed_step();
    const kernel::TraceRecord& record = walk_[number_ - 1].record;
    using kernel::Happening;
    const bool has_time = record.what != Happening::kCost && record.what != Happening::kSettled &&
                          record.what != Happening::kGvt;
    return has_time ? as_logged(record.time.t) : committed_step();
  }

  void world(const Words& words) {
    const std::uint32_t worlds = scenario_.territory.worlds;
    const Situation situation = situation_after(walk_, number_, worlds, log_.first_step());
    std::optional<std::uint32_t> only;
    if (!words.empty())
      only = static_cast<std::uint32_t>(number_in(words[0], "world", 0, worlds - 1));
    out_ << situation_text(situation, scenario_.run.buffer, only);
  }

  void message(const Words& words) {
    const EventPattern name =
        parse_event("message:" + words[0], scenario_.territory.worlds, "message");
    out_ << message_life(walk_, number_, *name.world, name.number);
  }

  void help(const Words& words) {
    if (words.empty()) {
      std::vector<std::vector<std::string>> rows;
      rows.reserve(kCommands.size());
      for (const Command& command : kCommands) rows.push_back({command.usage, command.purpose});
      out_ << format_table({{"command"}, {""}}, rows);
    } else {
      const Command& command = command_of(words[0]);
      out_ << "  " << command.usage << ": " << command.purpose << "\n";
    }
    if (words.empty() || words[0] == "goto")
      out_ << "  an EVENT is one of " << event_forms() << "\n";
  }

  LogReader& log_;
  std::ostream& out_;
  const scenarios::Scenario scenario_;
  const bool has_trace_;
  RecordedWalk walk_;
  ExecutionTrace trace_;
  std::size_t number_ = 0;  // so many happenings are over
};

constexpr std::array<Session::Command, 10> Session::kCommands = {{
    {"next", "next [COUNT]", "what happens next", 0, 1, false, &Session::next},
    {"back", "back [COUNT]", "what had happened before", 0, 1, false, &Session::back},
    {"goto", "goto EVENT", "the next such event, or the first of all", 1, 1, false,
     &Session::go_to},
    {"rollback", "rollback [WORLD[:STEP]]", "the next rollback", 0, 1, true, &Session::rollback},
    {"why", "why [NUMBER]", "what led to the last rollback, or to that one", 0, 1, true,
     &Session::why},
    {"body", "body ID [now]", "a body as committed; now: as worlds have it here, for good or not",
     1, 2, false, &Session::body},
    {"world", "world [WORLD]", "where the worlds stand, or that one", 0, 1, true, &Session::world},
    {"message", "message SOURCE:NUMBER", "the life of a message", 1, 1, true, &Session::message},
    {"help", "help [COMMAND]", "these lines", 0, 1, false, &Session::help},
    {"quit", "quit", "ends the session, as the end of the input does", 0, 0, false, nullptr},
}};

}  // namespace

int replay_session(const ReplayRequest&, LogReader& log, std::ostream& out, std::ostream& err) {
  Session session(log, out);
  const std::unique_ptr<LineEditor> lines = edit_lines(
      "(soda) ", [&session](const std::string& line) { return session.completions(line); });
  if (lines->is_on_terminal()) session.greet();
  bool is_sound = true, goes_on = true;
  while (goes_on) {
    const std::optional<std::string> line = lines->next();
    if (!line) break;
    std::string refusal;
    try {
      goes_on = session.carry_out(*line);
    } catch (const UsageError& fault) {
      refusal = fault.what();
    } catch (const kernel::NotAsRecorded& fault) {
      refusal = std::string("divergence: ") + fault.what();
    }
    out << std::flush;
    if (refusal.empty()) continue;
    err << "soda: " << refusal << "\n" << std::flush;
    is_sound = false;
  }
  return is_sound || lines->is_on_terminal() ? kExitOk : kExitInput;
}

}  // namespace soda::analysis
