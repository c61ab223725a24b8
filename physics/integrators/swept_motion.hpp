// Islands with joints, solved iteratively like their contacts: where factorising takes more work.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// Joints and contacts of one island.
struct SweptRows {
  JointSystem& joints;
  ContactProblem& problem;
};

// Solves the step in so many substeps, of first order, or in more where overlaps grow
// (next_count()), and moves the bodies (`states`, as before the step); stored impulses stay. Joints
// may stay open, and the next step goes on closing them. The cost is linear in rows. The step gives
// no energy but by motors, springs, what pushes the bodies, and what parts overlaps. Returns the
// number of iterations; the report gets works, errors, and the world's impulses by joints. Nothing,
// states and report as before, where iterations diverge.
std::optional<std::uint32_t> advance_swept(const JointedStep& step, std::uint32_t substeps,
                                           const SweptRows& rows, std::span<BodyState> states,
                                           IslandReport& report);

}  // namespace soda::physics
