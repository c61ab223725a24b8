// Springs beside contacts that are slow enough to be followed: explicit impulses before
// their contacts are solved.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// The joints of an island that contacts hold, too, if all of them are springs that steps of its
// length can follow in a few parts; else none.
JointSystem find_explicit_springs(const IslandStep& island, std::span<const BodyState> states);

// In how many parts of time_s the springs are followed: at most half a radian of their fastest
// swing each. At least 1.
int parts_of_explicit_springs(const SceneDescription& scene, double time_s,
                              std::span<const BodyId> ids, const JointSystem& springs,
                              std::span<const BodyState> states);

// Gives the bodies what the springs, as they are, give in dt_s: a step of this and then of contacts
// is of first order, and where these take no energy it has no drift (symplectic Euler). What the
// world gives is added to `report`.
void apply_explicit_springs(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                            const JointSystem& springs, std::span<BodyState> states,
                            IslandReport& report);

// By how much springs can change the velocity of a point of each body in time_s, m/s. As the
// springs are and move now.
std::vector<double> most_changed_by_springs_m_s(const SceneDescription& scene, double time_s,
                                                std::span<const BodyId> ids,
                                                const JointSystem& springs, const BodySizes& sizes,
                                                std::span<const BodyState> states);

}  // namespace soda::physics
