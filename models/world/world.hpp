// A world: the logical process that simulates the bodies of one territory.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/api/partition.hpp"
#include "models/commit/commit_merge.hpp"
#include "models/cost/work_cost.hpp"
#include "models/ghosts/guess_audit.hpp"
#include "models/islands/island_merge.hpp"
#include "models/islands/solve_share.hpp"
#include "models/islands/split_solve.hpp"
#include "models/load_balancing/load_sample.hpp"
#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"
#include "models/options/entry_observer.hpp"
#include "models/options/run_options.hpp"
#include "models/options/world_counters.hpp"
#include "models/territory/cell_cover.hpp"
#include "models/territory/map_share.hpp"
#include "models/transform_buffer/repetition.hpp"
#include "models/transform_buffer/transform_buffer.hpp"
#include "models/user_input/scene_versions.hpp"
#include "models/world/absorption.hpp"
#include "physics/step/step.hpp"

namespace soda::models {

// What all worlds of a run share: read-only, but for those that are safe to use concurrently and
// cannot change a result (the memories of solves, scenes and maps, the gathering of committed
// steps).
struct WorldSurroundings {
  const physics::Geometry& geometry;
  SolveShare& solves;
  SceneVersions& scenes;
  MapShare& maps;
  CommitSink& commits;
  RollbackMode rollback;
  bool gating;
  kernel::Partition processes;  // which worlds share the memory of solves with which
  // The processor of each world, if giant islands are split between processors; else empty.
  std::span<const std::uint32_t> processors;
  std::int64_t exchange_ns;  // of a message between them, about
  GhostMode ghosts;
  bool audits;  // counts what came of foreign contacts
  LoadSampling sampling;
  LoadSink* loads;         // null if nothing is sampled
  EntryObserver* entries;  // or null
};

// The events of one step are in docs/step-protocol.md. Between steps a world's state is
// its newest buffer entry, so only step starts are restart points: a rollback to any time of step k
// restarts at (k, kBegin) from entry k.
class World final : public kernel::LogicalProcess {
 public:
  // `initial`: the entry of the first step. `buffer` >= 1: entries that the world may run ahead.
  World(const WorldSurroundings& surroundings, WorldId id, std::int64_t buffer,
        BufferEntry initial);

  kernel::VirtualTime next_time() const override { return next_; }
  void execute(kernel::VirtualTime now, std::span<const kernel::MessageView> bag,
               kernel::Outbox& outbox) override;
  void mark(kernel::VirtualTime now) override;
  kernel::VirtualTime rewind(kernel::VirtualTime to) override;
  kernel::VirtualTime forget(kernel::VirtualTime horizon) override;
  bool absorb(kernel::VirtualTime now, std::span<const kernel::MessageView> bag) override;
  bool absorbs() const override { return divided() && propagates(); }
  kernel::Refusal refusal() const override { return refusal_; }
  bool is_as_before() const override;
  bool jumps() const override { return divided() && propagates(); }
  void jump(kernel::VirtualTime limit) override;
  bool holds(kernel::VirtualTime now, std::span<const kernel::MessageView> bag) const override;
  std::vector<kernel::LpId> disappoints() const override;
  bool gates() const override { return around_.gating && divided(); }
  void commit(kernel::VirtualTime now) override;
  std::uint64_t digest() const override;

  const physics::StageCounters& stages() const { return stages_; }
  const WorldCounters& counters() const { return counters_; }
  WorkReading work() const { return {stages_, replicated_, counters_}; }
  // The newest entry, without memo: after a run, the state after its last step. In `copy`, or
  // valid until the world executes.
  const BufferEntry& newest_entry(BufferEntry& copy) const {
    return buffer_.read(buffer_.newest(), true, copy);
  }
  // After a run that was stopped: takes back what was executed after the first `steps` steps, which
  // are committed. The newest entry is theirs then.
  void end_after(std::int64_t steps) { buffer_.truncate(steps, counters_); }
  // The newest entry; the world is of no use any more.
  BufferEntry release_newest_entry() { return buffer_.release_newest(); }

 private:
  using Bag = std::span<const kernel::MessageView>;

  void begin(std::int64_t step, Bag bag);
  std::vector<physics::BodyId> take_inputs(Bag bag);
  void detect(std::int64_t step, kernel::Outbox& outbox);
  void border_traversal(std::int64_t step, Bag bag);
  Heard completed(const Rules& rules, const ForeignView& before, Heard heard);
  Heard completed_again(const Rules& rules, const ForeignView& before,
                        std::span<const physics::BodyId> changed, const Heard& was, Heard heard);
  std::vector<Ghost> ghosts_and_guesses(std::int64_t step, Bag bag);
  bool absorb_sent(kernel::VirtualTime now, Bag bag);
  bool absorb_with_guesses(std::int64_t from, Bag bag);
  std::function<bool(physics::BodyId)> own_bodies(std::int64_t step) const;
  std::optional<ExecutedStep> executed_step(std::int64_t step, std::vector<Ghost>& ghosts) const;
  bool comes_out_alike(std::int64_t step, std::span<const Ghost> usable);
  void adopt_ghosts(std::int64_t step, Heard heard, std::vector<Ghost> usable);
  void audit_guesses(std::int64_t step, const Heard& heard);
  void note_known(std::span<const std::uint32_t> bodies, const KnownBodies& known);
  void audit_contacts(std::int64_t step, const std::map<WorldId, Fragment>& fragments);
  void pairs(std::int64_t step, kernel::Outbox& outbox);
  void hear_of_sent(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox);
  void connect_sent(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox);
  bool connect(const SentBody& sent, std::uint32_t own, std::map<WorldId, Fragment>& fragments);
  void sync(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox);
  void split(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox);
  void solve(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox);
  void send_sent(kernel::VirtualTime now, kernel::Outbox& outbox);
  void pass_on(const SentBody& sent, kernel::VirtualTime when, kernel::Outbox& outbox);
  SentBody sent_own(std::uint32_t place) const;
  std::vector<physics::BodyState> states_at_start() const;
  void finish(std::int64_t step, kernel::Outbox& outbox);

  bool divided() const { return rules_.map->worlds() > 1; }
  kernel::VirtualTime after_round(std::int64_t step, std::uint32_t next) const;
  bool has_changed(const Fragment& fragment) const;
  void take_in_fragment(std::uint32_t pass, WorldId from, const Fragment& fragment);
  void take_in_records(std::uint32_t pass, std::uint32_t round, WorldId from,
                       const Records& records);
  void send_fragments(std::int64_t step, std::map<WorldId, Fragment> fragments,
                      kernel::Outbox& outbox);
  bool remembers() const { return keeps_history_ && divided() && propagates(); }
  bool guesses() const { return around_.ghosts != GhostMode::kTold && divided(); }
  bool audits() const { return around_.audits && keeps_history_; }
  bool propagates() const { return around_.rollback != RollbackMode::kInvalidate; }
  bool may_split() const;
  void start_splits();
  void consider_split(std::size_t island, const KnownBodies& known);
  bool take_split(Bag bag);
  bool advance_known_islands(kernel::VirtualTime now, Bag bag);
  bool advance_island(kernel::VirtualTime now, Bag bag, std::size_t island,
                      const KnownBodies& known, std::span<physics::BodyState> states);
  void begin_pass(std::span<const std::uint32_t> bodies, std::size_t manifolds, std::uint32_t pass,
                  const KnownBodies& known);
  void end_pass(std::span<const std::uint32_t> bodies, const KnownBodies& known);
  void note_owners(std::size_t island, const KnownBodies& known);
  void advance_own_island(std::uint32_t pass);
  bool take_resting(physics::IslandReport& report);
  void advance_mixed_island(std::int64_t step, WorldId label_owner);
  void advance_free_bodies();
  void start_warm();
  void count_repetition(bool taken, std::size_t bodies);
  void remember_island(std::size_t island, const KnownBodies& known, bool mixed);
  void remember_contacts(std::int64_t step, std::span<const physics::ContactManifold> for_others);
  void write_entry(std::int64_t step, bool somebody_leaves, kernel::Outbox& outbox);
  std::int64_t spent_since_last_entry();
  void tell_newest() const {
    if (around_.entries != nullptr) around_.entries->on_newest(id_, buffer_.newest());
  }
  void report_faults(kernel::Outbox& outbox) const;
  bool send_migrants(std::int64_t step, kernel::Outbox& outbox);
  void send(WorldId to, kernel::VirtualTime when, MessageKind kind, kernel::Payload payload,
            kernel::Outbox& outbox);

  const WorldSurroundings around_;
  const WorldId id_;
  kernel::VirtualTime next_;
  TransformBuffer buffer_;
  bool keeps_history_ = false;  // an executor that may roll back calls mark

  // The step in progress; all of it is rebuilt from an entry when the step restarts.
  Rules rules_;
  std::vector<physics::BodyId> ids_;  // own bodies, ascending
  std::vector<physics::BodyState> states_;
  Gate gate_;                   // of the step before; empty if it does not gate
  Expected expected_;           // from it
  Gate next_gate_;              // of this step, as far as it goes
  std::vector<WorldId> owed_;   // worlds that get ghosts, if only an empty message; ascending
  ForeignView next_view_;       // of this step, as far as it goes; only if it guesses()
  std::vector<Ghost> ghosts_;   // ascending by id, none of them own
  std::vector<SentBody> sent_;  // foreign bodies that hits have sent on; ascending by id
  Repetition repetition_;
  std::uint32_t solves_ = 0;  // islands with an own body
  StepMemo memo_;             // only if it remembers()
  IslandMerge merge_;
  std::vector<std::unique_ptr<SplitSolve>> splits_;  // ascending by label
  physics::StepScratch scratch_;
  physics::StepReport report_;
  BufferEntry committed_;    // memory only
  CellCovers covers_;        // of own bodies
  kernel::Refusal refusal_;  // of the last absorb()

  physics::StageCounters stages_;
  physics::StageCounters replicated_;  // of these, what another process does, too
  WorldCounters counters_;
  GuessAudit audit_;
  WorkReading work_at_entry_;  // when the last entry was written; only for samples
};

}  // namespace soda::models
