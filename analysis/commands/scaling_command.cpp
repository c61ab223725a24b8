#include "analysis/commands/scaling_command.hpp"

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <ostream>

#include "analysis/scaling/scaling_report.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/output_file.hpp"

namespace soda::analysis {
namespace {

constexpr std::uint32_t kMostWorldsOfCurve = 10'000;

std::vector<std::string> listed(const std::string& list) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= list.size() && !list.empty();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    parts.push_back(list.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::vector<std::uint32_t> worlds_of(const std::string& list) {
  std::vector<std::uint32_t> worlds;
  for (const std::string& part : listed(list)) {
    std::uint32_t number = 0;
    const char* const end = part.data() + part.size();
    const auto [at, error] = std::from_chars(part.data(), end, number);
    if (error != std::errc() || at != end || number < 1 || number > kMostWorldsOfCurve)
      throw UsageError("--worlds: found " + part + "; allowed: numbers from 1 to " +
                       std::to_string(kMostWorldsOfCurve) + " with commas between them");
    worlds.push_back(number);
  }
  std::ranges::sort(worlds);
  worlds.erase(std::unique(worlds.begin(), worlds.end()), worlds.end());
  return worlds;
}

std::vector<Rival> rivals_of(const std::string& list) {
  std::vector<Rival> rivals;
  if (list == "none") return rivals;
  for (const std::string& part : listed(list)) {
    const auto known = {Rival::kLockstep, Rival::kInvalidate, Rival::kUngated};
    const auto found =
        std::ranges::find_if(known, [&part](Rival rival) { return part == name_of(rival); });
    if (found == known.end())
      throw UsageError("--against: found " + part +
                       "; allowed: none, or lockstep, invalidate, ungated with commas between "
                       "them");
    if (std::ranges::find(rivals, *found) == rivals.end()) rivals.push_back(*found);
  }
  return rivals;
}

}  // namespace

int scaling_command(const ScalingRequest& request, std::ostream& out, std::ostream& err) {
  const std::vector<std::string> files = scenario_files(request.files, request.library);
  ScalingSetting setting = request.setting;
  setting.worlds = worlds_of(request.worlds);
  setting.rivals = rivals_of(request.against);
  const NetworkPreset& network = network_named(request.network);
  apply_network(network, setting.overrides.cluster);
  std::unique_ptr<OutputFile> page;
  if (!request.page.empty()) {
    for (const std::string& file : files) refuse_own_input(request.page, file, "--output");
    page = std::make_unique<OutputFile>(request.page, request.force);
  }
  ScalingReport report{network,
                       *setting.overrides.cluster.latency_us,
                       *setting.overrides.cluster.bandwidth_mb_s,
                       {}};
  for (const std::string& file : files) report.curves.push_back(measure_scaling(file, setting));
  if (page) {
    page->write(scaling_html(report, request.command));
    page->complete();
  }
  out << (request.json  ? scaling_json(report)
          : request.csv ? scaling_csv(report)
                        : scaling_text(report));
  if (report.all_equal()) return kExitOk;
  err << "soda: a run ended with other bits than the undivided one\n";
  return kExitCheckFailed;
}

}  // namespace soda::analysis
