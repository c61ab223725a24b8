// Who wants to know how far worlds have run ahead.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernel/api/payload.hpp"
#include "models/territory/territory.hpp"

namespace soda::models {

class EntryObserver {
 public:
  virtual ~EntryObserver() = default;
  // The newest entry of `world` is that of `step` now: written just before, or the restart point
  // of a rollback. Called by the thread that executes the world. Must not wait for other worlds.
  virtual void on_newest(WorldId world, std::int64_t step) = 0;

  // Over ranks each has an observer of its own worlds. What that of the root says goes to all
  // others, and what they say to that of the root, in order and before the run ends. Called by one
  // thread, while others execute worlds.
  virtual std::vector<kernel::Bytes> take_news() { return {}; }
  virtual void receive(std::span<const std::byte> /*news*/) {}
};

}  // namespace soda::models
