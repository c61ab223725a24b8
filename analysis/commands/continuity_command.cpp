#include "analysis/commands/continuity_command.hpp"

#include <algorithm>
#include <filesystem>
#include <ostream>

#include "analysis/commands/search_json.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/whole/whole_trial.hpp"
#include "analysis/whole/whole_workers.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

std::vector<ContinuityKind> kinds_of(const ContinuityRequest& request) {
  if (!request.kinds.empty()) return parse_continuity_kinds(request.kinds);
  std::vector<ContinuityKind> all;
  for (std::size_t i = 0; i < kContinuityKinds; ++i) all.push_back(static_cast<ContinuityKind>(i));
  return all;
}

void keep_scenes(std::uint64_t seed, ContinuityKind kind, const std::string& folder) {
  const auto pair = change(draw_continuity_scene(seed, kind), seed, kind);
  const std::string name = std::string(name_of(kind)) + "-" + std::to_string(seed);
  write_scene(pair->plain, folder, name + "-plain");
  write_scene(pair->changed, folder, name + "-changed");
}

SeedReport try_seed(std::uint64_t seed, const std::string& folder, const ContinuityRequest& request,
                    const std::vector<ContinuityKind>& kinds) {
  SeedReport report;
  for (const ContinuityKind kind : kinds) {
    const ContinuityOutcome outcome = try_continuity(seed, kind, folder);
    put(report.bytes, static_cast<std::uint32_t>(kind));
    put(report.bytes, static_cast<std::uint32_t>(outcome.ending));
    put(report.bytes, outcome.steps);
    put(report.bytes, outcome.worst);
    put(report.bytes, outcome.what);
    if (outcome.ending != ContinuityEnding::kFailed) continue;
    report.failed = true;
    if (!request.folder.empty()) keep_scenes(seed, kind, request.folder);
  }
  return report;
}

void take_report(std::uint64_t seed, std::size_t kinds, const ByteBuffer& bytes,
                 ContinuityResult& result) {
  ByteReader reader(bytes);
  for (std::size_t i = 0; i < kinds; ++i) {
    const auto kind = static_cast<ContinuityKind>(reader.take<std::uint32_t>());
    const auto ending = static_cast<ContinuityEnding>(reader.take<std::uint32_t>());
    const auto steps = reader.take<std::int64_t>();
    const double worst = reader.take_double();
    const std::string what = reader.take_string();
    if (ending == ContinuityEnding::kNoChange) continue;
    ContinuityTally& tally = result.tallies[static_cast<std::size_t>(kind)];
    ++tally.trials;
    tally.steps += static_cast<std::uint64_t>(steps);
    tally.worst = std::max(tally.worst, worst);
    tally.same_bits += ending == ContinuityEnding::kSameBits;
    tally.rounding += ending == ContinuityEnding::kRounding;
    tally.failed += ending == ContinuityEnding::kFailed;
    if (ending == ContinuityEnding::kFailed) result.failures.push_back({seed, kind, what});
  }
}

}  // namespace

ContinuityResult check_continuity(const ContinuityRequest& request) {
  const SeedRange seeds = parse_seeds(request.seeds);
  const std::vector<ContinuityKind> kinds = kinds_of(request);
  const Stopwatch stopwatch;
  if (!request.folder.empty()) {
    std::error_code error;
    std::filesystem::create_directories(request.folder, error);
    if (error) throw scenarios::FileError(request.folder + ": " + error.message());
  }
  ContinuityResult result;
  result.end = share_seeds(
      seeds, {request.jobs, request.budget_s, request.most_failures},
      [&](std::uint64_t seed, const std::string& folder) {
        return try_seed(seed, folder, request, kinds);
      },
      [&](std::uint64_t seed, const ByteBuffer& bytes) {
        take_report(seed, kinds.size(), bytes, result);
      });
  std::ranges::sort(result.failures, [](const auto& a, const auto& b) {
    return a.seed != b.seed ? a.seed < b.seed : a.kind < b.kind;
  });
  result.wall_s = stopwatch.elapsed().wall_s;
  return result;
}

std::string continuity_text(const ContinuityResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < kContinuityKinds; ++i) {
    const ContinuityTally& tally = result.tallies[i];
    if (tally.trials == 0) continue;
    rows.push_back({name_of(static_cast<ContinuityKind>(i)), std::to_string(tally.trials),
                    std::to_string(tally.same_bits), std::to_string(tally.rounding),
                    std::to_string(tally.failed), std::to_string(tally.steps),
                    format_number(tally.worst, 3)});
  }
  std::string text = format_table({{"change"},
                                   {"scenes", Align::kRight},
                                   {"same bits", Align::kRight},
                                   {"rounding", Align::kRight},
                                   {"failed", Align::kRight},
                                   {"steps", Align::kRight},
                                   {"worst over allowed", Align::kRight}},
                                  rows);
  text += format_number(result.wall_s) + " s" + text_of(result.end) + "\n";
  for (const ContinuityFailure& failure : result.failures)
    text += "FAILED: seed " + std::to_string(failure.seed) + ", " + name_of(failure.kind) + ": " +
            failure.what + "\n";
  return text;
}

int continuity_command(const ContinuityRequest& request, std::ostream& out) {
  const ContinuityResult result = check_continuity(request);
  out << (request.json ? continuity_json(result) : continuity_text(result));
  return exit_code_of(result.end, !result.failures.empty());
}

}  // namespace soda::analysis
