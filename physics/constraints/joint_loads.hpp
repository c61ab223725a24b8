// What joints that can break bear within a step, and which of them break.
#pragma once

#include <span>

#include "physics/constraints/joint_rows.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/need.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

Need breaks_needed(const SceneDescription& scene);

// Adds to what the report has of the joint. Limits and motors are parts of what a joint bears.
void add_load(const JointLoad& load, IslandReport& report);
// The impulses of the rows of those joints that can break.
void add_loads(const JointSystem& joints, IslandReport& report);

// At the end of a step: those that bore more than they can are broken in both of their bodies.
// Takes the loads out of the report; an island of which a joint breaks does not rest.
void break_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<BodyState> states, IslandReport& report, StageCounters& counters);

}  // namespace soda::physics
