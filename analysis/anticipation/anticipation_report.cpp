#include "analysis/anticipation/anticipation_report.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/text/json_text.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

Column right(const char* title) { return {title, Align::kRight}; }

std::string steps_text(std::int64_t steps) { return steps < 0 ? "never" : std::to_string(steps); }

std::string shown_text(const AnticipationRun& run) {
  if (run.late_before) return "in the warm-up";
  return run.late ? std::to_string(run.steps) : "> " + std::to_string(run.steps);
}

std::string ratio_text(double ratio) { return std::isnan(ratio) ? "-" : format_number(ratio, 4); }

std::string seconds_text(double seconds) {
  return std::isnan(seconds) ? "-" : format_number(seconds, 3) + " s";
}

void add_run(const char* mode, const AnticipationPoint& point, const AnticipationRun& run,
             std::vector<std::vector<std::string>>& rows) {
  const bool known = !run.late_before;
  rows.push_back({std::to_string(point.buffer), format_number(100 * point.overload) + " %", mode,
                  ratio_text(run.ratio), known ? std::to_string(run.filled) : "-", shown_text(run),
                  known && !std::isnan(run.ratio) ? steps_text(run.law) : "-",
                  std::to_string(run.frames.least_fill), std::to_string(run.frames.late),
                  std::to_string(run.frames.slow), seconds_text(run.recovery_s),
                  format_number(run.buffer_bytes / 1024, 3),
                  format_number(100 * run.rolled_back, 3) + " %"});
}

// A point by the law alone, as a run that keeps to it.
AnticipationRun by_law(const AnticipationPoint& point) {
  AnticipationRun law;
  law.late = point.law >= 0;
  law.filled = point.buffer;
  law.steps = point.law;
  law.ratio = point.ratio;
  law.law = point.law;
  law.recovery_s = std::nan("");
  return law;
}

struct ModeRun {
  const AnticipationPoint& point;
  const char* mode;
  AnticipationRun run;
};

// The law of each point, and what was run of it.
std::vector<ModeRun> all_runs(const std::vector<AnticipationPoint>& points) {
  std::vector<ModeRun> all;
  for (const AnticipationPoint& point : points) {
    all.push_back({point, "law", by_law(point)});
    if (point.modelled) all.push_back({point, "modelled", *point.modelled});
    if (point.measured) all.push_back({point, "measured", *point.measured});
  }
  return all;
}

std::string run_object(const ModeRun& of) {
  const AnticipationRun& run = of.run;
  return JsonObject()
      .set("buffer", json_of(of.point.buffer))
      .set("overload", json_of(of.point.overload))
      .set("mode", quoted(of.mode))
      .set("ratio", finite_or_null(run.ratio))
      .set("filled", json_of(run.filled))
      .set("steps_until_late", run.late ? json_of(run.steps) : "null")
      .set("law_steps", run.law < 0 ? "null" : json_of(run.law))
      .set("late_before_peak", json_of(run.late_before))
      .set("least_fill", json_of(run.frames.least_fill))
      .set("frames", json_of(run.frames.frames))
      .set("frames_late", json_of(run.frames.late))
      .set("frames_slow", json_of(run.frames.slow))
      .set("recovery_s", finite_or_null(run.recovery_s))
      .set("buffer_bytes", json_of(run.buffer_bytes))
      .set("rolled_back", json_of(run.rolled_back))
      .text();
}

std::string csv_of(const ModeRun& of) {
  const AnticipationRun& run = of.run;
  const auto number = [](double value) {
    return std::isnan(value) ? std::string() : format_exact(value);
  };
  std::string line =
      std::to_string(of.point.buffer) + "," + format_exact(of.point.overload) + "," + of.mode;
  for (const std::string& cell :
       {number(run.ratio), std::to_string(run.filled),
        run.late ? std::to_string(run.steps) : std::string(),
        run.law < 0 ? std::string() : std::to_string(run.law),
        std::to_string(run.frames.least_fill), std::to_string(run.frames.late),
        std::to_string(run.frames.slow), number(run.recovery_s), number(run.buffer_bytes),
        number(run.rolled_back)})
    line += "," + cell;
  return line + "\n";
}

}  // namespace

std::string anticipation_text(const AnticipationHead& head,
                              const std::vector<AnticipationPoint>& points) {
  std::vector<std::vector<std::string>> rows;
  for (const AnticipationPoint& point : points) {
    rows.push_back({std::to_string(point.buffer), format_number(100 * point.overload) + " %", "law",
                    ratio_text(point.ratio), std::to_string(point.buffer), steps_text(point.law),
                    steps_text(point.law), "", "", "", "", "", ""});
    if (point.modelled) add_run("modelled", point, *point.modelled, rows);
    if (point.measured) add_run("measured", point, *point.measured, rows);
  }
  return head.scene + ": " + std::to_string(head.worlds) +
         (head.worlds == 1 ? " world on " : " worlds on ") + head.workers + ", " +
         format_number(head.options.frames_per_s) + " frames/s, base load " +
         format_number(head.options.utilisation) + ", peak " + head.peak + "\n\n" +
         format_table({right("buffer"),
                       right("overload"),
                       {"mode"},
                       right("r"),
                       right("filled"),
                       right("steps until late"),
                       right("law(filled, r)"),
                       right("least fill"),
                       right("late"),
                       right("slow"),
                       right("recovery"),
                       right("KiB"),
                       right("rolled back")},
                      rows);
}

std::string anticipation_json(const AnticipationHead& head,
                              const std::vector<AnticipationPoint>& points) {
  return JsonObject()
             .set("scene", quoted(head.scene))
             .set("worlds", json_of(head.worlds))
             .set("workers", quoted(head.workers))
             .set("frames_per_s", json_of(head.options.frames_per_s))
             .set("speed", json_of(head.options.speed))
             .set("utilisation", json_of(head.options.utilisation))
             .set("peak", quoted(head.peak))
             .set("points", list_of(all_runs(points), run_object))
             .text() +
         "\n";
}

std::string anticipation_csv(const std::vector<AnticipationPoint>& points) {
  std::string text =
      "buffer,overload,mode,ratio,filled,steps_until_late,law_steps,least_fill,late,slow,"
      "recovery_s,buffer_bytes,rolled_back\n";
  for (const ModeRun& run : all_runs(points)) text += csv_of(run);
  return text;
}

std::string buffer_costs_text(const std::vector<BufferCost>& costs) {
  std::vector<std::vector<std::string>> rows;
  rows.reserve(costs.size());
  for (const BufferCost& cost : costs)
    rows.push_back({std::to_string(cost.buffer), format_number(1e3 * cost.makespan_s) + " ms",
                    format_number(cost.efficiency, 3), format_number(cost.lead_steps, 3),
                    format_number(cost.buffer_bytes / 1024, 3)});
  return format_table({right("buffer"), right("makespan"), right("efficiency"), right("mean lead"),
                       right("KiB")},
                      rows) +
         "\nthe knee is at " + std::to_string(knee_of(costs)) +
         ": no larger buffer is more than 2 % faster\n";
}

std::string buffer_costs_json(const std::string& scene, const std::vector<BufferCost>& costs) {
  return JsonObject()
             .set("scene", quoted(scene))
             .set("over", quoted("makespan"))
             .set("points", list_of(costs,
                                    [](const BufferCost& cost) {
                                      return JsonObject()
                                          .set("buffer", json_of(cost.buffer))
                                          .set("makespan_s", json_of(cost.makespan_s))
                                          .set("efficiency", json_of(cost.efficiency))
                                          .set("lead_steps", json_of(cost.lead_steps))
                                          .set("buffer_bytes", json_of(cost.buffer_bytes))
                                          .text();
                                    }))
             .set("knee", json_of(knee_of(costs)))
             .text() +
         "\n";
}

std::string buffer_costs_csv(const std::vector<BufferCost>& costs) {
  std::string text = "buffer,makespan_s,efficiency,lead_steps,buffer_bytes\n";
  for (const BufferCost& cost : costs)
    text += std::to_string(cost.buffer) + "," + format_exact(cost.makespan_s) + "," +
            format_exact(cost.efficiency) + "," + format_exact(cost.lead_steps) + "," +
            format_exact(cost.buffer_bytes) + "\n";
  return text;
}

}  // namespace soda::analysis
