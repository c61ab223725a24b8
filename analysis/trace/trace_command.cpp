#include "analysis/trace/trace_command.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/exit_codes.hpp"
#include "analysis/logged_run.hpp"
#include "analysis/output_file.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/why_command.hpp"
#include "analysis/whole/scene_parts.hpp"
#include "kernel/outside.hpp"
#include "models/schedule.hpp"

namespace soda::analysis {
namespace {

constexpr int kWorkers = 1, kWorlds = 2;  // groups of tracks

std::string microseconds(std::int64_t ns) { return json_of(1e-3 * static_cast<double>(ns)); }

// One event after the other, into the file.
class EventFile {
 public:
  explicit EventFile(OutputFile& file) : file_(file) {
    file_.write("{\"displayTimeUnit\":\"ns\",\"traceEvents\":[");
  }
  void add(const SceneObject& event) {
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

SceneObject event(const char* phase, int group, std::uint32_t track, std::int64_t at_ns) {
  return SceneObject()
      .set("ph", quoted(phase))
      .set("pid", json_of(group))
      .set("tid", json_of(track))
      .set("ts", microseconds(at_ns));
}

void add_names(EventFile& file, const ExecutionTrace& trace) {
  const auto add = [&file](const char* what, int group, std::uint32_t track,
                           const std::string& name) {
    file.add(event("M", group, track, 0)
                 .set("name", quoted(what))
                 .set("args", SceneObject().set("name", quoted(name)).text()));
  };
  add("process_name", kWorkers, 0, "workers");
  add("process_name", kWorlds, 0, "worlds");
  for (std::uint32_t worker = 0; worker < trace.workers; ++worker)
    add("thread_name", kWorkers, worker, "worker " + std::to_string(worker));
  for (std::uint32_t world = 0; world < trace.worlds; ++world)
    add("thread_name", kWorlds, world, "world " + std::to_string(world));
}

const char* fate_of(const TracedExecution& execution) {
  if (execution.undone_by) return "rolled back";
  if (execution.repeats) return "repeated as it was";
  return execution.committed ? "committed" : "not committed";
}

void add_executions(EventFile& file, const ExecutionTrace& trace) {
  for (const TracedExecution& execution : trace.executions) {
    if (execution.absorbed) continue;
    SceneObject args;
    args.set("step", json_of(execution.time.t))
        .set("world", json_of(execution.world))
        .set("pass", json_of(models::pass_of(execution.time)))
        .set("fate", quoted(fate_of(execution)));
    if (execution.undone_by) args.set("rollback", json_of(*execution.undone_by + 1));
    const std::string name =
        quoted(std::to_string(execution.time.t) + " " + event_words(execution.time));
    const char* const colour = execution.undone_by ? "terrible" : "good";
    for (const int group : {kWorkers, kWorlds})
      file.add(event("X", group, group == kWorkers ? execution.worker : execution.world,
                     execution.began_ns)
                   .set("dur", microseconds(execution.took_ns))
                   .set("name", name)
                   .set("cname", quoted(colour))
                   .set("args", args.text()));
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
      return event(phase, kWorlds, world, at_ns)
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
    file.add(
        event("i", kWorlds, rollback.world, rollback.at_ns)
            .set("s", quoted("t"))
            .set("name", quoted("rollback " + std::to_string(number + 1)))
            .set("args", SceneObject().set("why", quoted(why_text(trace, number, labels))).text()));
  }
}

void add_counter(EventFile& file, int group, std::uint32_t track, std::int64_t at_ns,
                 const std::string& name, std::int64_t value) {
  file.add(event("C", group, track, at_ns)
               .set("name", quoted(name))
               .set("args", SceneObject().set("steps", json_of(value)).text()));
}

void add_counters(EventFile& file, LogReader& log, std::uint32_t worlds) {
  std::vector<std::int64_t> gvt, lead(worlds, -1);  // of each worker as it knows it; of each world
  read_records(log, worlds, [&](std::uint32_t worker, const kernel::TraceRecord& record) {
    if (worker >= gvt.size()) gvt.resize(worker + 1, 0);
    if (record.what == kernel::Happening::kGvt && record.time != kernel::kNever) {
      gvt[worker] = record.time.t;
      add_counter(file, kWorkers, worker, record.clock_ns,
                  "GVT of worker " + std::to_string(worker), record.time.t);
    }
    if (record.what != kernel::Happening::kExecuted) return;
    const std::uint32_t world = kernel::index_of(record.lp);
    const std::int64_t ahead = std::max<std::int64_t>(0, record.time.t - gvt[worker]);
    if (std::exchange(lead[world], ahead) == ahead) return;
    add_counter(file, kWorlds, world, record.clock_ns, "lead of world " + std::to_string(world),
                ahead);
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
