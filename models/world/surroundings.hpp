// Where a world lives: what it shares with the others, and how the run treats all of them.
#pragma once

#include <cstdint>
#include <span>

#include "kernel/api/partition.hpp"
#include "models/commit/commit_merge.hpp"
#include "models/islands/solve_share.hpp"
#include "models/load_balancing/load_sample.hpp"
#include "models/options/entry_observer.hpp"
#include "models/options/run_options.hpp"
#include "models/territory/map_share.hpp"
#include "models/user_input/scene_versions.hpp"
#include "physics/shapes/geometry.hpp"

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
  // The processor of each world, if large islands are split between processors; else empty.
  std::span<const std::uint32_t> processors;
  std::int64_t exchange_ns;  // of a message between them, about
  GhostMode ghosts;
  bool audits;  // counts what came of foreign contacts
  LoadSampling sampling;
  LoadSink* loads;         // null if nothing is sampled
  EntryObserver* entries;  // or null
};

}  // namespace soda::models
