// Joining the committed parts of all worlds into whole steps, in order.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "models/commit/commit.hpp"
#include "models/transform_buffer/transform_buffer.hpp"

namespace soda::models {

// What worlds call as GVT passes their steps, in order of the steps of each, from any worker
// thread.
class CommitSink {
 public:
  virtual ~CommitSink() = default;
  virtual void add(WorldId world, const BufferEntry& entry) = 0;
  // Whether the entry of this step needs bodies.
  virtual bool wants_states(std::int64_t) const { return true; }
};

// Hands whole steps to the observer in increasing order.
class CommitMerge final : public CommitSink {
 public:
  // `observer` outlives this object. The run begins before `first_step`.
  CommitMerge(const CommitObserver& observer, std::uint32_t worlds, std::int64_t first_step = 0);

  void add(WorldId world, const BufferEntry& entry) override;
  bool wants_states(std::int64_t step) const override { return observer_.wants_states_of(step); }

  std::int64_t committed_steps() const { return committed_steps_; }
  std::uint64_t islands() const { return islands_; }

 private:
  struct Part {
    WorldId world;
    std::vector<physics::BodyId> ids;
    std::vector<physics::BodyState> states;
  };
  struct Pending {
    std::uint32_t worlds = 0;
    std::vector<Part> parts;  // only if the observer wants states
    std::vector<physics::IslandReport> islands;
  };

  void deliver(std::int64_t step, Pending pending);

  const CommitObserver& observer_;
  const std::uint32_t worlds_;
  std::mutex mutex_;
  std::map<std::int64_t, Pending> pending_;
  std::int64_t committed_steps_;
  std::uint64_t islands_ = 0;
};

}  // namespace soda::models
