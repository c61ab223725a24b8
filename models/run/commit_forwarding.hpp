// Committed parts and results of worlds on their way to the root rank.
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "kernel/api/event_recorder.hpp"
#include "kernel/api/payload.hpp"
#include "kernel/executors/distributed_executor.hpp"
#include "models/commit/commit_merge.hpp"
#include "models/run/simulation.hpp"
#include "models/world/world.hpp"

namespace soda::models {

// Where worlds leave their committed parts on a rank that is not the root.
class CommitForwarding final : public CommitSink, public LoadSink, public kernel::TraceSink {
 public:
  // States travel only if `observer` wants them; it outlives this object.
  explicit CommitForwarding(const CommitObserver& observer) : observer_(observer) {}

  void add(WorldId world, const BufferEntry& entry) override;
  void add(LoadSample sample) override;
  void take(kernel::Bytes trace) override;
  bool wants_states(std::int64_t step) const override { return observer_.wants_states_of(step); }

  // All records since the last call.
  std::vector<kernel::Bytes> take();

 private:
  const CommitObserver& observer_;
  std::mutex mutex_;
  std::vector<kernel::Bytes> records_;
};

// Where records of other ranks go; what nobody sends may be null.
struct RecordSinks {
  CommitSink& commits;
  LoadSink* loads = nullptr;
  kernel::TraceSink* trace = nullptr;
  EntryObserver* entries = nullptr;  // on every rank, and a source of records, too
};
// What this rank tells others and hears from them. Both must outlive the hooks.
kernel::RecordHooks record_hooks(CommitForwarding& forwarding, const RecordSinks& sinks);

// Of a world, of a scene of so many bodies, or of all that live here: their work counters, and the
// states that they ended with. `result.final_states` has a place for each body, then or before.
void add_outcome(World& world, std::size_t bodies, SimulationResult& result);
kernel::Bytes encode_outcome(std::span<const std::unique_ptr<kernel::LogicalProcess>> worlds);
void add_outcome(std::span<const std::byte> outcome, SimulationResult& result);

}  // namespace soda::models
