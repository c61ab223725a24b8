// One whole step of an undivided scene, and the stages it is made of. Worlds call the same stages:
// what a step costs beyond them is the cost of dividing space.
#pragma once

#include <span>
#include <vector>

#include "physics/broadphase/islands.hpp"
#include "physics/broadphase/pair_cache.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/step/sent_on.hpp"
#include "physics/step/sleeping_islands.hpp"

namespace soda::physics {

// Memory that is worth keeping between steps; carries no meaning from one to the next.
struct StepScratch {
  std::vector<Aabb> boxes;
  PairCache pair_cache;
  SleepingIslands resting;
  std::vector<IndexPair> pairs, static_pairs;
  std::vector<ContactManifold> manifolds;
  Islands islands;
  std::vector<BodyId> island_ids;
  std::vector<BodyState> island_states;
  std::vector<ContactManifold> island_manifolds;
  Passes passes;
  SolveScratch solve;
};

// What a step leaves behind besides the new states.
struct StepReport {
  std::vector<IslandReport> islands;  // ascending by label
  std::vector<AdvanceFault> faults;
};

struct StepEffects {
  StepScratch& scratch;
  StepReport& report;
  StageCounters& counters;
};

// Stage 1: the swept box of each body. `ids` ascending, states[i] of ids[i]; `boxes` is
// overwritten.
void compute_boxes(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids, std::span<const BodyState> states,
                   std::vector<Aabb>& boxes, StageCounters& counters);

// Stage 2: all contacts among these bodies and with statics, in canonical order. Reads
// scratch.boxes, overwrites scratch.manifolds.
void find_contacts(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids, std::span<const BodyState> states,
                   StepScratch& scratch, StageCounters& counters);

// Stages 1 and 2 for whoever has no use for the boxes: the same contacts, though most boxes are
// never made. Leaves scratch.boxes void.
void find_contacts_alone(const SceneDescription& scene, const Geometry& geometry,
                         std::span<const BodyId> ids, std::span<const BodyState> states,
                         StepScratch& scratch, StageCounters& counters);

// Gathers island `island` of scratch.islands into scratch.island_ids, island_states and
// island_manifolds; scatter moves the states back. Between the two, states[] of its bodies are
// void.
void gather_island(std::size_t island, std::span<const BodyId> ids, std::span<BodyState> states,
                   StepScratch& scratch);
void scatter_island(std::size_t island, std::span<BodyState> states, StepScratch& scratch);

// Stage 3: islands from the manifolds, each advanced by itself, in as many passes as hits send
// bodies on (sent_on.hpp); then the bodies without contact. Reads and adds to the scratch's
// manifolds; its boxes are those of `states` or empty. The report is appended to.
void advance_bodies(const SceneDescription& scene, const Geometry& geometry,
                    std::span<const BodyId> ids, std::span<BodyState> states,
                    const StepEffects& effects);

// Takes back what the gathered island's bodies have reported in an earlier pass.
void forget_reports(std::span<const BodyId> ids, StepReport& report);

// Advances states[i] (of body BodyId{i}) by one step: the three stages. The report is overwritten.
// Same bits as any division into worlds.
void step(const SceneDescription& scene, const Geometry& geometry, std::span<const BodyId> ids,
          std::span<BodyState> states, const StepEffects& effects);

}  // namespace soda::physics
