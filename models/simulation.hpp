// Building the worlds of a scene and running them: what the layers above see of SODA.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernel/executor.hpp"
#include "kernel/recorded_executor.hpp"
#include "kernel/transport.hpp"
#include "kernel/virtual_executor.hpp"
#include "models/entry_observer.hpp"
#include "models/territory.hpp"
#include "models/user_input.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::models {

// What a rollback costs. The committed bits are the same, but for kWarm: its bits depend on which
// rollbacks there were.
enum class RollbackMode {
  kPropagate,   // re-executed steps compute again only what changed
  kInvalidate,  // they compute all again: the baseline
  kWarm,        // as kPropagate, and solves start from the multipliers of the replaced execution
};

// What a world takes for the ghosts of a step that a neighbour has not sent yet, though it has sent
// ghosts in the step before. The committed bits are the same; see guessed_ghosts.hpp.
enum class GhostMode {
  kTold,           // nothing: it ignores bodies that it has not been told of
  kDeadReckoning,  // bodies that go on with constant velocity, as distributed games do
  kPredicted,      // what their owner computes of them if nothing touches them
};

// Who decides about territories. The committed bits are the same.
enum class BalancingPolicy {
  kOff,     // they stay as they are
  kPaper,   // cells go from loaded worlds to their neighbours: load_balancer.hpp
  kRandom,  // cells change hands at random: for tests
};

struct BalancingOptions {
  BalancingPolicy policy = BalancingPolicy::kOff;
  std::int64_t interval = 10;  // steps between decisions, >= 1
  std::uint64_t seed = 1;      // kRandom only
};

// A cell changed hands at the begin of `step`.
struct TerritoryChange {
  std::int64_t step = 0;
  std::uint32_t cell = 0;  // Grid::index_of_cell
  WorldId from{}, to{};
  friend bool operator==(const TerritoryChange&, const TerritoryChange&) = default;
};

enum class ExecutorKind { kSequential, kThreads, kVirtual, kMpi };

struct RunOptions {
  ExecutorKind executor = ExecutorKind::kSequential;
  unsigned threads = 1;               // kThreads: >= 1; kMpi: of each rank
  std::int64_t first_step = 0;        // before which the run begins, >= 0
  std::int64_t steps = 0;             // after which it ends, counted from 0; >= first_step
  std::int64_t buffer = 48;           // entries of each world's transform buffer, >= 1
  std::uint64_t scheduling_seed = 0;  // see kernel::ThreadsOptions
  RollbackMode rollback = RollbackMode::kPropagate;
  bool gating = true;  // worlds whose bodies touch wait for each other (gating.hpp)
  // Giant islands that lie on several processors are solved block by block, each by one of them
  // (split_plan.hpp); else each solves the whole. Needs gating, and ghosts that are told. The
  // committed bits are the same.
  bool split_islands = true;
  GhostMode ghosts = GhostMode::kTold;
  BalancingOptions balancing = {};
  // kMpi only: the other ranks, each of which makes the same call.
  kernel::Transport* transport = nullptr;
  // Not for kSequential.
  kernel::Synchronisation synchronisation = kernel::Synchronisation::kOptimistic;
  InputOptions inputs = {};
  // Who sends to worlds from outside; each outlives the run. Over ranks, the root's count.
  std::vector<kernel::Outside*> outsides = {};
  EntryObserver* entries = nullptr;  // who is told how far worlds are; outlives the run
  // Ends the run at the next commit when it is no longer 0; may be null, or outlives the run.
  const kernel::StopRequest* stop = nullptr;
  // kVirtual only. Its window and synchronisation are those above, and its costs are those of
  // work_cost.hpp unless `constant_cost`: then each event costs bag_cost_ns, and nothing else does.
  kernel::VirtualOptions cluster = {};
  // What an event costs that would cost the second argument; none: that.
  std::function<std::int64_t(WorldId, std::int64_t)> event_cost_ns = {};
  bool constant_cost = false;
  // A traced run again, in the order in which it was executed: instead of what `executor` says.
  // Nothing comes from outside; `outsides` and balancing must be none.
  const kernel::RecordedOrder* recorded = nullptr;
  bool recorded_over_ranks = false;
  bool recorded_whole = true;  // else it is only the beginning of the order
};

// Work that only divided scenes have; sums over all worlds, speculative work included.
struct WorldCounters {
  std::uint64_t border_tests = 0;    // own bodies tested against the territory map
  std::uint64_t ghosts_sent = 0;     // body copies
  std::uint64_t fragments_sent = 0;  // cross-owner contacts sent to an owner
  std::uint64_t records_sent = 0;    // island records sent in merge rounds
  std::uint64_t merge_rounds = 0;    // sync executions that received records
  std::uint64_t migrations = 0;      // bodies sent to a new owner
  std::uint64_t mixed_islands = 0;   // solves (or shares) of islands with several owners
  std::uint64_t islands_reused = 0;  // mixed islands taken from another world's solve
  // Giant ones among the mixed islands of which this world has solved a part or none, and heard
  // how its bodies ended; and those that it had to solve whole, for others did not tell.
  std::uint64_t islands_split = 0, splits_given_up = 0;
  // Solves that counted: for each committed step and world, the islands with one of its bodies.
  std::uint64_t solves_committed = 0;
  std::uint64_t entries_saved = 0;  // transform-buffer entries kept for rollback
  std::uint64_t bytes_sent = 0;     // payload bytes
  std::uint64_t inputs = 0;         // messages with user input that were taken in
  // What storing entries has taken from the heap, and what their states would take if none were
  // shared: sizeof a state and a contact impulse, without an allocator's own.
  std::uint64_t entries_stored = 0, bodies_stored = 0;
  std::uint64_t state_bytes_stored = 0, state_bytes_whole = 0;
  std::uint64_t memo_bytes_stored = 0;  // what a repetition of the step may take over
  // Of steps that were executed again: islands (bodies without contact count as one each) and their
  // bodies, computed again or taken over.
  std::uint64_t steps_repeated = 0;
  std::uint64_t steps_put_back = 0;  // stale entries that were valid as they stood
  // Late ghosts that made no difference: bags, and bodies looked at to find that out.
  std::uint64_t bags_absorbed = 0, absorption_looks = 0;
  std::uint64_t islands_repeated = 0, islands_taken = 0;
  std::uint64_t islands_warm = 0;  // of the repeated ones: solved from earlier multipliers
  std::uint64_t bodies_repeated = 0, bodies_taken = 0;
  // Guesses: bodies guessed, each time a step was executed with the guess. What a neighbour sent
  // for a step that had been executed with a guess (the last one counts): messages, and those that
  // were as guessed, bit for bit; the bodies guessed, and those that came just so.
  std::uint64_t ghosts_guessed = 0;
  std::uint64_t guesses_answered = 0, guesses_confirmed = 0;
  std::uint64_t ghosts_answered = 0, ghosts_confirmed = 0;
  // Contacts of two owners: found by some execution of a step whose committed execution does not
  // have them; and not found by some execution, though the committed one has them. Counted on the
  // virtual cluster, and where ghosts are guessed.
  std::uint64_t contacts_false = 0, contacts_missed = 0;
  std::uint64_t bodies_sampled = 0;  // for load balancing
  // Events that an undivided run has, too: the beginnings, pairs and ends of steps, of the first
  // world.
  std::uint64_t events_alone = 0;
};
WorldCounters& operator+=(WorldCounters& sum, const WorldCounters& more);

// The state after `step` steps, complete over all worlds and final.
struct CommittedStep {
  std::int64_t step = 0;                 // first_step + 1 .. steps
  std::span<const physics::BodyId> ids;  // those that are there; empty unless states are wanted
  std::span<const physics::BodyState> states;
  std::span<const WorldId> owners;                 // of each body during this step
  std::span<const physics::IslandReport> islands;  // ascending by label, each island once
  std::span<const CommittedInput> inputs;  // of the step's beginning, in the order of acting
  std::span<const TerritoryChange> territory_changes;  // of the step's beginning
};

// Where a world stands that may yet be rolled back: its bodies at the start of the step in
// progress.
struct WorldStand {
  WorldId world{};
  std::int64_t step = 0;  // after so many
  std::vector<physics::BodyId> ids;
  std::vector<physics::BodyState> states;  // of ids
};

struct CommitObserver {
  // Whether on_step needs ids, states and owners; what nobody wants is not gathered. If it does, of
  // the steps that `states_every` (>= 1) divides.
  bool wants_states = false;
  std::int64_t states_every = 1;
  bool wants_states_of(std::int64_t step) const { return wants_states && step % states_every == 0; }
  // Called in order of steps, one call at a time, from any worker thread.
  std::function<void(const CommittedStep&)> on_step;
  // Whether the life of every event is written down, for on_trace.
  bool wants_trace = false;
  // A chunk for kernel::TraceChunk; called from any worker thread, in order of those of a worker.
  std::function<void(std::span<const std::byte>)> on_trace = {};
  // Called once for each world, at the end of a recorded run that is not whole.
  std::function<void(WorldStand)> on_stand = {};
};

struct SimulationFault {
  std::int64_t step = 0;  // the step whose execution failed
  WorldId world{};
  std::uint32_t body_label = 0;
  std::string what;
};

struct SimulationResult {
  // The last of them, from 0; == options.steps unless there was a fault or a stop.
  std::int64_t committed_steps = 0;
  std::uint32_t stopped = 0;  // the request that ended the run early; 0: none did
  std::vector<physics::BodyState> final_states;  // after committed_steps; index == BodyId
  std::vector<physics::BodyId> final_ids;        // ascending; others are absent, their states void
  std::vector<CommittedInput> inputs;            // all that acted, in the order of acting
  std::size_t inputs_too_late = 0;               // others, for which no step was left
  kernel::Counters events;
  kernel::EventCounts kinds;  // as event_kinds.hpp names them
  physics::StageCounters stages;
  WorldCounters worlds;
  std::uint64_t islands_committed = 0;
  std::vector<TerritoryChange> territory_changes;  // in order of steps
  std::optional<kernel::VirtualReport> cluster;    // kVirtual only
  std::optional<SimulationFault> fault;
};

// Of the final states of the bodies that are there.
std::uint64_t final_digest(const SimulationResult& result);

struct Progress {
  std::int64_t committed_step = 0;
  double efficiency = 1.0;  // 1 - rolled back / executed, so far
};

// Runs the scene, divided by `map`, from options.first_step to options.steps. The committed steps
// are the same bits for every map and every option but the inputs, and wherever a run begins.
// `initial[i]` is the state of BodyId{i} at the first step, void if it is absent; `scene` is as
// inputs before have left it. Over ranks, only the root observes and has the result; elsewhere it
// says no more than whether there was a fault. Of a recorded run that is not whole it has
// committed_steps only.
SimulationResult simulate(const physics::SceneDescription& scene,
                          std::span<const physics::BodyState> initial, const TerritoryMap& map,
                          const RunOptions& options, const CommitObserver& observer = {},
                          const std::function<void(const Progress&)>& progress = {});

}  // namespace soda::models
