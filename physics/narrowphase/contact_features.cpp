#include "physics/narrowphase/contact_features.hpp"

#include <algorithm>
#include <cmath>

namespace soda::physics {
namespace {

constexpr int kCapSides = 16;
// cos and sin of multiples of 22.5 degrees, first quadrant.
constexpr std::array<double, 5> kQuarter = {1.0, 0.92387953251128675613, 0.70710678118654752440,
                                            0.38268343236508977173, 0.0};

double cosine(int k) {
  k &= 15;
  const double magnitude = kQuarter[k <= 4 ? k : k <= 8 ? 8 - k : k <= 12 ? k - 8 : 16 - k];
  return k > 4 && k < 12 ? -magnitude : magnitude;
}
double sine(int k) { return cosine(k - 4); }

void box_face(const PlacedShape& s, const Vec3& local, SupportFeature& out) {
  int axis = 0;
  if (std::abs(local.y()) > std::abs(local[axis])) axis = 1;
  if (std::abs(local.z()) > std::abs(local[axis])) axis = 2;
  const bool positive = local[axis] >= 0.0;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const Vec3& h = s.shape.half_extents_m;
  const Vec3 center = s.pose.position + s.pose.rotation.col(axis) * (positive ? h[axis] : -h[axis]);
  const Vec3 du = s.pose.rotation.col(u) * h[u];
  const Vec3 dv = s.pose.rotation.col(v) * (positive ? h[v] : -h[v]);
  out.points[0] = center - du - dv;
  out.points[1] = center + du - dv;
  out.points[2] = center + du + dv;
  out.points[3] = center - du + dv;
  out.count = 4;
  out.normal = positive ? Vec3(s.pose.rotation.col(axis)) : Vec3(-s.pose.rotation.col(axis));
  out.code = static_cast<std::uint32_t>(2 * axis + (positive ? 0 : 1));
}

template <class Score>
void best_face(const PlacedShape& s, Score score, SupportFeature& out) {
  std::size_t best = 0;
  double best_score = score(s.shape.face_planes[0]);
  for (std::size_t f = 1; f < s.shape.face_planes.size(); ++f) {
    const double value = score(s.shape.face_planes[f]);
    if (value > best_score) best = f, best_score = value;
  }
  const auto& face = s.shape.faces[best];
  const std::size_t stride = (face.size() + kMaxFeaturePoints - 1) / kMaxFeaturePoints;
  for (std::size_t i = 0; i < face.size(); i += stride) {
    out.points[out.count++] = s.pose.to_world(s.shape.vertices_m[face[i]]);
  }
  out.normal = s.pose.rotation * s.shape.face_planes[best].normal;
  out.code = static_cast<std::uint32_t>(best);
}

void hull_face(const PlacedShape& s, const Vec3& local, SupportFeature& out) {
  best_face(
      s, [&](const FacePlane& plane) { return local.dot(plane.normal); }, out);
}

// The cap's polygon has a corner at the rim's lowest point once the cap is tilted; before, corners
// stay fixed to the body, so that noise does not turn the features.
void cylinder_cap(const PlacedShape& s, const Vec3& local, SupportFeature& out) {
  constexpr double kTilt = 1e-3;
  const double radial = std::sqrt(local.x() * local.x() + local.y() * local.y());
  const bool tilted = radial > kTilt;
  const double ux = tilted ? local.x() / radial : 1.0, uy = tilted ? local.y() / radial : 0.0;
  const double sign = local.z() >= 0.0 ? 1.0 : -1.0;
  const double r = s.shape.radius_m;
  for (int k = 0; k < kCapSides; ++k) {
    const double c = cosine(k), d = sign * sine(k);
    const Vec3 rim(r * (c * ux - d * uy), r * (c * uy + d * ux), sign * s.shape.half_length_m);
    out.points[k] = s.pose.to_world(rim);
  }
  out.count = kCapSides;
  out.normal = sign * s.pose.rotation.col(2);
  out.code = sign > 0.0 ? 0 : 1;
}

void segment(const PlacedShape& s, const Vec3& offset_local, SupportFeature& out) {
  const Vec3 center = s.pose.to_world(offset_local);
  const Vec3 half = s.pose.rotation.col(2) * s.shape.half_length_m;
  out.points[0] = center - half;
  out.points[1] = center + half;
  out.count = 2;
  out.code = 2;
}

}  // namespace

double separation_along(const PlacedShape& a, const PlacedShape& b, const Vec3& normal) {
  return (support_point(b, -normal) - support_point(a, normal)).dot(normal);
}

SupportFeature support_feature(const PlacedShape& s, const Vec3& direction) {
  constexpr double kCapsuleEnd = 0.9;   // closer to the axis than this, an end alone can touch
  constexpr double kCylinderCap = 0.7;  // closer to the axis, the cap faces the direction
  SupportFeature out;
  const Vec3 local = s.pose.direction_to_local(direction);
  switch (s.shape.kind) {
    case ShapeKind::kBox:
      box_face(s, local, out);
      return out;
    case ShapeKind::kHull:
      hull_face(s, local, out);
      return out;
    case ShapeKind::kCapsule:
      if (std::abs(local.z()) < kCapsuleEnd) {
        segment(s, local * s.shape.radius_m, out);
        return out;
      }
      break;
    case ShapeKind::kCylinder:
      if (std::abs(local.z()) > kCylinderCap) {
        cylinder_cap(s, local, out);
      } else {
        const double radial = std::sqrt(local.x() * local.x() + local.y() * local.y());
        segment(s, Vec3(local.x(), local.y(), 0.0) * (s.shape.radius_m / radial), out);
      }
      return out;
    default:
      break;
  }
  out.points[0] = s.pose.to_world(support(s.shape, local));
  out.count = 1;
  out.code = 3;
  return out;
}

SupportFeature face_ahead(const PlacedShape& hull, const Vec3& direction) {
  const Vec3 local = hull.pose.direction_to_local(direction);
  SupportFeature out;
  best_face(
      hull,
      [&](const FacePlane& plane) {
        return local.dot(plane.normal) / std::max(plane.offset_m, 1e-6 * hull.shape.min_extent_m);
      },
      out);
  return out;
}

bool PairMotion::reaches(const Vec3& point, const Vec3& normal, double separation) const {
  const double closing = std::max(0.0, -relative_velocity(point).dot(normal));
  return separation <= margin_m + closing * dt_s;
}

namespace {

// A polygon under clipping. edge[i] names the edge that leaves points[i]: below 64 one of the
// incident feature, from 64 on one of the reference. code[i] names the point: an incident corner,
// or the crossing of two edges.
struct ClipPolygon {
  std::array<Vec3, 2 * kMaxFeaturePoints> points;
  std::array<std::uint32_t, 2 * kMaxFeaturePoints> edge, code;
  int count = 0;

  void add(const Vec3& p, std::uint32_t e, std::uint32_t c) {
    if (count == static_cast<int>(points.size())) return;
    points[count] = p, edge[count] = e, code[count] = c;
    ++count;
  }
};

constexpr std::uint32_t kReferenceEdge = 64;

std::uint32_t crossing_code(std::uint32_t edge, std::uint32_t side) {
  return (edge + 1) << 6 | side;
}

// Of the prism over the reference.
struct SidePlane {
  const Vec3& point;
  Vec3 inward;
  std::uint32_t number;
  // Keeps corners that lie on the plane, so that aligned faces show their own corners rather than
  // crossings.
  double tolerance;
};

// Sutherland-Hodgman against one side plane.
void clip_by_side(const ClipPolygon& in, const SidePlane& side, bool closed, ClipPolygon& out) {
  out.count = 0;
  for (int i = 0; i < in.count; ++i) {
    const bool last = i + 1 == in.count;
    const int j = !last ? i + 1 : closed ? 0 : i;
    const double di = (in.points[i] - side.point).dot(side.inward);
    const double dj = (in.points[j] - side.point).dot(side.inward);
    const bool inside_i = di >= -side.tolerance, inside_j = dj >= -side.tolerance;
    if (inside_i) out.add(in.points[i], in.edge[i], in.code[i]);
    if (inside_i == inside_j) continue;
    const double t = std::clamp(di / (di - dj), 0.0, 1.0);
    const Vec3 crossing = in.points[i] + (in.points[j] - in.points[i]) * t;
    // Leaving, the outline goes on along the side; entering, along the edge it came in by.
    const std::uint32_t next = inside_i ? kReferenceEdge + side.number : in.edge[i];
    out.add(crossing, next, crossing_code(in.edge[i], side.number));
  }
}

}  // namespace

void clip_to_reference(const SupportFeature& reference, const SupportFeature& incident,
                       ContactCandidates& out) {
  constexpr double kTolerance = 1e-7;  // of the reference's size
  // Two in turn: a copy takes longer than the clipping.
  ClipPolygon room[2];
  ClipPolygon *current = &room[0], *next = &room[1];
  const bool closed = incident.count > 2;
  for (int i = 0; i < incident.count; ++i) {
    current->add(incident.points[i], static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i));
  }
  const double size = (reference.points[0] - reference.points[reference.count / 2]).norm();
  for (int side = 0; side < reference.count && current->count > 0; ++side) {
    const Vec3& from = reference.points[side];
    const Vec3& to = reference.points[side + 1 == reference.count ? 0 : side + 1];
    const Vec3 inward = reference.normal.cross(to - from);
    const double length = inward.norm();
    if (!(length > 0.0)) continue;
    const SidePlane plane{from, inward / length, static_cast<std::uint32_t>(side),
                          kTolerance * size};
    clip_by_side(*current, plane, closed, *next);
    std::swap(current, next);
  }
  const std::uint32_t faces = ((reference.code * 31u + incident.code) & 0xffffu) << 14;
  for (int i = 0; i < current->count; ++i) {
    const double separation = (current->points[i] - reference.points[0]).dot(reference.normal);
    out.add(current->points[i] - reference.normal * (0.5 * separation), separation,
            faces | current->code[i]);
  }
}

bool is_along(const SupportFeature& feature, const Vec3& direction) {
  constexpr double kAlong = 1.0 - 1e-9;
  return feature.count > 2 && feature.normal.dot(direction) > kAlong;
}

bool is_over(const SupportFeature& feature, const Vec3& direction) {
  constexpr double kOver = 0.98;  // cosine
  return feature.count > 2 && feature.normal.dot(direction) > kOver;
}

void clip_over(const SupportFeature& reference, const SupportFeature& incident,
               const Vec3& direction, double nearest_m, ContactCandidates& out) {
  clip_to_reference(reference, incident, out);
  if (out.count == 0) return;
  const double share = reference.normal.dot(direction);
  int deepest = 0;
  for (int i = 0; i < out.count; ++i) {
    out.points[i].separation_m *= share;
    if (out.points[i].separation_m < out.points[deepest].separation_m) deepest = i;
  }
  out.points[deepest].separation_m = nearest_m;
}

void overlap_segments(const SupportFeature& a, const SupportFeature& b, const Vec3& normal,
                      ContactCandidates& out) {
  constexpr double kParallel = 0.05;  // sine of the largest angle at which segments share a stretch
  if (a.count != 2 || b.count != 2) return;
  const Vec3 along = a.points[1] - a.points[0];
  const Vec3 other = b.points[1] - b.points[0];
  const double length = along.norm(), other_length = other.norm();
  if (!(length > 0.0) || !(other_length > 0.0)) return;
  if (along.cross(other).norm() > kParallel * length * other_length) return;
  const Vec3 axis = along / length;
  const double b0 = (b.points[0] - a.points[0]).dot(axis);
  const double b1 = (b.points[1] - a.points[0]).dot(axis);
  const double low = std::max(0.0, std::min(b0, b1)), high = std::min(length, std::max(b0, b1));
  if (low > high || !(std::abs(b1 - b0) > 0.0)) return;
  for (int end = 0; end < 2; ++end) {
    const double t = end == 0 ? low : high;
    const Vec3 on_a = a.points[0] + axis * t;
    const Vec3 on_b = b.points[0] + other * ((t - b0) / (b1 - b0));
    out.add(0.5 * (on_a + on_b), (on_b - on_a).dot(normal), static_cast<std::uint32_t>(end));
  }
}

namespace {

template <typename Score>
int best_of(const ContactCandidates& c, Score score) {
  int best = 0;
  double best_score = score(c.points[0]);
  for (int i = 1; i < c.count; ++i) {
    const double value = score(c.points[i]);
    if (value > best_score) best = i, best_score = value;
  }
  return best;
}

// Deepest, farthest from it, farthest from the line of the two, farthest on its other side. Ties go
// to the first in canonical order.
void reduce_to_four(const Vec3& normal, ContactCandidates& c) {
  const auto position = [&](int i) -> const Vec3& { return c.points[i].position_m; };
  std::array<int, 4> keep;
  keep[0] = best_of(c, [](const ContactPoint& p) { return -p.separation_m; });
  keep[1] = best_of(
      c, [&](const ContactPoint& p) { return (p.position_m - position(keep[0])).squaredNorm(); });
  const Vec3 across = normal.cross(position(keep[1]) - position(keep[0]));
  const auto side = [&](const ContactPoint& p) {
    return across.dot(p.position_m - position(keep[0]));
  };
  keep[2] = best_of(c, [&](const ContactPoint& p) { return side(p); });
  keep[3] = best_of(c, [&](const ContactPoint& p) { return -side(p); });
  std::sort(keep.begin(), keep.end());
  const auto end = std::unique(keep.begin(), keep.end());
  int count = 0;
  for (auto it = keep.begin(); it != end; ++it) c.points[count++] = c.points[*it];
  c.count = count;
}

}  // namespace

void keep_reached(const PairMotion& motion, const Vec3& normal, ContactCandidates& candidates) {
  int count = 0;
  for (int i = 0; i < candidates.count; ++i) {
    const ContactPoint& p = candidates.points[i];
    if (motion.reaches(p.position_m, normal, p.separation_m)) candidates.points[count++] = p;
  }
  candidates.count = count;
}

void emit_manifold(const PairStep& pair, std::uint32_t part, const Vec3& normal,
                   const Vec3& origin_m, ContactCandidates& candidates,
                   std::vector<ContactManifold>& out) {
  int count = 0;
  for (int i = 0; i < candidates.count; ++i) {
    const ContactPoint& p = candidates.points[i];
    if (p.position_m.allFinite() && std::isfinite(p.separation_m)) candidates.points[count++] = p;
  }
  candidates.count = count;
  if (count == 0 || !(std::abs(normal.squaredNorm() - 1.0) < 1e-9)) return;
  std::sort(candidates.points.begin(), candidates.points.begin() + count,
            [](const ContactPoint& x, const ContactPoint& y) {
              if (x.feature != y.feature) return x.feature < y.feature;
              return comes_before(x.position_m, y.position_m);
            });
  if (count > 4) reduce_to_four(normal, candidates);
  const auto points = static_cast<std::uint32_t>(candidates.count);
  ContactManifold manifold{pair.a, pair.b, part, points, normal, {}};
  for (int i = 0; i < candidates.count; ++i) {
    manifold.points[i] = candidates.points[i];
    manifold.points[i].position_m += origin_m;
  }
  out.push_back(manifold);
}

}  // namespace soda::physics
