#include "analysis/commands/groups_command.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include "analysis/commands/run_command.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/groups/groups_report.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/output_file.hpp"

namespace soda::analysis {
namespace {

constexpr std::int64_t kMostSweepBodies = 100'000;
constexpr std::uint32_t kMostSweepWorlds = 2'000;

std::vector<GroupBond> bonds_of(const GroupsRequest& request) {
  const std::vector<GroupBond> all{GroupBond::kOverlap, GroupBond::kContact, GroupBond::kRollbacks};
  const bool sweeps = request.file.empty();
  if (request.by.empty()) return sweeps ? std::vector{GroupBond::kOverlap} : all;
  std::vector<GroupBond> bonds;
  for (const GroupBond bond : all) {
    const bool named = std::ranges::find(request.by, name_of(bond)) != request.by.end();
    const bool asked = named || std::ranges::find(request.by, "all") != request.by.end();
    if (sweeps && bond == GroupBond::kRollbacks) {
      if (named) throw UsageError("--by rollbacks: nothing runs without a FILE");
      continue;
    }
    if (asked) bonds.push_back(bond);
  }
  return bonds;
}

std::vector<models::MapKind> maps_of(const std::vector<std::string>& names) {
  std::vector<models::MapKind> maps;
  for (const models::MapKind map : {models::MapKind::kPaper, models::MapKind::kBlocks})
    if (names.empty() || std::ranges::find(names, name_of(map)) != names.end()) maps.push_back(map);
  return maps;
}

// Of the same name as in the paper, and one for the threshold of cubic territories.
struct Axes {
  std::vector<std::int64_t> bodies;
  std::vector<std::uint32_t> worlds;
  std::vector<models::MapKind> maps;
  int figure = 0;  // of the paper; 0: none
};

Axes axes_of(const GroupsRequest& request) {
  const std::vector<models::MapKind> maps = maps_of(request.maps);
  if (request.preset == "paper-fig6") return {{50, 100, 200, 300, 500, 1000}, {12}, maps, 6};
  if (request.preset == "paper-fig7") return {{500}, {12, 24, 48, 100}, maps, 7};
  if (request.preset == "threshold") {
    std::vector<std::int64_t> bodies;
    for (std::int64_t n = 500; n <= 6000; n += 500) bodies.push_back(n);
    return {bodies, {480}, {models::MapKind::kBlocks}};
  }
  Axes axes{request.bodies, request.worlds, maps};
  if (axes.bodies.empty()) axes.bodies = {500};
  if (axes.worlds.empty()) axes.worlds = {12};
  return axes;
}

template <class T>
void check_range(const char* option, const std::vector<T>& values, T most) {
  for (const T value : values)
    if (value < 1 || value > most)
      throw UsageError(std::string(option) + ": found " + std::to_string(value) +
                       "; allowed: 1 to " + std::to_string(most));
}

void check_options(const GroupsRequest& request) {
  const bool scans = !request.bodies.empty() || !request.worlds.empty();
  if (!request.preset.empty() && (scans || !request.file.empty()))
    throw UsageError(
        "--preset: says itself how many bodies and worlds; no FILE, --bodies, --worlds");
  if (request.preset == "threshold" && !request.maps.empty())
    throw UsageError("--map: the threshold is that of blocks");
  if (request.check && request.preset != "paper-fig6" && request.preset != "paper-fig7")
    throw UsageError(
        "--check: needs --preset paper-fig6 or paper-fig7; nothing else has known figures");
  if (request.check && !request.by.empty() && request.by != std::vector<std::string>{"overlap"})
    throw UsageError("--check: the known figures are --by overlap");
  if (request.file.empty()) {
    if (request.steps) throw UsageError("--steps: needs a FILE");
    check_range("--bodies", request.bodies, kMostSweepBodies);
    check_range("--worlds", request.worlds, kMostSweepWorlds);
    return;
  }
  if (!request.bodies.empty() || !request.maps.empty() || request.seeds != "1..20")
    throw UsageError("--bodies, --map, --seeds: are those of the FILE");
  if (request.worlds.size() > 1) throw UsageError("--worlds: one number with a FILE");
}

const FigureRow* known_row(const SweepPoint& point, int figure) {
  if (point.bond != GroupBond::kOverlap) return nullptr;
  for (const FigureRow& row : figure_rows()) {
    const bool same =
        row.map == point.map && row.bodies == point.bodies && row.worlds == point.worlds;
    if (same && (figure == 0 || row.figure == figure)) return &row;
  }
  return nullptr;
}

std::vector<SweepPoint> points_of(const Axes& axes, const std::vector<GroupBond>& bonds) {
  std::vector<SweepPoint> points;
  for (const GroupBond bond : bonds)
    for (const models::MapKind map : axes.maps)
      for (const std::uint32_t worlds : axes.worlds)
        for (const std::int64_t bodies : axes.bodies) {
          SweepPoint& point = points.emplace_back(SweepPoint{bond, map, bodies, worlds, nullptr});
          point.known = known_row(point, axes.figure);
        }
  return points;
}

// On a terminal only.
class PointLine {
 public:
  explicit PointLine(std::size_t points) : points_(points), shown_(isatty(STDERR_FILENO) != 0) {}
  ~PointLine() {
    if (shown_) std::cerr << "\r\x1b[K" << std::flush;
  }
  void show(std::size_t point) const {
    if (shown_) std::cerr << "\r\x1b[Kpoint " << point + 1 << " of " << points_ << std::flush;
  }

 private:
  std::size_t points_;
  bool shown_;
};

SweepReport sweep_report(const GroupsRequest& request) {
  std::vector<GroupBond> bonds = bonds_of(request);
  if (request.preset == "threshold" && request.by.empty())
    bonds = {GroupBond::kOverlap, GroupBond::kContact};
  const std::vector<SweepPoint> points = points_of(axes_of(request), bonds);
  const SeedRange seeds = parse_seeds(request.seeds);
  const PointLine line(points.size());
  return {request.preset, seeds,
          sweep_groups(points, seeds, [&line](std::size_t point) { line.show(point); })};
}

struct RemovedLog {
  std::string file;
  ~RemovedLog() {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }
};

// Returns the exit code of the run. The virtual cluster makes rollbacks a function of the file.
int run_to_log(const GroupsRequest& request, const std::string& log_file, LogLevel level,
               std::ostream& err) {
  RunRequest run;
  run.file = request.file;
  run.overrides.executor = models::ExecutorKind::kVirtual;
  run.overrides.steps = request.steps;
  if (!request.worlds.empty()) run.overrides.worlds = request.worlds[0];
  run.log_file = log_file;
  run.log_level = level;
  std::ostringstream unread;
  return run_command(run, unread, err);
}

template <class Report>
void put_out(const GroupsRequest& request, const Report& report, OutputFile* page,
             std::ostream& out) {
  if (page != nullptr) {
    page->write(groups_html(report, request.command));
    page->complete();
  }
  out << (request.json  ? groups_json(report)
          : request.csv ? groups_csv(report)
                        : groups_text(report));
}

int run_groups(const GroupsRequest& request, OutputFile* page, std::ostream& out,
               std::ostream& err) {
  const std::vector<GroupBond> bonds = bonds_of(request);
  const RemovedLog own{(std::filesystem::temp_directory_path() /
                        ("soda-groups-" + std::to_string(getpid()) + ".sodalog"))
                           .string()};
  const bool traces = std::ranges::find(bonds, GroupBond::kRollbacks) != bonds.end();
  const int code =
      run_to_log(request, own.file, traces ? LogLevel::kTrace : LogLevel::kCommits, err);
  if (code != kExitOk) return code;
  LogReader log(own.file);
  const scenarios::Scenario scenario = logged_scenario(log, {});
  put_out(request,
          RunGroupsReport{scenario.name, scenario.territory.worlds,
                          groups_of_run(log, scenario, bonds)},
          page, out);
  return kExitOk;
}

}  // namespace

int groups_command(const GroupsRequest& request, std::ostream& out, std::ostream& err) {
  check_options(request);
  std::unique_ptr<OutputFile> page;
  if (!request.page_file.empty()) {
    if (!request.file.empty()) refuse_own_input(request.page_file, request.file, "-o");
    page = std::make_unique<OutputFile>(request.page_file, request.force);
  }
  if (!request.file.empty()) return run_groups(request, page.get(), out, err);
  const SweepReport report = sweep_report(request);
  put_out(request, report, page.get(), out);
  return request.check && std::ranges::any_of(report.results, is_off) ? kExitCheckFailed : kExitOk;
}

}  // namespace soda::analysis
