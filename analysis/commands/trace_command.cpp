#include "analysis/commands/trace_command.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/why_command.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"

namespace soda::analysis {
namespace {

constexpr int kWorkers = 1, kWorlds = 2;  // groups of tracks

std::string microseconds(std::int64_t ns) { return json_of(1e-3 * static_cast<double>(ns)); }

// One of the file's many small objects: keys that need no escape, values as JSON text, no spaces.
class Entry {
 public:
  Entry() = default;
  Entry(const char* phase, int group, std::uint32_t track, std::int64_t at_ns) {
    set("ph", quoted(phase));
    set("pid", json_of(group)).set("tid", json_of(track)).set("ts", microseconds(at_ns));
  }
  Entry& set(const char* key, const std::string& value) {
    text_ += text_.empty() ? "{\"" : ",\"";
    text_.append(key).append("\":").append(value);
    return *this;
  }
  bool is_empty() const { return text_.empty(); }
  std::string text() const { return text_ + "}"; }

 private:
  std::string text_;
};

// One event after the other, into the file.
class EventFile {
 public:
  explicit EventFile(OutputFile& file) : file_(file) {
    file_.write("{\"displayTimeUnit\":\"ns\",\"traceEvents\":[");
  }
  void add(const Entry& event) {
    text_ += (is_first_ ? "\n" : ",\n") + event.text();
    is_first_ = false;
    ++events_;
    if (text_.size() > (1u << 20)) flush();
  }
  std::size_t finish() {
    text_ += "\n]}\n";
    flush();
    return events_;
  }

 private:
  void flush() {
    file_.write(text_);
    text_.clear();
  }

  OutputFile& file_;
  std::string text_;
  std::size_t events_ = 0;
  bool is_first_ = true;
};

void add_names(EventFile& file, const ExecutionTrace& trace) {
  const auto add = [&file](const char* what, int group, std::uint32_t track,
                           const std::string& name) {
    file.add(Entry("M", group, track, 0)
                 .set("name", quoted(what))
                 .set("args", Entry().set("name", quoted(name)).text()));
  };
  add("process_name", kWorkers, 0, "workers");
  add("process_name", kWorlds, 0, "worlds");
  for (std::uint32_t worker = 0; worker < trace.workers; ++worker)
    add("thread_name", kWorkers, worker, "worker " + std::to_string(worker));
  for (std::uint32_t world = 0; world < trace.worlds; ++world)
    add("thread_name", kWorlds, world, "world " + std::to_string(world));
}

// What became of it, where that is not that it was committed.
Entry fate_of(const TracedExecution& execution) {
  Entry fate;
  if (const std::uint32_t pass = models::pass_of(execution.time);
      pass > 0 && models::phase_of(execution.time) != models::Phase::kFinish)
    fate.set("pass", json_of(pass));
  if (execution.undone_by)
    fate.set("fate", quoted("rolled back")).set("rollback", json_of(*execution.undone_by + 1));
  else if (execution.repeats)
    fate.set("fate", quoted("repeated as it was"));
  else if (!execution.committed)
    fate.set("fate", quoted("not committed"));
  return fate;
}

// On the track of its world with its fate, on that of its worker with its world.
void add_executions(EventFile& file, const ExecutionTrace& trace) {
  for (const TracedExecution& execution : trace.executions) {
    if (execution.absorbed) continue;
    const std::string name =
        quoted(std::to_string(execution.time.t) + " " + event_words(execution.time));
    const auto slice = [&](int group, std::uint32_t track, const Entry& args) {
      Entry entry("X", group, track, execution.began_ns);
      entry.set("dur", microseconds(execution.took_ns)).set("name", name);
      if (!args.is_empty()) entry.set("args", args.text());
      file.add(entry);
    };
    slice(kWorkers, execution.worker, Entry().set("world", json_of(execution.world)));
    slice(kWorlds, execution.world, fate_of(execution));
  }
}

// An arrow from the execution that sent it to the world that had gone on without it.
void add_late(EventFile& file, const ExecutionTrace& trace) {
  for (std::size_t i = 0; i < trace.late.size(); ++i) {
    const LateMessage& message = trace.late[i];
    if (!message.sent_by) continue;
    const TracedExecution& sender = trace.executions[*message.sent_by];
    const std::string name =
        quoted((message.anti ? "taken back: " : "late: ") + message_words(message.kind));
    const auto end = [&](const char* phase, std::uint32_t world, std::int64_t at_ns) {
      return Entry(phase, kWorlds, world, at_ns)
          .set("id", json_of(i + 1))
          .set("name", name)
          .set("cat", quoted("late"));
    };
    file.add(end("s", message.from, sender.began_ns));
    file.add(end("f", message.to, message.arrived_ns).set("bp", quoted("e")));
  }
}

void add_rollbacks(EventFile& file, const ExecutionTrace& trace,
                   const std::vector<std::uint32_t>& labels) {
  for (RollbackNumber number = 0; number < trace.rollbacks.size(); ++number) {
    const TracedRollback& rollback = trace.rollbacks[number];
    file.add(Entry("i", kWorlds, rollback.world, rollback.at_ns)
                 .set("s", quoted("t"))
                 .set("name", quoted("rollback " + std::to_string(number + 1)))
                 .set("args", Entry().set("why", quoted(why_text(trace, number, labels))).text()));
  }
}

void add_counter(EventFile& file, int group, std::uint32_t track, std::int64_t at_ns,
                 const std::string& name, std::int64_t value) {
  file.add(Entry("C", group, track, at_ns)
               .set("name", quoted(name))
               .set("args", Entry().set("steps", json_of(value)).text()));
}

// Follows GVT, as each worker knows it, and the worlds.
class TrackCounters {
 public:
  TrackCounters(EventFile& file, std::uint32_t worlds, std::int64_t first_step)
      : file_(file),
        first_step_(first_step),
        worlds_(worlds, World{.finished = first_step, .committed = first_step}) {}

  void add(std::uint32_t worker, const kernel::TraceRecord& record) {
    using kernel::Happening;
    if (worker >= gvt_.size()) gvt_.resize(worker + 1, first_step_);
    if (record.what == Happening::kGvt) {
      if (record.time == kernel::kNever || record.time == kernel::kBeginning) return;
      gvt_[worker] = record.time.t;
      add_counter(file_, kWorkers, worker, record.clock_ns,
                  "GVT of worker " + std::to_string(worker), record.time.t);
      return;
    }
    const std::uint32_t id = kernel::index_of(record.lp);
    World& world = worlds_[id];
    const bool finishes = models::phase_of(record.time) == models::Phase::kFinish;
    if (record.what == Happening::kExecuted) {
      const std::int64_t ahead = std::max<std::int64_t>(0, record.time.t - gvt_[worker]);
      tell(world.lead, ahead, "lead", id, record.clock_ns);
      if (finishes) world.finished = record.time.t + 1;
    } else if (record.what == Happening::kRewound || record.what == Happening::kJumped) {
      world.finished = record.time.t;
    } else if (record.what == Happening::kCommitted && finishes) {
      world.committed = record.time.t + 1;
    }
    tell(world.fill, std::max<std::int64_t>(0, world.finished - world.committed), "fill", id,
         record.clock_ns);
  }

 private:
  struct World {
    std::int64_t lead = -1, fill = 0;          // as told last
    std::int64_t finished = 0, committed = 0;  // steps
  };

  void tell(std::int64_t& told, std::int64_t now, const char* what, std::uint32_t world,
            std::int64_t at_ns) {
    if (std::exchange(told, now) == now) return;
    add_counter(file_, kWorlds, world, at_ns,
                std::string(what) + " of world " + std::to_string(world), now);
  }

  EventFile& file_;
  const std::int64_t first_step_;
  std::vector<std::int64_t> gvt_;
  std::vector<World> worlds_;
};

void add_counters(EventFile& file, LogReader& log, std::uint32_t worlds) {
  TrackCounters counters(file, worlds, log.first_step());
  read_records(log, worlds, [&counters](std::uint32_t worker, const kernel::TraceRecord& record) {
    counters.add(worker, record);
  });
}

}  // namespace

int trace_command(const TraceRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  const std::string name = request.trace_file.empty() ? request.file + ".json" : request.trace_file;
  tell_flaws(log, request.file, err);
  refuse_own_input(name, request.file, "-o");
  const std::uint32_t worlds = logged_scenario(log, {}).territory.worlds;
  const ExecutionTrace trace = read_trace(log, worlds);
  OutputFile output(name, request.force);
  EventFile file(output);
  add_names(file, trace);
  add_executions(file, trace);
  add_late(file, trace);
  add_rollbacks(file, trace, log.labels());
  add_counters(file, log, worlds);
  const std::size_t events = file.finish();
  output.complete();
  out << name << ": " << trace.executions.size() << " executions, " << trace.rollbacks.size()
      << " rollbacks, " << events << " entries; open it in ui.perfetto.dev\n";
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
