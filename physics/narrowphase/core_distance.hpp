// The distance of two convex solids: Gilbert, Johnson and Keerthi's method on their cores.
#pragma once

#include "physics/narrowphase/contact_features.hpp"

namespace soda::physics {

// What is left of a solid after a skin has been taken off: the centre of a sphere, the segment of a
// capsule (their skin is the radius), a smaller cylinder or box, all of a hull (no skin).
struct Core {
  const PlacedShape& solid;
  double skin_m = 0.0;
  double scale = 1.0;  // about the solid's origin, of what is left
};

// The radius of spheres and capsules. A cylinder keeps its edges: without them it would be farther
// away than it is along them.
double skin_of(const CompiledShape& shape);

struct CoreGap {
  // The nearest points are closer than `tiny_m`, or the cores overlap; nothing else is set then.
  bool overlap = false;
  bool far = false;             // farther apart than `far_m`; nothing else is set then
  Vec3 normal = Vec3::UnitZ();  // unit, from a to b
  double distance_m = 0.0;      // between the nearest points
  // Between the supporting planes along the normal: never more than the true distance, and equal to
  // it to rounding for flat solids, to 1e-10 of it for round ones.
  double least_m = 0.0;
  Vec3 on_a = Vec3::Zero(), on_b = Vec3::Zero();  // the nearest points
};

// `guess`, of any length but 0, is where the search begins: about from a to b. Another guess may
// change the result by rounding, and which of equally near points is named.
CoreGap core_gap(const Core& a, const Core& b, const Vec3& guess, double tiny_m,
                 double far_m = 1e300);

struct ShrunkTouch {
  Vec3 normal = Vec3::UnitZ();  // unit, from a to b
  Vec3 on_b = Vec3::Zero();
};

// Of two solids that touch or overlap: where they touch as soon as both have shrunk by the same
// share, to a hundredth of what is taken off. Surfaces come in by the same all over; those of
// hulls, and of what is left when a solid has no thickness any more, about its origin, which is
// inside (C. J. Ong and E. G. Gilbert, "Growth distances: new measures for object separation and
// penetration", 1996). Little overlap has the normal of the least depth, but where another normal
// is about as good, and a thin hull's may be far off. `b_too` false: b keeps its size. Where a's
// origin is in it, the normal leads from one origin to the other.
ShrunkTouch touch_of_shrunk(const PlacedShape& a, const PlacedShape& b, bool b_too);

}  // namespace soda::physics
