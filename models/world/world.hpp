// A world: the logical process that simulates the bodies of one territory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "models/messages/schedule.hpp"
#include "models/transform_buffer/transform_buffer.hpp"
#include "models/world/border_tests.hpp"
#include "models/world/contact_exchange.hpp"
#include "models/world/dependency_waits.hpp"
#include "models/world/ghost_extrapolation.hpp"
#include "models/world/island_advance.hpp"
#include "models/world/later_passes.hpp"
#include "models/world/outgoing.hpp"
#include "models/world/split_islands.hpp"
#include "models/world/step_in_progress.hpp"
#include "models/world/step_recorder.hpp"
#include "models/world/straggler_absorption.hpp"
#include "models/world/surroundings.hpp"

namespace soda::models {

// The events of one step are in docs/step-protocol.md. Between steps a world's state is
// its newest buffer entry, so only step starts are restart points: a rollback to any time of step k
// restarts at (k, kBegin) from entry k.
//
// Its handlers say what happens in a phase and when the next one is. How it happens is the job of
// its parts, which share the step in progress.
class World final : public kernel::LogicalProcess {
 public:
  // `initial`: the entry of the first step. `buffer` >= 1: entries that the world may run ahead.
  World(const WorldSurroundings& surroundings, WorldId id, std::int64_t buffer,
        BufferEntry initial);
  World(const World&) = delete;  // parts refer to one another
  World& operator=(const World&) = delete;

  kernel::VirtualTime next_time() const override { return next_; }
  void execute(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) override;
  void mark(kernel::VirtualTime now) override;
  kernel::VirtualTime rewind(kernel::VirtualTime to) override;
  kernel::VirtualTime forget(kernel::VirtualTime horizon) override;
  bool absorb(kernel::VirtualTime now, Bag bag) override;
  bool absorbs() const override { return step_.divided() && step_.propagates(); }
  kernel::Refusal refusal() const override { return stragglers_.refusal(); }
  bool is_as_before() const override;
  bool jumps() const override { return step_.divided() && step_.propagates(); }
  void jump(kernel::VirtualTime limit) override;
  bool holds(kernel::VirtualTime now, Bag bag) const override;
  std::vector<kernel::LpId> eager_cancellations() const override;
  bool waits_for_dependencies() const override { return waits_.are_on() && step_.divided(); }
  void commit(kernel::VirtualTime now) override;
  std::uint64_t digest() const override;

  const physics::StageCounters& stages() const { return step_.work.stages; }
  const WorldCounters& counters() const { return step_.work.worlds; }
  const WorkReading& work() const { return step_.work; }
  // The newest entry, without memo: after a run, the state after its last step. In `copy`, or
  // valid until the world executes.
  const BufferEntry& newest_entry(BufferEntry& copy) const {
    return buffer_.read(buffer_.newest(), true, copy);
  }
  // After a run that was stopped: takes back what was executed after the first `steps` steps, which
  // are committed. The newest entry is theirs then.
  void end_after(std::int64_t steps) { buffer_.truncate(steps, step_.work.worlds); }
  // The newest entry; the world is of no use any more.
  BufferEntry release_newest_entry() { return buffer_.release_newest(); }

 private:
  void begin(std::int64_t step, Bag bag);
  void detect(std::int64_t step, Outgoing& out);
  void border_traversal(kernel::VirtualTime now, Bag bag, Outgoing& out);
  void pairs(kernel::VirtualTime now, Bag bag, Outgoing& out);
  void sync(kernel::VirtualTime now, Bag bag, Outgoing& out);
  void split(kernel::VirtualTime now, Bag bag, Outgoing& out);
  void solve(kernel::VirtualTime now, Bag bag, Outgoing& out);
  void finish(std::int64_t step, Outgoing& out);

  void start_parts(std::int64_t step);
  void take_bodies(std::int64_t step);
  void receive_ghosts(std::int64_t step, Bag bag);
  void find_contacts(std::int64_t step, Outgoing& out);
  kernel::VirtualTime after_round(std::int64_t step, std::uint32_t next) const;
  std::uint64_t append_gathered(std::uint64_t digest) const;
  void tell_newest() const;

  kernel::VirtualTime next_;
  TransformBuffer buffer_;
  bool keeps_history_ = false;  // an executor that may roll back calls mark
  StepInProgress step_;
  DependencyWaits waits_;
  GhostExtrapolation extrapolation_{step_};
  StepRecorder recorder_{step_, buffer_, waits_, extrapolation_};
  BorderTests borders_{step_, waits_, extrapolation_};
  ContactExchange exchange_{step_, waits_};
  SplitIslands splits_{step_};
  IslandAdvance islands_{step_, waits_, extrapolation_, splits_};
  LaterPasses passes_{step_};
  StragglerAbsorption stragglers_{step_, buffer_, extrapolation_};
  BufferEntry committed_;  // memory only
};

}  // namespace soda::models
