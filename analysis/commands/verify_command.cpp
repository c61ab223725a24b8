#include "analysis/commands/verify_command.hpp"

#include <algorithm>
#include <iterator>
#include <ostream>
#include <utility>

#include "analysis/commands/json_output.hpp"
#include "analysis/measures/error_measures.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/runs/plain_loop.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/random_inputs.hpp"

namespace soda::analysis {
namespace {

using Balancing = models::BalancingPolicy;

constexpr std::int64_t kBalancingInterval = 5;  // verified runs are short

// Ends a run at its first wrong step: what follows would only repeat it.
struct WrongStep {
  std::int64_t step;
  PlainLoop::Bodies bodies;
};

Divergence first_divergence(const physics::SceneDescription& scene, const WrongStep& wrong,
                            const PlainLoop::Bodies& expected) {
  const PlainLoop::Bodies& found = wrong.bodies;
  if (found.ids.size() != expected.ids.size()) {
    return {wrong.step, 0, "number of bodies", static_cast<double>(expected.ids.size()),
            static_cast<double>(found.ids.size())};
  }
  for (std::size_t i = 0; i < expected.ids.size(); ++i) {
    const std::uint32_t label = scene.bodies[physics::index_of(expected.ids[i])].label;
    if (found.ids[i] != expected.ids[i]) {
      return {wrong.step, label, "body id", static_cast<double>(physics::index_of(expected.ids[i])),
              static_cast<double>(physics::index_of(found.ids[i]))};
    }
    const physics::FieldDifference difference =
        physics::first_difference(expected.states[i], found.states[i]);
    if (difference.field[0] != '\0') {
      return {wrong.step, label, difference.field, difference.a, difference.b};
    }
  }
  return {wrong.step, 0, "digest", 0.0, 0.0};
}

// In a job, the other ranks would be left waiting if the root left its run.
void verify_run(const scenarios::Scenario& scenario, const models::TerritoryMap& map,
                kernel::Transport* transport, PlainLoop& oracle, VerifiedRun& run) {
  models::InputOptions inputs = scenario.run.inputs;
  // But for every third seed, inputs come so late that worlds which ran ahead roll back.
  if (run.scheduling_seed > 0) inputs.at_the_last_moment = run.scheduling_seed % 3 != 1;
  models::BalancingOptions balancing{run.balancing, kBalancingInterval, run.scheduling_seed};
  const models::BalancingOptions& users = scenario.run.balancing;
  if (run.scheduling_seed == 0 && run.balancing == users.policy) balancing = users;
  std::optional<WrongStep> first;
  const models::CommitObserver observer{
      .wants_states = true, .on_step = [&](const models::CommittedStep& step) {
        if (first || physics::digest(step.ids, step.states) == oracle.digest_after(step.step))
          return;
        first = WrongStep{
            step.step,
            {{step.ids.begin(), step.ids.end()}, {step.states.begin(), step.states.end()}}};
        if (transport == nullptr) throw *first;
      }};
  try {
    const models::SimulationResult result =
        models::simulate(scenario.scene, scenario.initial, map,
                         {.executor = run.executor,
                          .threads = run.threads,
                          .steps = scenario.run.steps,
                          .buffer = run.buffer,
                          .scheduling_seed = run.scheduling_seed,
                          .rollback = run.rollback,
                          .gating = run.gating,
                          .ghosts = run.ghosts,
                          .balancing = balancing,
                          .transport = transport,
                          .inputs = inputs},
                         observer);
    run.events = result.events;
    run.territory_changes = result.territory_changes.size();
  } catch (const WrongStep&) {
  }
  if (first) run.divergence = first_divergence(scenario.scene, *first, oracle.after(first->step));
}

constexpr models::GhostMode kGhostModes[] = {models::GhostMode::kReceivedOnly,
                                             models::GhostMode::kDeadReckoning,
                                             models::GhostMode::kPredicted};

constexpr Balancing kPolicies[] = {Balancing::kOff, Balancing::kRandom, Balancing::kPaper};

// The modes of a run, by its scheduling seed: with 0 those of the user; else each alone takes all
// its values, their combinations come up as seeds go on.
void draw_modes(const models::RunOptions& users, VerifiedRun run, std::vector<VerifiedRun>& runs) {
  if (run.scheduling_seed == 0) {
    run.rollback = users.rollback;
    run.gating = users.gating;
    run.ghosts = users.ghosts;
    run.balancing = users.balancing.policy;
    runs.push_back(run);
    return;
  }
  const std::uint64_t turn = run.scheduling_seed - 1;
  run.rollback = run.scheduling_seed % 2 == 0 ? models::RollbackMode::kInvalidate
                                              : models::RollbackMode::kPropagate;
  run.gating = run.scheduling_seed / 2 % 2 == 0;
  run.ghosts = kGhostModes[(turn + turn / 3) % std::size(kGhostModes)];
  run.balancing = kPolicies[run.scheduling_seed % std::size(kPolicies)];
  runs.push_back(run);
}

void all_modes(VerifiedRun run, std::vector<VerifiedRun>& runs) {
  for (const auto rollback : {models::RollbackMode::kPropagate, models::RollbackMode::kInvalidate})
    for (const bool gating : {true, false})
      for (const models::GhostMode ghosts : kGhostModes)
        for (const Balancing balancing : kPolicies) {
          run.rollback = rollback;
          run.gating = gating;
          run.ghosts = ghosts;
          run.balancing = balancing;
          runs.push_back(run);
        }
}

// All cells of the matrix: each division once in sequence (not in a job), then under Time Warp.
std::vector<VerifiedRun> matrix(const VerifyRequest& request, const models::RunOptions& users,
                                std::size_t cells) {
  std::vector<VerifiedRun> runs;
  for (const std::uint32_t wanted : request.worlds) {
    VerifiedRun run;
    run.worlds = static_cast<std::uint32_t>(std::min<std::size_t>(wanted, cells));
    if (request.transport == nullptr) {
      runs.push_back(run);
      run.executor = models::ExecutorKind::kThreads;
    } else {
      run.executor = models::ExecutorKind::kMpi;
      run.ranks = request.transport->size();
    }
    for (const unsigned threads : request.threads) {
      run.threads = threads;
      for (const std::int64_t buffer : request.buffers) {
        run.buffer = buffer;
        for (run.scheduling_seed = 0; run.scheduling_seed <= request.seeds; ++run.scheduling_seed) {
          if (request.all_modes)
            all_modes(run, runs);
          else
            draw_modes(users, run, runs);
        }
      }
    }
  }
  return runs;
}

std::string describe(const VerifiedRun& run) {
  std::string text = std::string(name_of(run.executor)) + ", " + std::to_string(run.worlds) +
                     (run.worlds == 1 ? " world" : " worlds");
  if (run.executor == models::ExecutorKind::kSequential) return text;
  if (run.executor == models::ExecutorKind::kMpi)
    text += ", " + std::to_string(run.ranks) + " ranks";
  return text + ", " + std::to_string(run.threads) + " threads, buffer " +
         std::to_string(run.buffer) + ", scheduling seed " + std::to_string(run.scheduling_seed) +
         ", " + name_of(run.rollback) + ", gating " + (run.gating ? "on" : "off") + ", " +
         name_of(run.ghosts) + " ghosts, balancing " + name_of(run.balancing);
}

// Of each path of the kernel, how often it was taken, and in how many runs.
std::string paths_text(const Verification& verification) {
  const kernel::Counters events = verification.events();
  std::string taken, others;
  for (const kernel::KernelPath& path : kernel::kernel_paths()) {
    const std::uint64_t count = events.*path.count;
    const auto runs = std::ranges::count_if(
        verification.runs, [&](const VerifiedRun& run) { return run.events.*path.count > 0; });
    std::string& text = count > 0 ? taken : others;
    text += (text.empty() ? "" : ", ") + std::string(path.name);
    if (count > 0) text += " " + std::to_string(count) + " (" + std::to_string(runs) + " runs)";
  }
  return "paths of the kernel: " + (taken.empty() ? "none" : taken) +
         (others.empty() ? "\n" : "\nnot taken: " + others + "\n");
}

void print(const Verification& verification, std::ostream& out) {
  const kernel::Counters events = verification.events();
  out << verification.scenario << ": " << verification.runs.size() << " runs of "
      << verification.steps << " steps, " << verification.rollbacks() << " rollbacks, "
      << events.rolled_back << " of " << events.executed << " events rolled back, "
      << verification.territory_changes() << " cells changed hands\n"
      << paths_text(verification);
  if (!verification.diverged()) {
    out << "every committed step has the digest of the plain loop; the last one is "
        << format_digest(verification.digest) << "\n";
    return;
  }
  const VerifiedRun& run = verification.runs.back();
  const Divergence& at = *run.divergence;
  out << "DIVERGED: " << describe(run) << "\n  step " << at.step << ", body " << at.body_label
      << ", " << at.field << ": expected " << format_exact(at.expected) << " ("
      << format_bits(at.expected) << "), found " << format_exact(at.found) << " ("
      << format_bits(at.found) << ")\n";
}

}  // namespace

kernel::Counters Verification::events() const {
  kernel::Counters sum;
  for (const VerifiedRun& run : runs) sum += run.events;
  return sum;
}

std::uint64_t Verification::rollbacks() const { return events().rollbacks; }

std::size_t Verification::territory_changes() const {
  std::size_t sum = 0;
  for (const VerifiedRun& run : runs) sum += run.territory_changes;
  return sum;
}

Verification verify(const VerifyRequest& request) {
  Overrides overrides;
  overrides.steps = request.steps;
  overrides.strict = request.strict;
  scenarios::Scenario scenario = load_scenario(request.file, overrides);
  if (request.random_inputs) scenarios::add_random_inputs(*request.random_inputs, scenario);
  PlainLoop oracle(scenario);
  const std::vector<physics::Vec3> positions = centres(scenario.initial);

  Verification verification{.scenario = scenario.name,
                            .steps = scenario.run.steps,
                            .digest = oracle.digest_after(scenario.run.steps),
                            .runs = {},
                            .warnings = {request.file, scenario.warnings}};
  models::TerritoryOptions territory = scenario.territory;
  std::optional<models::TerritoryMap> map;
  for (VerifiedRun run : matrix(request, scenario.run, territory.grid.cell_count())) {
    if (!map || map->worlds() != run.worlds) {
      territory.worlds = run.worlds;
      map = models::make_territory_map(territory, positions, &scenario.scene);
    }
    verify_run(scenario, *map, request.transport, oracle, run);
    verification.runs.push_back(std::move(run));
    const bool ends = verification.diverged();
    if (request.transport != nullptr ? request.transport->agree(ends).code != 0 : ends) break;
  }
  return verification;
}

int verify_command(const VerifyRequest& request, std::ostream& out, std::ostream& err) {
  const Verification verification = verify(request);
  if (request.transport != nullptr && !request.transport->is_root()) return kExitOk;
  tell_warnings({verification.warnings}, err);
  if (request.json) {
    out << verification_json(verification);
  } else {
    print(verification, out);
  }
  if (verification.diverged()) return kExitCheckFailed;
  if (request.require_rollbacks && verification.rollbacks() == 0) {
    if (!request.json) out << "FAILED: no run rolled back, so nothing was proved\n";
    return kExitCheckFailed;
  }
  return kExitOk;
}

}  // namespace soda::analysis
