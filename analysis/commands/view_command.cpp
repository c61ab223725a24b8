#include "analysis/commands/view_command.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/viewer/timeline.hpp"
#include "analysis/viewer/view_page.hpp"

namespace soda::analysis {
namespace {

constexpr std::int64_t kBodyFrames = 600'000;  // 17 bytes each, 23 as text

std::int64_t steps_a_frame(const LogReader& log) {
  const auto bodies = static_cast<std::int64_t>(std::max<std::size_t>(1, log.labels().size()));
  const std::int64_t frames = std::max<std::int64_t>(2, kBodyFrames / bodies);
  const std::int64_t steps = log.last_step() - log.first_step();
  return std::max<std::int64_t>(1, (steps + frames - 1) / frames);
}

std::string said_of(const std::optional<Timeline>& timeline) {
  if (!timeline) return ", no timeline (it needs --log-level trace)";
  return ", " + std::to_string(timeline->all_executions) + " events, " +
         std::to_string(timeline->all_rollbacks) + " rollbacks";
}

}  // namespace

std::string write_page(LogReader& log, const scenarios::Scenario& scenario, OutputFile& page,
                       std::optional<std::int64_t> asked) {
  log.last_states();  // there are some
  // A multiple of the steps whose states there are.
  const std::int64_t apart = log.options().every;
  const std::int64_t every = (asked.value_or(steps_a_frame(log)) + apart - 1) / apart * apart;
  const Recording recording = record(log, scenario, every);
  const std::optional<Timeline> timeline = timeline_of(log, scenario);
  page.write(view_page(recording, timeline));
  page.complete();
  return page.file() + ": " + std::to_string(recording.bodies.size()) + " bodies, " +
         std::to_string(recording.worlds) + " worlds, " + std::to_string(recording.steps.size()) +
         " frames (every " + std::to_string(every) + " of " + std::to_string(log.last_step()) +
         " steps)" + said_of(timeline) + "; open it in a browser\n";
}

int view_command(const ViewRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  const std::string file = request.page_file.empty() ? request.file + ".html" : request.page_file;
  tell_flaws(log, request.file, err);
  refuse_own_input(file, request.file, "-o");
  OutputFile page(file, request.force);
  const scenarios::Scenario scenario = logged_scenario(log, {});
  tell_warnings({{log.scenario().file, scenario.warnings}}, err);
  out << write_page(log, scenario, page, request.every);
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
