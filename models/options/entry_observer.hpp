// Who wants to know how far worlds have run ahead.
#pragma once

#include <cstdint>

#include "models/territory/territory.hpp"

namespace soda::models {

class EntryObserver {
 public:
  virtual ~EntryObserver() = default;
  // The newest entry of `world` is that of `step` now: written just before, or the restart point
  // of a rollback. Called by the thread that executes the world. Must not wait for other worlds.
  virtual void on_newest(WorldId world, std::int64_t step) = 0;
};

}  // namespace soda::models
