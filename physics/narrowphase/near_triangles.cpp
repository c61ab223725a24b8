#include "physics/narrowphase/near_triangles.hpp"

#include <algorithm>
#include <cmath>

namespace soda::physics {
namespace {

// A box along the solid's axes, in the mesh's frame, and the one along the mesh's axes around it.
struct Surroundings {
  Mat3 axes;
  Vec3 centre, half, around;

  bool reaches(const Aabb& box) const {
    const Vec3 middle = 0.5 * (box.min + box.max) - centre, wide = 0.5 * (box.max - box.min);
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(middle[i]) <= wide[i] + around[i])) return false;
    for (int i = 0; i < 3; ++i) {
      const Vec3 axis = axes.col(i);
      if (std::abs(axis.dot(middle)) > half[i] + axis.cwiseAbs().dot(wide)) return false;
    }
    return true;
  }

  bool reaches(const MeshTriangle& t) const {
    const double height = t.plane.normal.dot(centre) - t.plane.offset_m;
    if (std::abs(height) > (axes.transpose() * t.plane.normal).cwiseAbs().dot(half)) return false;
    const auto apart_along = [&](const Vec3& axis, double reach) {
      const double at = axis.dot(centre);
      const double x = axis.dot(t.corners_m[0]) - at, y = axis.dot(t.corners_m[1]) - at,
                   z = axis.dot(t.corners_m[2]) - at;
      return std::min({x, y, z}) > reach || std::max({x, y, z}) < -reach;
    };
    for (int i = 0; i < 3; ++i)
      if (apart_along(axes.col(i), half[i]) || apart_along(Vec3::Unit(i), around[i])) return false;
    return true;
  }
};

}  // namespace

std::vector<std::uint32_t> near_triangles(const PlacedShape& solid, const PlacedShape& mesh,
                                          double range_m) {
  const Aabb local = tight_aabb(solid.shape, Pose{});
  Surroundings near;
  near.axes = mesh.pose.rotation.transpose() * solid.pose.rotation;
  near.centre = mesh.pose.to_local(solid.pose.to_world(0.5 * (local.min + local.max)));
  near.half = 0.5 * (local.max - local.min) + Vec3::Constant(range_m);
  near.around = near.axes.cwiseAbs() * near.half;
  std::vector<std::uint32_t> found;
  mesh.shape.tree.visit([&](const Aabb& box) { return near.reaches(box); },
                        [&](std::uint32_t t) {
                          if (near.reaches(mesh.shape.triangles[t])) found.push_back(t);
                        });
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace soda::physics
