// Edges that are no obstacle: of solids whose faces lie in one plane, as the tiles of a floor.
#pragma once

#include "physics/narrowphase/contact_features.hpp"

namespace soda::physics {

// Whether two solids that come nearer along `normal` at that point slide past each other: a face of
// one of them keeps them apart, to 2e-3 of the smaller one's width (edges that high are passed
// over), nothing comes nearer along it in the time of `motion`, and neither is over it yet. What
// fields add to velocities (`motion.pulled_m_s`) is left out: what carries the solids bears it.
// `sunk_m`: of b against a, how far fields have moved it since that was looked at.
bool slides_past(const PlacedShape& a, const PlacedShape& b, const Vec3& normal, const Vec3& point,
                 const PairMotion& motion, const Vec3& sunk_m = Vec3::Zero());

}  // namespace soda::physics
