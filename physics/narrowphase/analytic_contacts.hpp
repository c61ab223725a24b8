// Contacts in closed form: spheres and capsules, anything against a halfspace, and triangles.
#pragma once

#include "physics/narrowphase/contact_features.hpp"

namespace soda::physics {

// Where a surface is nearest to a point. `outward` points away from the solid, also from inside.
struct SurfacePoint {
  Vec3 position = Vec3::Zero();
  Vec3 outward = Vec3::UnitZ();
  double distance_m = 0.0;  // < 0: the point is inside
};

// Exact for sphere, box, capsule and cylinder.
SurfacePoint nearest_surface(const PlacedShape& shape, const Vec3& point);

// A contact of one point, seen along its normal (from a to b).
struct PointContact {
  bool found = false;
  Vec3 normal = Vec3::UnitZ();
  Vec3 position = Vec3::Zero();
  double separation_m = 0.0;
};

// Sphere against sphere, box, capsule or cylinder, either first. Within the margin it is the
// contact of the present pose. A faster approach is followed along the relative velocity until the
// surfaces meet: normal and place are those of the impact, the separation is the distance to it
// along the normal.
PointContact sphere_contact(const PlacedShape& a, const PlacedShape& b, const PairMotion& motion);

// Capsule against capsule: the nearest points of the cores. Two points where they run in parallel.
Vec3 capsule_contacts(const PlacedShape& a, const PlacedShape& b, ContactCandidates& out);

// Vertices, rim points or end spheres against the halfspace. Returns the contact normal.
Vec3 halfspace_contacts(const PlacedShape& a, const CompiledShape& half_space, const Pose& pose,
                        ContactCandidates& out);

}  // namespace soda::physics
