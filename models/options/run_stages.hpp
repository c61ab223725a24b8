// What a run does besides physics, by its options: decided here for those that do it and for the
// plan.
#pragma once

#include <cstdint>

#include "models/options/run_options.hpp"
#include "physics/model/need.hpp"

namespace soda::models {

// Who drives the worlds. One world has nobody to run ahead of, so it runs in sequence, but on the
// virtual cluster.
ExecutorKind executor_of(const RunOptions& options, std::uint32_t worlds);

// Entries are kept where a world may have to go back, and it does where something can come late.
physics::Need entries_needed(const RunOptions& options, std::uint32_t worlds);
physics::Need rollback_needed(const RunOptions& options, std::uint32_t worlds);

// Of taking over islands in steps that are executed again.
physics::Need repetition_needed(const RunOptions& options, std::uint32_t worlds);

// Of the exchange between worlds: border tests, ghosts, migrations; and of what contacts of bodies
// of two owners take.
physics::Need borders_needed(std::uint32_t worlds);
physics::Need shared_contacts_needed(const physics::SceneDescription& scene, std::uint32_t worlds);

physics::Need balancing_needed(const RunOptions& options, std::uint32_t worlds);

}  // namespace soda::models
