#include "analysis/view_command.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/exit_codes.hpp"
#include "analysis/logged_run.hpp"
#include "analysis/output_file.hpp"
#include "analysis/view_page.hpp"
#include "analysis/warnings.hpp"

namespace soda::analysis {
namespace {

constexpr std::int64_t kBodyFrames = 300'000;  // 34 bytes each, 46 as text

std::int64_t steps_a_frame(const LogReader& log) {
  const auto bodies = static_cast<std::int64_t>(std::max<std::size_t>(1, log.labels().size()));
  const std::int64_t frames = std::max<std::int64_t>(2, kBodyFrames / bodies);
  return std::max<std::int64_t>(1, (log.last_step() + frames - 1) / frames);
}

}  // namespace

int view_command(const ViewRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  const std::string file = request.page_file.empty() ? request.file + ".html" : request.page_file;
  tell_flaws(log, request.file, err);
  refuse_own_input(file, request.file, "-o");
  OutputFile page(file, request.force);
  log.last_states();  // there are some
  // A multiple of the steps whose states there are.
  const std::int64_t apart = log.options().every;
  const std::int64_t wanted = request.every.value_or(steps_a_frame(log));
  const std::int64_t every = (wanted + apart - 1) / apart * apart;
  const scenarios::Scenario scenario = logged_scenario(log, {});
  tell_warnings({{log.scenario().file, scenario.warnings}}, err);
  const Recording recording = record(log, scenario, every);
  page.write(view_page(recording));
  page.complete();
  out << file << ": " << recording.bodies.size() << " bodies, " << recording.worlds << " worlds, "
      << recording.steps.size() << " frames (every " << every << " of " << log.last_step()
      << " steps); open it in a browser\n";
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
