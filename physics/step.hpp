// One whole step of an undivided scene: the bare physics loop, against which worlds are measured.
#pragma once

#include <span>
#include <vector>

#include "physics/advance.hpp"
#include "physics/geometry.hpp"
#include "physics/islands.hpp"

namespace soda::physics {

// Memory of a step that is worth keeping between steps; carries no meaning from one to the next.
struct StepScratch {
  std::vector<Aabb> boxes;
  std::vector<IndexPair> pairs, static_pairs;
  std::vector<ContactManifold> manifolds;
  Islands islands;
  std::vector<BodyId> island_ids;
  std::vector<BodyState> island_states;
  std::vector<ContactManifold> island_manifolds;
};

// What a step leaves behind besides the new states.
struct StepReport {
  std::vector<IslandReport> islands;  // ascending by label
  std::vector<AdvanceFault> faults;
};

// Advances states[i] (of body BodyId{i}) by one step. Same bits as any division into worlds.
void step(const SceneDescription& scene, const Geometry& geometry, std::span<BodyState> states,
          StepScratch& scratch, StepReport& report, StageCounters& counters);

}  // namespace soda::physics
