// Joint rows among the sweeps over an island's contacts: what one joint holds is solved at once.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"

namespace soda::physics {

inline constexpr std::uint32_t kMostHeldRows = 6;

// Of one joint: rows [first, first + held) hold, or are its spring; limits and motors follow, up to
// `end`.
struct JointBlock {
  std::uint32_t first = 0, held = 0, end = 0;
  // Of the matrix of the held rows, L D L^T by rows: below the diagonal L, on it 1 / D.
  std::array<double, kMostHeldRows * kMostHeldRows> factor;
};

struct JointBlocks {
  std::vector<JointBlock> blocks;
  std::vector<double> mass;  // of each limit and motor row: its reciprocal response; else 0
};

// For rows that were built, as the bodies respond now. Finds the rows' twists.
void build_joint_blocks(std::span<const SolverBody> bodies, JointSystem& system,
                        JointBlocks& blocks);

// One sweep over all joints, of a substep of `length_s`. A row's error is that of the substep's
// start. The first kind also closes what is open, at most `most_m_s` fast along a row of length 1;
// the second one leaves velocities that only keep what there is. Limits and motors push within
// their bounds, springs as implicit ones.
void press_joints(double length_s, double most_m_s, const JointBlocks& blocks, JointSystem& system,
                  std::span<SolverBody> bodies);
void relax_joints(double length_s, bool forward, const JointBlocks& blocks, JointSystem& system,
                  std::span<SolverBody> bodies);

// Impulses of joints as those of contacts, in the state of the lower body: entries with the joint's
// part. Features 0 and 1 have what rows along and about lines give to b, and as normal impulses
// those of both limits; 2 has that of the motor.
void load_joint_impulses(const SceneDescription& scene, std::span<const BodyState> states,
                         JointSystem& system);
void append_joint_impulses(const SceneDescription& scene, std::uint32_t joint_place,
                           std::span<const double> impulses, const JointSystem& system,
                           std::vector<ContactImpulse>& out);

}  // namespace soda::physics
