#include "physics/continuous/mesh_impact.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "physics/continuous/conservative_advancement.hpp"
#include "physics/continuous/first_touch.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/narrowphase/triangle_solid.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// A triangle and the first share of the whole time at which it can be touched.
struct OnPath {
  double begin = 0.0;
  std::uint32_t triangle = 0;
};

// The path of the ball around a body, in the frame of the mesh. It bends, so a straight path of a
// larger ball is looked at.
struct SweptPath {
  Vec3 from, along;
  double radius_m;

  // The share of the path at which a box is entered; above 1 if it is not.
  double enters(const Aabb& box) const {
    double begin = 0.0, end = 1.0;
    for (int i = 0; i < 3; ++i) {
      const double low = box.min[i] - radius_m - from[i], high = box.max[i] + radius_m - from[i];
      if (along[i] == 0.0) {
        if (low > 0.0 || high < 0.0) return 2.0;
        continue;
      }
      const double x = low / along[i], y = high / along[i];
      begin = std::max(begin, std::min(x, y));
      end = std::min(end, std::max(x, y));
    }
    return begin <= end ? begin : 2.0;
  }
};

SweptPath path_of(const PairStep& pair, const CompiledShape& shape, const Pose& pose) {
  const double t = pair.dt_s;
  const Vec3 field = field_of(pair.scene, pair.a);
  const Vec3 displacement = pair.state_a.linear_velocity_m_s * t + field * (0.5 * t * t);
  const double bend = 0.125 * t * t * field.norm();
  const double rounding = 1e-12 * (pair.state_a.position_m.norm() + displacement.norm());
  return {pose.to_local(pair.state_a.position_m), pose.direction_to_local(displacement),
          (1.0 + 1e-9) * (shape.bounding_radius_m + bend) + rounding};
}

Aabb box_around(const MeshTriangle& t) {
  return {t.corners_m[0].cwiseMin(t.corners_m[1]).cwiseMin(t.corners_m[2]),
          t.corners_m[0].cwiseMax(t.corners_m[1]).cwiseMax(t.corners_m[2])};
}

// Whether the triangle's plane is never reached from its front.
bool stays_off(const SweptPath& path, const MeshTriangle& t) {
  const double from = t.plane.normal.dot(path.from) - t.plane.offset_m;
  const double to = from + t.plane.normal.dot(path.along);
  return std::min(from, to) > path.radius_m || std::max(from, to) < -path.radius_m;
}

std::vector<OnPath> on_path(const SweptPath& path, const CompiledShape& mesh,
                            std::span<const std::uint32_t> met) {
  std::vector<OnPath> found;
  if (!path.from.allFinite() || !path.along.allFinite() || !std::isfinite(path.radius_m))
    return found;
  mesh.tree.visit([&](const Aabb& box) { return path.enters(box) <= 1.0; },
                  [&](std::uint32_t index) {
                    const MeshTriangle& t = mesh.triangles[index];
                    if (t.plane.normal == Vec3::Zero() || stays_off(path, t)) return;
                    if (std::binary_search(met.begin(), met.end(), t.group)) return;
                    const double begin = path.enters(box_around(t));
                    if (begin <= 1.0) found.push_back({begin, index});
                  });
  std::sort(found.begin(), found.end(), [](const OnPath& x, const OnPath& y) {
    return x.begin != y.begin ? x.begin < y.begin : x.triangle < y.triangle;
  });
  return found;
}

// Of the faces that manifolds of the pair are of; ascending.
std::vector<std::uint32_t> faces_met(const PairStep& pair, std::uint32_t part_a,
                                     std::span<const ContactManifold> manifolds) {
  std::vector<std::uint32_t> faces;
  const CompiledShape& mesh = shape_of_b(pair);
  for (const ContactManifold& m : manifolds) {
    if (m.a != pair.a || m.b != pair.b) continue;
    const NumberedPart met = parts_of(mesh, m.part);
    if (met.parts.a == part_a && met.face != kNone) faces.push_back(met.face);
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

struct MeshTouch {
  Touch touch;
  std::uint32_t triangle = 0;
};

// `later`: what touches at the beginning does not count.
std::optional<MeshTouch> first_mesh_touch(const PairStep& pair, std::uint32_t part_a,
                                          std::span<const std::uint32_t> met, bool later) {
  constexpr double kDeepest = 0.5;  // of the width: farther in than that nothing is pushed
  const StaticGeometry& placed = pair.geometry.impl().statics[static_index_of(pair.b)];
  const CompiledShape &mesh = shape_of_b(pair), &shape = shape_of_a(pair);
  const SweptPath path = path_of(pair, shape, placed.pose);
  TouchSearch search{touching_gap_m(pair.scene, pair.geometry, pair.a, pair.state_a, pair.b),
                     shape.min_extent_m, 0.0, pair.dt_s};
  std::optional<MeshTouch> best;
  TriangleSolid triangle;
  for (const OnPath& next : on_path(path, mesh, met)) {
    search.begin_s = next.begin * pair.dt_s;
    if (best && !(search.begin_s < best->touch.impact.time_s)) break;
    triangle.set(mesh.triangles[next.triangle], placed.pose);
    FlyingSolids solids(pair, triangle.solid(), part_a);
    const std::optional<Touch> touch = first_touch(search, solids);
    if (!touch || (later && touch->impact.time_s == 0.0)) continue;
    const Vec3 up = placed.pose.rotation * mesh.triangles[next.triangle].plane.normal;
    if (up.dot(first_guess(solids.a().solid, solids.b().solid)) > 0.0) continue;
    const double gap = gap_along(solids.a().solid.placed, solids.b().solid.placed, touch->normal);
    if (gap < -kDeepest * shape.min_extent_m) continue;
    if (best && !(touch->impact.time_s < best->touch.impact.time_s)) continue;
    best = {*touch, next.triangle};
  }
  return best;
}

}  // namespace

std::optional<Impact> time_of_mesh_impact(const PairStep& pair, std::uint32_t part_a) {
  const std::optional<MeshTouch> first = first_mesh_touch(pair, part_a, {}, false);
  return first ? std::optional(first->touch.impact) : std::nullopt;
}

void append_distance_to_mesh(const PairStep& pair, std::uint32_t part_a,
                             std::vector<ContactManifold>& out) {
  const std::optional<MeshTouch> first =
      first_mesh_touch(pair, part_a, faces_met(pair, part_a, out), true);
  if (!first) return;
  const StaticGeometry& placed = pair.geometry.impl().statics[static_index_of(pair.b)];
  const CompiledShape& mesh = shape_of_b(pair);
  const MeshTriangle& t = mesh.triangles[first->triangle];
  TriangleSolid triangle;
  triangle.set(t, placed.pose);
  const Vec3 normal =
      -(placed.pose.rotation *
        allowed_normal(t, placed.pose.direction_to_local(-first->touch.normal)).normal);
  FlyingSolids solids(pair, triangle.solid(), part_a);
  const double distance = gap_along(solids.a().solid.placed, solids.b().solid.placed, normal);
  solids.go_to(first->touch.impact.time_s);
  ContactCandidates candidates;
  candidates.add(support_point(solids.a().solid.placed, normal), distance, kDistanceToImpact);
  const std::size_t before = out.size();
  emit_manifold(pair, t.group, normal, solids.centre_of_a_m(), candidates, out);
  number_parts(mesh, {part_a, 0}, before, out);
  const bool whole = solids.a().part == nullptr;
  if (whole && !first->touch.impact.lasts) out.back().impact_s = first->touch.impact.time_s;
  for (std::size_t i = out.size() - 1; i > 0 && canonical_before(out[i], out[i - 1]); --i)
    std::swap(out[i], out[i - 1]);
}

namespace {

// Whether a path meets a triangle, rims included.
bool crosses(const MeshTriangle& t, const Vec3& from, const Vec3& to) {
  constexpr double kRounding = 1e-9;  // of the triangle's size
  const Vec3& n = t.plane.normal;
  const double above = n.dot(from) - t.plane.offset_m, below = n.dot(to) - t.plane.offset_m;
  if (!(above >= 0.0 && below < 0.0)) return false;
  const Vec3 at = from + (to - from) * (above / (above - below));
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& corner = t.corners_m[i];
    const Vec3 edge = t.corners_m[(i + 1) % 3] - corner;
    if (n.cross(edge).dot(at - corner) < -kRounding * edge.squaredNorm()) return false;
  }
  return true;
}

}  // namespace

std::optional<FacePlane> mesh_face_passed(const Geometry& geometry, BodyId mesh, const Vec3& from_m,
                                          const Vec3& to_m, double clearance_m) {
  const StaticGeometry& placed = geometry.impl().statics[static_index_of(mesh)];
  const CompiledShape& shape = geometry.impl().shapes[placed.shape].shape;
  const Vec3 from = placed.pose.to_local(from_m), to = placed.pose.to_local(to_m);
  if (!from.allFinite() || !to.allFinite()) return std::nullopt;
  constexpr double kRounding = 1e-6;
  const SweptPath path{from, to - from, clearance_m};
  std::optional<std::uint32_t> passed;
  double first = 0.0;
  shape.tree.visit([&](const Aabb& box) { return path.enters(box) <= 1.0; },
                   [&](std::uint32_t index) {
                     const MeshTriangle& t = shape.triangles[index];
                     const Vec3& n = t.plane.normal;
                     if (n == Vec3::Zero()) return;
                     // One that was put there before is clear, but for rounding.
                     if (!(n.dot(to) - t.plane.offset_m < (1.0 - kRounding) * clearance_m)) return;
                     if (!crosses(t, from, to) && !crosses(t, from, to - n * clearance_m)) return;
                     const double above = n.dot(from) - t.plane.offset_m, left = n.dot(from - to);
                     if (!(left > 0.0)) return;
                     const double share = (above - clearance_m) / left;
                     if (passed && (share > first || (share == first && index > *passed))) return;
                     first = share;
                     passed = index;
                   });
  if (!passed) return std::nullopt;
  const Vec3 normal = placed.pose.rotation * shape.triangles[*passed].plane.normal;
  return FacePlane{normal,
                   shape.triangles[*passed].plane.offset_m + normal.dot(placed.pose.position)};
}

}  // namespace soda::physics
