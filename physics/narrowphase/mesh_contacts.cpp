#include "physics/narrowphase/mesh_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "physics/model/contact_manifold.hpp"

namespace soda::physics {
namespace {

struct Triangle {
  std::array<Vec3, 3> corners;
  Vec3 normal;
};

Triangle place(const PlacedShape& mesh, const MeshTriangle& t) {
  Triangle out;
  for (int i = 0; i < 3; ++i) out.corners[i] = mesh.pose.to_world(t.corners_m[i]);
  out.normal = mesh.pose.rotation * t.plane.normal;
  return out;
}

struct NearestOnTriangle {
  Vec3 point;
  bool inside = true;        // over the face itself
  bool edge_active = false;  // else: whether the edge (or an edge at the corner) can be touched
};

NearestOnTriangle nearest_on(const Triangle& t, const MeshTriangle& mesh, const Vec3& p) {
  NearestOnTriangle best{p - t.normal * (p - t.corners[0]).dot(t.normal), true, true};
  double best_squared = 1e300;
  for (int i = 0; i < 3; ++i) {
    const Vec3& from = t.corners[i];
    const Vec3 edge = t.corners[(i + 1) % 3] - from;
    if (t.normal.cross(edge).dot(p - from) >= 0.0) continue;
    const double s = std::clamp((p - from).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    const Vec3 on_edge = from + edge * s;
    const double squared = (p - on_edge).squaredNorm();
    if (squared >= best_squared) continue;
    best_squared = squared;
    bool active = mesh.edge_active[i];
    if (s == 0.0) active = active || mesh.edge_active[(i + 2) % 3];
    if (s == 1.0) active = active || mesh.edge_active[(i + 1) % 3];
    best = {on_edge, false, active};
  }
  return best;
}

// A sphere over the face touches it along the face's normal, at a free edge along the way to it.
// Returns false where a neighbouring triangle has the contact, or the centre is behind the face.
bool sphere_triangle(const PlacedShape& sphere, const Triangle& t, const MeshTriangle& mesh,
                     std::uint32_t feature, Vec3& normal, ContactCandidates& out) {
  const Vec3& center = sphere.pose.position;
  if ((center - t.corners[0]).dot(t.normal) < 0.0) return false;
  const NearestOnTriangle nearest = nearest_on(t, mesh, center);
  if (!nearest.inside && !nearest.edge_active) return false;
  const Vec3 gap = nearest.point - center;
  const double distance = gap.norm();
  normal = nearest.inside || !(distance > 0.0) ? Vec3(-t.normal) : Vec3(gap / distance);
  const double separation = distance - sphere.shape.radius_m;
  out.add(nearest.point - normal * (0.5 * separation), separation, feature);
  return true;
}

// The solid's supporting feature over the triangle. A solid whose centre is behind the face, or
// that reaches deeper than its own half width, is not pushed by it: meshes are hollow.
void solid_triangle(const PlacedShape& solid, const Triangle& t, std::uint32_t index,
                    ContactCandidates& out) {
  if ((solid.pose.position - t.corners[0]).dot(t.normal) < 0.0) return;
  SupportFeature face;
  for (int i = 0; i < 3; ++i) face.points[i] = t.corners[i];
  face.count = 3;
  face.normal = t.normal;
  face.code = index;
  const SupportFeature feature = support_feature(solid, -t.normal);
  ContactCandidates clipped;
  clip_to_reference(face, feature, clipped);
  const double deepest = -0.5 * solid.shape.min_extent_m;
  for (int i = 0; i < clipped.count; ++i) {
    const ContactPoint& p = clipped.points[i];
    if (p.separation_m > deepest) out.add(p.position_m, p.separation_m, p.feature);
  }
}

// Points that triangles of one group share lie on their common edges, twice.
void drop_duplicates(double tolerance, ContactCandidates& c) {
  int count = 0;
  for (int i = 0; i < c.count; ++i) {
    bool duplicate = false;
    for (int k = 0; k < count; ++k) {
      const Vec3 apart = c.points[k].position_m - c.points[i].position_m;
      duplicate = duplicate || apart.squaredNorm() <= tolerance * tolerance;
    }
    if (!duplicate) c.points[count++] = c.points[i];
  }
  c.count = count;
}

}  // namespace

void mesh_contacts(BodyId a, BodyId b, const PlacedShape& solid, const PlacedShape& mesh,
                   std::span<const std::uint32_t> triangles, const PairMotion& motion,
                   const Vec3& origin_m, std::vector<ContactManifold>& out) {
  const bool sphere = solid.shape.kind == ShapeKind::kSphere;
  std::vector<std::array<std::uint32_t, 2>> by_group;  // (group, triangle)
  by_group.reserve(triangles.size());
  for (const std::uint32_t t : triangles)
    if (mesh.shape.triangles[t].plane.normal != Vec3::Zero())
      by_group.push_back({mesh.shape.triangles[t].group, t});
  std::sort(by_group.begin(), by_group.end());

  for (std::size_t begin = 0; begin < by_group.size();) {
    std::size_t end = begin;
    ContactCandidates candidates;
    Vec3 normal = Vec3::Zero();
    for (; end < by_group.size() && by_group[end][0] == by_group[begin][0]; ++end) {
      const std::uint32_t index = by_group[end][1];
      const MeshTriangle& compiled = mesh.shape.triangles[index];
      const Triangle t = place(mesh, compiled);
      if (sphere) {
        // A sphere meets a group in one point: the nearest.
        ContactCandidates one;
        Vec3 towards = Vec3::Zero();
        if (sphere_triangle(solid, t, compiled, index - by_group[begin][0], towards, one) &&
            (candidates.count == 0 ||
             one.points[0].separation_m < candidates.points[0].separation_m)) {
          candidates = one;
          normal = towards;
        }
      } else {
        if (candidates.count == 0) normal = -t.normal;
        solid_triangle(solid, t, index, candidates);
      }
    }
    keep_reached(motion, normal, candidates);
    drop_duplicates(1e-6 * solid.shape.min_extent_m, candidates);
    emit_manifold(a, b, by_group[begin][0], normal, origin_m, candidates, out);
    begin = end;
  }
}

}  // namespace soda::physics
