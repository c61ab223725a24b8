// How far two solids are apart, and along which direction.
#pragma once

#include "physics/model/contact_manifold.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/contact_features.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {

// Two solids seen along a unit normal from a to b. No part of a is nearer to b than distance_m
// (< 0: they overlap by that, as far as this direction tells).
struct Separation {
  Vec3 normal = Vec3::UnitZ();
  double distance_m = 0.0;
};

// A shape of a scene where its pair is examined.
struct Solid {
  const ShapeGeometry& geometry;
  PlacedShape placed;
};

// Of two boxes: along the one of their 15 axes (faces, and pairs of edges) that separates most.
// Positive if and only if they are apart; the distance itself where no two corners, and no corner
// and edge, are what is nearest.
Separation box_separation(const PlacedShape& a, const PlacedShape& b);

// No meshes but single triangles (triangle_solid.hpp), as b; a halfspace is b. Where they are apart
// the distance, but of two boxes what box_separation() says; where they overlap, along the
// direction in which they do so least, as far as that is known. `guess` is a direction from a to b
// where the search may begin (not 0).
Separation separation_between(const Solid& a, const Solid& b, const Vec3& guess);

// Between the supporting planes along a unit normal from a to b; of a halfspace, along its own.
double gap_along(const PlacedShape& a, const PlacedShape& b, const Vec3& normal);

// Of solids that touch or overlap: no spheres but against hulls, not two boxes, no halfspaces.
Separation overlap_between(const Solid& a, const Solid& b);

// Tests two shapes where they are, as collide() does (geometry.hpp), but without joints. True if
// they may meet within dt_s farther off than contacts are looked for, and have no contact, or meet
// in parts (part_pairs.hpp).
bool append_manifolds(const PairStep& pair, std::vector<ContactManifold>& out,
                      StageCounters& counters);

}  // namespace soda::physics
