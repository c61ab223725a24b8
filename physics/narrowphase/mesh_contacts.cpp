#include "physics/narrowphase/mesh_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "physics/model/contact_manifold.hpp"
#include "physics/narrowphase/core_distance.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/narrowphase/seams.hpp"
#include "physics/narrowphase/triangle_solid.hpp"

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
  constexpr double kSeam_rad = 3e-5, kRounding = 1e-12;  // of the angle between coplanar faces
  NearestOnTriangle best{p - t.normal * (p - t.corners[0]).dot(t.normal), true, true};
  double best_squared = 1e300;
  const double height = std::abs((p - t.corners[0]).dot(t.normal));
  for (int i = 0; i < 3; ++i) {
    const Vec3& from = t.corners[i];
    const Vec3 edge = t.corners[(i + 1) % 3] - from;
    const double inside = t.normal.cross(edge).dot(p - from), length = edge.norm();
    if (inside >= 0.0) continue;
    // Between two faces that count as one plane, or over rounding, there is no way through.
    const double gap = kSeam_rad * height + kRounding * length;
    if (!mesh.edge_active[i] && inside > -gap * length) continue;
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

// The farthest in that a solid is pushed out of a triangle along its face though it is far less far
// in along another normal: there the other face has it, as on stairs what lies on a tread and
// reaches over the riser's upper edge. And though it is less far in at all.
constexpr double kFarthestIn = 0.01, kFarLess = 0.1;  // of the width; of that depth
constexpr double kDeepest = 0.5;                      // of the width: no edge pushes, either

// The solid's supporting feature over the triangle. A solid whose centre is behind the face is not
// pushed by it: meshes are hollow.
void solid_triangle(const PlacedShape& solid, const Triangle& t, const Solid& as_solid,
                    std::uint32_t index, bool at_any_depth, ContactCandidates& out) {
  if ((solid.pose.position - t.corners[0]).dot(t.normal) < 0.0) return;
  SupportFeature face;
  for (int i = 0; i < 3; ++i) face.points[i] = t.corners[i];
  face.count = 3;
  face.normal = t.normal;
  face.code = index;
  const SupportFeature feature = support_feature(solid, -t.normal);
  ContactCandidates clipped;
  clip_to_reference(face, feature, clipped);
  double deepest = 0.0;
  for (int i = 0; i < clipped.count; ++i)
    deepest = std::min(deepest, clipped.points[i].separation_m);
  const double width = solid.shape.min_extent_m;
  double most = at_any_depth ? deepest : -kFarthestIn * width;
  if (deepest < most) {
    const Separation least = overlap_with_triangle(solid, as_solid);
    const bool far_less = least.distance_m > kFarLess * deepest;
    if (least.normal == -t.normal || (!far_less && deepest > -kDeepest * width)) most = deepest;
  }
  for (int i = 0; i < clipped.count; ++i) {
    const ContactPoint& p = clipped.points[i];
    if (p.separation_m >= most) out.add(p.position_m, p.separation_m, p.feature);
  }
}

// Of the solid's body, which all coordinates are relative to.
const Vec3& origin_m(const MeshPair& pair) { return pair.step.state_a.position_m; }

// Where a solid touches an edge of a triangle and neither of its faces.
struct EdgeContact {
  Vec3 normal = Vec3::UnitZ();  // from the solid
  int edge = -1;
  double separation_m = 0.0;
  Vec3 witness = Vec3::Zero();
};

// The corner that lies farthest along a direction.
const Vec3& farthest_corner(const MeshTriangle& t, const Vec3& direction) {
  const auto along = [&](const Vec3& corner) { return corner.dot(direction); };
  return *std::ranges::max_element(t.corners_m, {}, along);
}

// Whether to what lies in this direction from a corner no triangle there is nearer than the corner
// itself. Else that triangle is what it touches.
bool is_over_corner(const CompiledShape& mesh, std::span<const std::uint32_t> triangles,
                    const Vec3& corner, const Vec3& direction) {
  constexpr double kSlack = 1e-6;  // cosine
  for (const std::uint32_t index : triangles) {
    const std::array<Vec3, 3>& corners = mesh.triangles[index].corners_m;
    if (std::ranges::find(corners, corner) == corners.end()) continue;
    for (const Vec3& other : corners)
      if ((other - corner).dot(direction) > kSlack * (other - corner).norm()) return false;
  }
  return true;
}

// Along the direction in which they are apart, or overlap least; the edge is not known yet.
EdgeContact nearest_of(const PlacedShape& solid, const Solid& triangle, double range_m) {
  constexpr double kTiny = 1e-10;  // of the width
  const double tiny = kTiny * solid.shape.min_extent_m;
  const double skin = skin_of(solid.shape);
  const Vec3 between = triangle.placed.pose.position - solid.pose.position;
  const Vec3 guess = between == Vec3::Zero() ? Vec3(Vec3::UnitZ()) : between;
  const CoreGap gap = core_gap({solid, skin}, {triangle.placed, 0.0}, guess, tiny, range_m + skin);
  EdgeContact found;
  if (gap.far) {
    found.separation_m = 1e300;
  } else if (gap.overlap) {
    found.normal = touch_of_shrunk(solid, triangle.placed, false).normal;
    found.separation_m = separation_along(solid, triangle.placed, found.normal);
    found.witness = support_point(solid, found.normal) + found.normal * (0.5 * found.separation_m);
  } else {
    found.normal = gap.normal;
    found.separation_m = gap.least_m - skin;
    found.witness = 0.5 * (gap.on_a + gap.normal * skin + gap.on_b);
  }
  return found;
}

EdgeContact edge_contact(const MeshPair& pair, std::span<const std::uint32_t> triangles,
                         const Solid& triangle, double range_m) {
  constexpr double kSame = 1.0 - 1e-8;  // cosine
  const PlacedShape &solid = pair.solid, &mesh = pair.mesh;
  const MeshTriangle& t = *triangle.geometry.triangle;
  EdgeContact found = nearest_of(solid, triangle, range_m);
  if (found.separation_m > range_m || !found.normal.allFinite()) return {};
  const Vec3 direction = mesh.pose.direction_to_local(-found.normal);
  const TriangleNormal allowed = allowed_normal(t, direction);
  if (allowed.edge < 0) return {};
  if (!allowed.beyond && allowed.normal.dot(direction) >= kSame) {
    if (!t.edge_own[static_cast<std::size_t>(allowed.edge)]) return {};
    found.normal = -(mesh.pose.rotation * allowed.normal);
    found.separation_m = separation_along(solid, triangle.placed, found.normal);
  } else if (!is_over_corner(mesh.shape, triangles, farthest_corner(t, direction), direction)) {
    return {};
  }
  const bool deep = found.separation_m < -kDeepest * solid.shape.min_extent_m;
  found.edge = deep || found.separation_m > range_m ? -1 : allowed.edge;
  return found;
}

void edge_points(const PlacedShape& solid, const Triangle& t, const EdgeContact& contact,
                 ContactCandidates& out) {
  SupportFeature edge;
  edge.points[0] = t.corners[static_cast<std::size_t>(contact.edge)];
  edge.points[1] = t.corners[static_cast<std::size_t>(contact.edge + 1) % 3];
  edge.count = 2;
  const SupportFeature feature = support_feature(solid, contact.normal);
  if (is_along(feature, contact.normal))
    clip_to_reference(feature, edge, out);
  else if (is_over(feature, contact.normal))
    clip_over(feature, edge, contact.normal, contact.separation_m, out);
  else
    overlap_segments(feature, edge, contact.normal, out);
  if (out.count == 0) out.add(contact.witness, contact.separation_m, 0x40000000u);
}

// Edges between faces that fall away from them, and rims, of the triangles near. What a face or
// another edge has a point at, as deep, is left to that.
void append_edge_contacts(const MeshPair& pair, std::span<const std::uint32_t> triangles,
                          std::size_t before, std::vector<ContactManifold>& out) {
  constexpr double kSame = 0.02, kAsDeep = 1e-3;  // of the width
  const PlacedShape &solid = pair.solid, &mesh = pair.mesh;
  const double range = std::min(pair.motion.range_m, solid.shape.min_extent_m);
  const double same = kSame * solid.shape.min_extent_m;
  const double as_deep = kAsDeep * solid.shape.min_extent_m;
  const auto has_point = [&](const Vec3& position, double separation_m) {
    for (std::size_t m = before; m < out.size(); ++m)
      for (std::uint32_t i = 0; i < out[m].count; ++i)
        if ((out[m].points[i].position_m - position).squaredNorm() <= same * same &&
            out[m].points[i].separation_m <= separation_m + as_deep)
          return true;
    return false;
  };
  TriangleSolid triangle;
  for (const std::uint32_t index : triangles) {
    const MeshTriangle& compiled = mesh.shape.triangles[index];
    bool active = false;
    for (std::size_t i = 0; i < 3; ++i)
      active = active || (compiled.edge_active[i] && compiled.edge_own[i]);
    if (!active || compiled.plane.normal == Vec3::Zero()) continue;
    const Triangle t = place(mesh, compiled);
    triangle.set(compiled, mesh.pose);
    const EdgeContact contact = edge_contact(pair, triangles, triangle.solid(), range);
    // Meshes are hollow.
    const Vec3 from_edge =
        solid.pose.position - t.corners[static_cast<std::size_t>(std::max(contact.edge, 0))];
    if (contact.edge < 0 || from_edge.dot(contact.normal) > 0.0 ||
        has_point(contact.witness + origin_m(pair), contact.separation_m))
      continue;
    ContactCandidates candidates;
    edge_points(solid, t, contact, candidates);
    keep_reached(pair.motion, contact.normal, candidates);
    if (candidates.count > 0 && slides_past(solid, triangle.solid().placed, contact.normal,
                                            candidates.points[0].position_m, pair.motion))
      continue;
    emit_manifold(pair.step, kFirstEdgePart + 3 * index + static_cast<std::uint32_t>(contact.edge),
                  contact.normal, origin_m(pair), candidates, out);
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

// Makes room where a face has very many triangles: the outermost points in eight directions and the
// deepest stay, so what is kept of all of them in the end does not depend on how many there were.
void thin_out(const Vec3& normal, ContactCandidates& c) {
  constexpr int kRoom = 8;
  if (c.count + kRoom <= static_cast<int>(c.points.size())) return;
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  const std::array<Vec3, 9> directions{u,     v,      -u,    -v,          Vec3(u + v),
                                       v - u, -u - v, u - v, Vec3::Zero()};
  std::array<bool, 2 * kMaxFeaturePoints> kept{};
  for (const Vec3& d : directions) {
    int best = 0;
    const auto score = [&](int i) {
      return d == Vec3::Zero() ? -c.points[i].separation_m : d.dot(c.points[i].position_m);
    };
    for (int i = 1; i < c.count; ++i)
      if (score(i) > score(best)) best = i;
    kept[static_cast<std::size_t>(best)] = true;
  }
  int count = 0;
  for (int i = 0; i < c.count; ++i)
    if (kept[static_cast<std::size_t>(i)]) c.points[count++] = c.points[i];
  c.count = count;
}

using GroupedTriangle = std::array<std::uint32_t, 2>;  // (group, triangle)

// Of the triangles of one group. Returns the normal.
Vec3 face_contacts(const MeshPair& pair, std::span<const GroupedTriangle> group, bool at_any_depth,
                   TriangleSolid& as_solid, ContactCandidates& out) {
  const PlacedShape& solid = pair.solid;
  Vec3 normal = Vec3::Zero();
  for (const auto& [first, index] : group) {
    const MeshTriangle& compiled = pair.mesh.shape.triangles[index];
    const Triangle t = place(pair.mesh, compiled);
    if (solid.shape.kind == ShapeKind::kSphere) {
      // A sphere meets a group in one point: the nearest.
      ContactCandidates one;
      Vec3 towards = Vec3::Zero();
      as_solid.set(compiled, pair.mesh.pose);
      if (sphere_triangle(solid, t, compiled, index - first, towards, one) &&
          !slides_past(solid, as_solid.solid().placed, towards, one.points[0].position_m,
                       pair.motion) &&
          (out.count == 0 || one.points[0].separation_m < out.points[0].separation_m)) {
        out = one;
        normal = towards;
      }
    } else {
      if (out.count == 0) normal = -t.normal;
      thin_out(normal, out);
      as_solid.set(compiled, pair.mesh.pose);
      solid_triangle(solid, t, as_solid.solid(), index, at_any_depth, out);
    }
  }
  keep_reached(pair.motion, normal, out);
  drop_duplicates(1e-6 * solid.shape.min_extent_m, out);
  return normal;
}

void append_face_contacts(const MeshPair& pair, std::span<const GroupedTriangle> triangles,
                          bool at_any_depth, std::vector<ContactManifold>& out) {
  TriangleSolid as_solid;
  for (std::size_t begin = 0, end = 0; begin < triangles.size(); begin = end) {
    while (end < triangles.size() && triangles[end][0] == triangles[begin][0]) ++end;
    ContactCandidates candidates;
    const Vec3 normal = face_contacts(pair, triangles.subspan(begin, end - begin), at_any_depth,
                                      as_solid, candidates);
    emit_manifold(pair.step, triangles[begin][0], normal, origin_m(pair), candidates, out);
  }
}

// Far in, every face may leave a solid to others. The one that it is least far in has it then.
void keep_shallowest(std::size_t begin, std::vector<ContactManifold>& out) {
  std::size_t best = begin;
  double least = 1e300;
  for (std::size_t m = begin; m < out.size(); ++m) {
    const double depth = std::max(0.0, -least_separation_m(out[m]));
    if (depth < least) best = m, least = depth;
  }
  if (begin == out.size()) return;
  out[begin] = out[best];
  out.resize(begin + 1);
}

}  // namespace

void mesh_contacts(const MeshPair& pair, std::span<const std::uint32_t> triangles,
                   std::vector<ContactManifold>& out) {
  const CompiledShape& mesh = pair.mesh.shape;
  std::vector<GroupedTriangle> by_group;
  by_group.reserve(triangles.size());
  for (const std::uint32_t t : triangles)
    if (mesh.triangles[t].plane.normal != Vec3::Zero())
      by_group.push_back({mesh.triangles[t].group, t});
  std::sort(by_group.begin(), by_group.end());
  const std::size_t before = out.size();
  append_face_contacts(pair, by_group, false, out);
  if (pair.solid.shape.kind == ShapeKind::kSphere) return;
  append_edge_contacts(pair, triangles, before, out);
  if (out.size() > before) return;
  append_face_contacts(pair, by_group, true, out);
  keep_shallowest(before, out);
}

}  // namespace soda::physics
