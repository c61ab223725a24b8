#include "analysis/commands/fuzz_command.hpp"

#include <filesystem>
#include <ostream>

#include "analysis/commands/search_json.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/seed_range.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// The text goes into a JSON string.
std::string description_of(std::uint64_t seed, std::string what) {
  for (char& c : what)
    if (c == '"' || c == '\\' || c == '\n' || c == '\t') c = ' ';
  return "Random scene " + std::to_string(seed) + ", shrunk. " + what;
}

FuzzFailure shrunk_failure(const FuzzScene& scene, const std::string& what,
                           const FuzzRequest& request, const std::function<bool()>& out_of_time) {
  const ShrunkScene smallest = shrink(scene, what, {request.most_shrinking, out_of_time});
  FuzzFailure failure{scene.seed, {}, what, smallest.what, smallest.tried, {}};
  failure.text = scenario_text(smallest.scene, description_of(scene.seed, smallest.what));
  if (request.folder.empty()) return failure;
  const auto path = std::filesystem::path(request.folder);
  failure.file = (path / ("fuzz-" + std::to_string(scene.seed) + ".json")).string();
  OutputFile file(failure.file, request.force);
  file.write(failure.text);
  file.complete();
  return failure;
}

void check_files(const FuzzRequest& request, FuzzResult& result) {
  for (const std::string& file : request.files) {
    const std::string text = scenarios::read_text(file);
    const FileWarnings warnings{file, scenarios::read_scenario_text(text, file).warnings};
    if (request.strict) refuse_warnings(file, warnings.warnings);
    result.warnings.push_back(warnings);
    const FuzzOutcome outcome = try_scene(text, file);
    ++result.trials;
    add(outcome.sums, result.sums);
    if (outcome.failed) result.failures.push_back({0, file, outcome.what, outcome.what, 0, {}});
  }
}

void search(const FuzzRequest& request, const Stopwatch& stopwatch, FuzzResult& result) {
  const SeedRange seeds = parse_seeds(request.seeds);
  const auto out_of_time = [&] {
    result.out_of_time = request.budget_s > 0.0 && stopwatch.elapsed().wall_s > request.budget_s;
    return result.out_of_time;
  };
  const FuzzJoints joints = request.springs  ? FuzzJoints::kSprings
                            : request.joints ? FuzzJoints::kRigid
                                             : FuzzJoints::kNone;
  for (std::uint64_t seed = seeds.first; seed <= seeds.last; ++seed) {
    if (out_of_time() || result.failures.size() >= request.most_failures) return;
    const FuzzScene scene = draw_scene(seed, request.steps, joints);
    const FuzzOutcome outcome = try_drawn(scene);
    ++result.trials;
    add(outcome.sums, result.sums);
    if (outcome.failed)
      result.failures.push_back(shrunk_failure(scene, outcome.what, request, out_of_time));
  }
}

WholeRequest whole_request(const FuzzRequest& request) {
  WholeRequest whole = request.whole;
  whole.seeds = request.seeds;
  whole.budget_s = request.budget_s;
  whole.most_failures = request.most_failures;
  whole.most_shrinking = request.most_shrinking;
  whole.folder = request.folder;
  whole.jobs = request.jobs;
  whole.json = request.json;
  return whole;
}

ContinuityRequest continuity_request(const FuzzRequest& request) {
  ContinuityRequest continuity = request.continuity;
  continuity.seeds = request.seeds;
  continuity.budget_s = request.budget_s;
  continuity.most_failures = request.most_failures;
  continuity.folder = request.folder;
  continuity.jobs = request.jobs;
  continuity.json = request.json;
  return continuity;
}

void print(const FuzzResult& result, std::ostream& out) {
  const FuzzSums& sums = result.sums;
  out << result.trials << " scenes in " << format_number(result.wall_s) << " s"
      << (result.out_of_time ? " (out of time)" : "") << ", " << sums.steps << " steps, "
      << sums.islands << " islands, " << sums.contact_points
      << " contact points; most of an island " << sums.most_iterations << " iterations, "
      << sums.most_multiplications << " multiplications; largest gain of energy "
      << format_number(sums.largest_gain) << " of what is allowed; work of push-out "
      << format_number(sums.push_out_work_joule) << " J\n";
  if (result.failures.empty()) out << "every check held\n";
  for (const FuzzFailure& failure : result.failures) {
    out << "FAILED: "
        << (failure.text.empty() ? failure.file : "seed " + std::to_string(failure.seed)) << "\n  "
        << failure.what << "\n";
    if (failure.text.empty()) continue;
    out << "shrunk in " << failure.tried << " trials to\n  " << failure.shrunk_what << "\n";
    if (failure.file.empty())
      out << failure.text;
    else
      out << "reproduce with\n  soda fuzz " << failure.file << "\n";
  }
}

}  // namespace

FuzzResult fuzz(const FuzzRequest& request) {
  const Stopwatch stopwatch;
  FuzzResult result;
  if (request.files.empty())
    search(request, stopwatch, result);
  else
    check_files(request, result);
  result.wall_s = stopwatch.elapsed().wall_s;
  return result;
}

int fuzz_command(const FuzzRequest& request, std::ostream& out, std::ostream& err) {
  if ((request.is_whole || request.is_continuity) && !request.files.empty())
    throw UsageError("--whole and --continuity draw their scenes; allowed: no FILE");
  if (request.is_continuity) return continuity_command(continuity_request(request), out);
  if (request.is_whole) return whole_command(whole_request(request), out);
  const FuzzResult result = fuzz(request);
  tell_warnings(result.warnings, err);
  if (request.json)
    out << fuzz_json(result);
  else
    print(result, out);
  return result.failures.empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
