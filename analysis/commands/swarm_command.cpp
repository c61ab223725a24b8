#include "analysis/commands/swarm_command.hpp"

#include <memory>
#include <ostream>

#include "analysis/commands/search_json.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/seed_range.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

std::vector<std::unique_ptr<SwarmSubject>> subjects(const SwarmRequest& request) {
  std::vector<std::unique_ptr<SwarmSubject>> all;
  for (const std::string& file : request.files)
    all.push_back(
        scene_subject(file, std::max(request.most_steps, request.end.value_or(1)), request.strict));
  if (all.empty()) all.push_back(phold_subject());
  return all;
}

Trial make_trial(const SwarmRequest& request, const SwarmSubject& subject, std::uint64_t seed) {
  Trial trial{seed, subject.draw_size(seed), std::nullopt};
  if (request.lps) trial.size.lps = *request.lps;
  if (request.end) trial.size.end = *request.end;
  if (request.window) trial.size.window = *request.window;
  if (request.processors) trial.size.processors = *request.processors;
  trial.size.processors = std::min(trial.size.processors, trial.size.lps);
  if (request.decisions) trial.decisions = parse_decisions(*request.decisions);
  return trial;
}

void add(const TrialSums& more, TrialSums& sums) {
  sums.executed += more.executed;
  sums.rolled_back += more.rolled_back;
  sums.committed += more.committed;
  sums.rollbacks += more.rollbacks;
  sums.anti_messages += more.anti_messages;
}

void print(const SwarmResult& result, std::ostream& out) {
  out << result.trials << " trials in " << format_number(result.wall_s) << " s"
      << (result.out_of_time ? " (out of time)" : "") << ": " << result.sums.committed
      << " events committed, " << result.sums.rolled_back << " of " << result.sums.executed
      << " rolled back in " << result.sums.rollbacks << " rollbacks, " << result.sums.anti_messages
      << " anti-messages\n";
  if (!result.failure) {
    out << "every commit is the oracle's, every rule held\n";
    return;
  }
  const SwarmFailure& failure = *result.failure;
  out << "FAILED: seed " << failure.seed << (failure.file.empty() ? "" : " of " + failure.file)
      << "\n  " << failure.what << "\nshrunk in " << failure.smallest.tried << " trials to\n  "
      << failure.smallest.what << "\nreproduce with\n  " << failure.command << "\n";
}

}  // namespace

SwarmResult swarm(const SwarmRequest& request) {
  const SeedRange seeds = parse_seeds(request.seeds);
  const auto all = subjects(request);
  const Stopwatch stopwatch;
  SwarmResult result;
  for (const std::unique_ptr<SwarmSubject>& subject : all)
    result.warnings.push_back({subject->file(), subject->warnings()});
  const auto out_of_time = [&] {
    result.wall_s = stopwatch.elapsed().wall_s;
    result.out_of_time = request.budget_s > 0.0 && result.wall_s > request.budget_s;
    return result.out_of_time;
  };
  for (std::uint64_t seed = seeds.first; seed <= seeds.last; ++seed) {
    for (const std::unique_ptr<SwarmSubject>& subject : all) {
      if (out_of_time()) return result;
      const Trial trial = make_trial(request, *subject, seed);
      const TrialOutcome outcome = run_isolated(*subject, trial);
      ++result.trials;
      add(outcome.sums, result.sums);
      if (!outcome.failed) continue;
      const ShrunkTrial smallest =
          shrink(*subject, trial, outcome.what, {request.most_shrinking, out_of_time});
      result.failure = SwarmFailure{subject->file(), seed, outcome.what, smallest,
                                    reproducing_command(*subject, smallest.trial)};
      return result;
    }
  }
  result.wall_s = stopwatch.elapsed().wall_s;
  return result;
}

int swarm_command(const SwarmRequest& request, std::ostream& out, std::ostream& err) {
  const SwarmResult result = swarm(request);
  tell_warnings(result.warnings, err);
  if (request.json)
    out << swarm_json(result);
  else
    print(result, out);
  return result.failure ? kExitCheckFailed : kExitOk;
}

}  // namespace soda::analysis
