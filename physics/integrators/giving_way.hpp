// Contacts where joints were closed: what lies on a jointed body gives way to it.
#pragma once

#include <limits>
#include <span>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// What that took: energy, and what the world gave, angular impulses about the origin.
struct GivenWay {
  double work_joule = 0.0;
  Vec3 by_world_newton_s = Vec3::Zero(), by_world_newton_m_s = Vec3::Zero();
};

// How bodies came to where joints are open: from `before`, in this time. What gives way may take no
// more than `most_joule`.
struct OpenMotion {
  double time_s = 0.0;
  std::span<const BodyState> before, open;
  double most_joule = std::numeric_limits<double>::infinity();
};

// Closing has moved the bodies from there to `states`, and deepened contacts of the step that began
// before: its rows are the problem's. Whole articulated islands that nothing holds to the world,
// bodies without joints among them, move aside without turning, as little as their masses allow, so
// far that no contact is deeper than it was when joints were open. What is held on both sides, or
// would take more than is allowed, stays deeper. What so came back from where its velocity had led
// is stopped.
GivenWay give_way(const IslandStep& island, const OpenMotion& motion, const JointSystem& joints,
                  const ContactProblem& problem, std::span<BodyState> states);

}  // namespace soda::physics
