// How far a step can take a body: what its island's energy allows, and a bounded position
// correction.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// By how much an overlap may grow in a step, of the smaller body; more is solved anew.
inline constexpr double kMostGrowth = 3e-3;

// The fastest that bodies of an island are moved beyond their velocities: as many widths of its
// widest one a second as the scene's setting says, 2 by default, as a contact asks for as many of
// its smaller body at most. Rotations: twice as many radians a second, those widths at the distance
// of half of one.
struct FastestCorrection {
  double m_s = 0.0, rad_s = 0.0;
};
FastestCorrection fastest_correction(const SceneDescription& scene, std::span<const BodyId> ids);
// Of all bodies that fall.
double weight_newton(const SceneDescription& scene, std::span<const BodyId> ids);

// Shortens what is faster. Direction stays; of an island, also the proportions in which bodies
// part.
void limit_correction(const FastestCorrection& most, PositionCorrection& correction);
void limit_correction(const FastestCorrection& most, std::span<PositionCorrection> correction);

// How far each body of an island can come in a step: at the speed that it would have with all
// energy of its island, what forces and surfaces that slide along can add in the step included, and
// by position correction. Contacts and springs give no energy. Islands with other joints have no
// bounds: these are closed by any displacement of it. Of the island as it starts: whoever solves a
// part of it can tell.
struct DisplacementBounds {
  bool any = false;
  bool driven = false;  // by surfaces that move
  double dt_s = 0.0;
  double root = 0.0;  // of the greatest kinetic energy, joule
  double pushed_m_s = 0.0;
  std::vector<Vec3> positions_m;
};
void bound_displacements(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                         std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states, DisplacementBounds& bounds);

// Whether surfaces have given the island more than the bounds allow: in one solve they do not
// (energy_clamp.hpp), but every impact within a step is a solve.
bool is_overdriven(const SceneDescription& scene, std::span<const BodyId> ids,
                   std::span<const BodyState> states, const DisplacementBounds& bounds);

// The largest share of a step, up to 1, in which bodies of these velocities come no farther.
double share_within(const SceneDescription& scene, const DisplacementBounds& bounds,
                    std::span<const BodyId> ids, std::span<const SolverBody> bodies);

// Appends a fault if the body, the i-th of those that were bounded, has come farther.
void report_impossible_displacement(const SceneDescription& scene, const DisplacementBounds& bounds,
                                    std::size_t i, BodyId id, const BodyState& state,
                                    std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
