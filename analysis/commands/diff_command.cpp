#include "analysis/commands/diff_command.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <ostream>
#include <span>

#include "analysis/commands/search_json.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/trace_words.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

// The first line in which two texts differ, from 1.
std::size_t first_line_that_differs(const std::string& a, const std::string& b) {
  const auto at = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return 1 + static_cast<std::size_t>(std::count(a.begin(), at, '\n'));
}

std::string in_words(const std::vector<scenarios::MeshFile>& meshes) {
  std::string text = std::to_string(meshes.size()) + " files";
  for (const scenarios::MeshFile& mesh : meshes) text += ", " + mesh.name;
  return text;
}

void compare_settings(const LogReader& a, const LogReader& b,
                      std::vector<LogDifference::Setting>& settings) {
  const auto add = [&settings](const std::string& name, std::string x, std::string y) {
    if (x != y) settings.push_back({name, {std::move(x), std::move(y)}});
  };
  add("program version", a.scenario().program_version, b.scenario().program_version);
  if (a.scenario().text != b.scenario().text) {
    const std::string line =
        ", line " + std::to_string(first_line_that_differs(a.scenario().text, b.scenario().text)) +
        " differs";
    settings.push_back({"scenario", {a.scenario().file + line, b.scenario().file + line}});
  }
  if (!std::ranges::equal(a.meshes(), b.meshes(), {}, &scenarios::MeshFile::bytes,
                          &scenarios::MeshFile::bytes))
    settings.push_back({"mesh files", {in_words(a.meshes()), in_words(b.meshes())}});
  if (a.labels() != b.labels())
    settings.push_back({"bodies",
                        {std::to_string(a.labels().size()) + " in all",
                         std::to_string(b.labels().size()) + " in all"}});
  const std::vector<OptionText> x = in_words(a.options()), y = in_words(b.options());
  for (std::size_t i = 0; i < x.size(); ++i) add(x[i].name, x[i].value, y[i].value);
}

ByteBuffer inputs_of(const LoggedStep& step) {
  LoggedStep inputs;
  inputs.step = step.step;
  inputs.inputs = step.inputs;
  return encode_step(inputs);
}

std::optional<LogDifference::Step> compare_steps(const LoggedStep& a, const LoggedStep& b,
                                                 const std::vector<std::uint32_t>& labels) {
  if (inputs_of(a) != inputs_of(b)) return LogDifference::Step{a.step, "inputs", {}, {}};
  if (!a.has_states || !b.has_states) {
    if (a.digest == b.digest) return std::nullopt;
    return LogDifference::Step{a.step, "digest", {}, {}};
  }
  if (a.ids != b.ids) return LogDifference::Step{a.step, "bodies", {}, {}};
  for (std::size_t i = 0; i < a.ids.size(); ++i) {
    if (physics::identical(a.states[i], b.states[i])) continue;
    const physics::FieldDifference field = physics::first_difference(a.states[i], b.states[i]);
    return LogDifference::Step{
        a.step, field.field, labels[physics::index_of(a.ids[i])], {field.a, field.b}};
  }
  return std::nullopt;
}

std::string text_of(const LogDifference::Step& step) {
  std::string text = "first difference: step " + std::to_string(step.step);
  if (!step.body) return text + ", " + step.what + "\n";
  text += ", body " + std::to_string(*step.body) + ", " + step.what + "\n";
  for (const double value : step.values)
    text += "  " + format_exact(value) + " (" + format_bits(value) + ")\n";
  const std::optional<std::uint64_t> ulps = ulps_between(step.values[0], step.values[1]);
  return text + (ulps ? "  " + std::to_string(*ulps) + " ulps apart\n" : std::string());
}

std::string text_of(const std::vector<HistoryDifference>& events) {
  if (events.empty()) return "events: the same in all worlds\n";
  const auto sides = [](const HistoryDifference& event) {
    return "  " + side_text(event.first) + "\n  " + side_text(event.second) + "\n";
  };
  std::string text = "first event that differs: world " + std::to_string(events[0].world) +
                     ", its happening " + std::to_string(events[0].happening) + ", at " +
                     milliseconds(events[0].clock_ns) + "\n" + sides(events[0]);
  for (const HistoryDifference& event : std::span(events).subspan(1))
    text += "then world " + std::to_string(event.world) + ", its happening " +
            std::to_string(event.happening) + ", at " + milliseconds(event.clock_ns) + "\n" +
            sides(event);
  return text;
}

void compare_events(LogReader& first, LogReader& second, LogDifference& difference) {
  if (first.options().level != LogLevel::kTrace || second.options().level != LogLevel::kTrace)
    return;
  const std::uint32_t worlds = logged_scenario(first, {}).territory.worlds;
  if (logged_scenario(second, {}).territory.worlds != worlds ||
      first.first_step() != second.first_step())
    return;
  difference.compares_events = true;
  difference.events = differences_of(histories_of(first, worlds), histories_of(second, worlds));
}

std::string text_of(const LogDifference& difference, const DiffRequest& request) {
  std::string text;
  if (!difference.settings.empty()) {
    std::vector<std::vector<std::string>> rows;
    for (const auto& [name, values] : difference.settings)
      rows.push_back({name, values[0], values[1]});
    text += format_table({{"what differs"}, {request.files[0]}, {request.files[1]}}, rows) + "\n";
  }
  const auto [a, b] = difference.last_steps;
  if (a != b)
    text += "steps: " + std::to_string(a) + " and " + std::to_string(b) + "; compared up to " +
            std::to_string(std::min(a, b)) + "\n";
  text += difference.step
              ? text_of(*difference.step)
              : "the same bit for bit up to step " + std::to_string(std::min(a, b)) + "\n";
  return difference.compares_events ? text + text_of(difference.events) : text;
}

}  // namespace

std::optional<std::uint64_t> ulps_between(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return std::nullopt;
  // In the order of the numbers: what is negative lies below, the larger its size.
  const auto place = [](double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
    return (bits & kSign) != 0 ? ~bits : bits | kSign;
  };
  const std::uint64_t x = place(a), y = place(b);
  return x > y ? x - y : y - x;
}

LogDifference difference_of(LogReader& first, LogReader& second) {
  LogDifference difference;
  compare_settings(first, second, difference.settings);
  difference.last_steps = {first.last_step(), second.last_step()};
  if (first.labels() != second.labels()) {
    difference.step = LogDifference::Step{0, "bodies", {}, {}};
    return difference;
  }
  const std::int64_t begin = std::max(first.first_step(), second.first_step());
  const std::int64_t last = std::min(first.last_step(), second.last_step());
  for (std::int64_t step = begin; step <= last && !difference.step; ++step) {
    difference.step = compare_steps(first.read_step(step), second.read_step(step), first.labels());
    if (!difference.step) ++difference.equal_steps;
  }
  compare_events(first, second, difference);
  return difference;
}

int diff_command(const DiffRequest& request, std::ostream& out, std::ostream& err) {
  LogReader first(request.files[0]), second(request.files[1]);
  tell_flaws(first, request.files[0], err);
  tell_flaws(second, request.files[1], err);
  const LogDifference difference = difference_of(first, second);
  out << (request.json ? diff_json(difference) : text_of(difference, request));
  const bool is_sound = first.damage().empty() && second.damage().empty();
  return difference.step || !is_sound ? kExitCheckFailed : kExitOk;
}

}  // namespace soda::analysis
