// One island over a time in one solve, and one body that touches nothing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

struct ContactProblem;
struct JointSystem;

// How far contacts of several bodies are solved, and of which order a step is.
enum class Exactness : std::uint8_t {
  kOngoing,   // they may leave a trace to the next step
  kAccurate,  // to rounding, where that can be afforded
  kCompared   // so, and of first order in all: for what is extrapolated from steps of other lengths
};

// Advances the bodies of one island with each contact as the manifolds have it, to the end of its
// time. The geometry is not looked at.
IslandReport advance_once(const IslandStep& island, Exactness how, std::span<BodyState> states,
                          const IslandEffects& effects);

// The same of an island with joints, over no more than a substep: joints and contacts are swept.
IslandReport advance_substep(const IslandStep& island, std::span<BodyState> states,
                             const IslandEffects& effects);

// Keeps the impulses of joints and contacts in the states, in the manifolds' order.
void store_jointed_impulses(const IslandStep& island, const ContactProblem& problem,
                            const JointSystem& joints, std::span<BodyState> states);

// What an island begins its step with.
IslandReport report_of(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds);

// Counts what joints alone have moved.
void count_linked(const SceneDescription& scene, std::span<const BodyId> ids,
                  const JointSystem& joints, const IslandReport& report, StageCounters& counters);

// Of a later part of the same step: sums, and the largest errors.
void add_part(const IslandReport& part, IslandReport& report);

// Advances one body that touches nothing, by dt_s.
void advance_free_body(const SceneDescription& scene, double dt_s, BodyId id, BodyState& state,
                       StageCounters& counters, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
