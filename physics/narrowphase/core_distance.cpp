#include "physics/narrowphase/core_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

// All differences (point of b) - (point of a) form a convex set; the cores are as far apart as it
// is from the origin. A simplex of at most four of its points is kept, of which the nearest point
// to the origin is known; the support in its direction tells whether the set comes nearer.
namespace soda::physics {
namespace {

struct Corner {
  Vec3 on_a, on_b, gap;  // gap = on_b - on_a
};

struct Simplex {
  std::array<Corner, 4> corners;
  std::array<double, 4> shares{};  // of the corners in the nearest point
  int count = 0;
};

// The nearest point to the origin of the hull of some corners.
struct Nearest {
  Vec3 point = Vec3::Zero();
  double squared = 1e300;
  std::array<double, 4> shares{};
};

Vec3 farthest(const Core& core, const Vec3& direction) {
  const CompiledShape& shape = core.solid.shape;
  const Mat3& rotation = core.solid.pose.rotation;
  const Vec3 d(rotation.col(0).dot(direction), rotation.col(1).dot(direction),
               rotation.col(2).dot(direction));
  switch (shape.kind) {
    case ShapeKind::kSphere:
      return core.solid.pose.position;
    case ShapeKind::kCapsule:
      return core.solid.pose.position +
             rotation.col(2) * std::copysign(core.scale * shape.half_length_m, d.z());
    case ShapeKind::kCylinder: {
      const double radial = std::sqrt(d.x() * d.x() + d.y() * d.y());
      const double scale =
          radial > 0.0 ? core.scale * (shape.radius_m - core.skin_m) / radial : 0.0;
      return core.solid.pose.position + rotation.col(0) * (d.x() * scale) +
             rotation.col(1) * (d.y() * scale) +
             rotation.col(2) *
                 std::copysign(core.scale * (shape.half_length_m - core.skin_m), d.z());
    }
    case ShapeKind::kBox: {
      const Vec3& half = shape.half_extents_m;
      return core.solid.pose.position +
             rotation.col(0) * std::copysign(core.scale * (half.x() - core.skin_m), d.x()) +
             rotation.col(1) * std::copysign(core.scale * (half.y() - core.skin_m), d.y()) +
             rotation.col(2) * std::copysign(core.scale * (half.z() - core.skin_m), d.z());
    }
    default:
      return core.solid.pose.position + rotation * (core.scale * support(shape, d));
  }
}

void keep_nearer(const Nearest& other, Nearest& best) {
  if (other.squared < best.squared) best = other;
}

Nearest of_corner(const Simplex& s, int i) {
  Nearest out{s.corners[i].gap, s.corners[i].gap.squaredNorm(), {}};
  out.shares[i] = 1.0;
  return out;
}

Nearest of_edge(const Simplex& s, int i, int j) {
  const Vec3& from = s.corners[i].gap;
  const Vec3 along = s.corners[j].gap - from;
  const double length = along.squaredNorm(), projected = -from.dot(along);
  if (!(projected > 0.0)) return of_corner(s, i);
  if (!(projected < length)) return of_corner(s, j);
  const double share = projected / length;
  Nearest out;
  out.point = from + along * share;
  out.squared = out.point.squaredNorm();
  out.shares[i] = 1.0 - share;
  out.shares[j] = share;
  return out;
}

// Nearest points of a face lie inside it or on edges behind which the origin is.
Nearest of_face(const Simplex& s, int i, int j, int k) {
  const Vec3& from = s.corners[i].gap;
  const Vec3 u = s.corners[j].gap - from, v = s.corners[k].gap - from;
  const Vec3 normal = u.cross(v);
  const double area = normal.squaredNorm();
  const double of_j = v.cross(from).dot(normal), of_k = from.cross(u).dot(normal);
  const double of_i = area - of_j - of_k;
  if (of_i > 0.0 && of_j > 0.0 && of_k > 0.0) {
    Nearest out;
    out.point = normal * (normal.dot(from) / area);
    out.squared = out.point.squaredNorm();
    out.shares[i] = of_i / area;
    out.shares[j] = of_j / area;
    out.shares[k] = of_k / area;
    return out;
  }
  Nearest best;
  if (!(of_i > 0.0)) keep_nearer(of_edge(s, j, k), best);
  if (!(of_j > 0.0)) keep_nearer(of_edge(s, i, k), best);
  if (!(of_k > 0.0)) keep_nearer(of_edge(s, i, j), best);
  return best;
}

// Where the origin is inside, the squared distance is 0.
Nearest of_solid(const Simplex& s) {
  const Vec3& from = s.corners[0].gap;
  const Vec3 u = s.corners[1].gap - from, v = s.corners[2].gap - from, w = s.corners[3].gap - from;
  const Vec3 across = v.cross(w);
  const double volume = u.dot(across);
  const double sign = volume < 0.0 ? -1.0 : 1.0;
  const double of_1 = -sign * from.dot(across), of_2 = -sign * from.dot(w.cross(u)),
               of_3 = -sign * from.dot(u.cross(v));
  const double of_0 = sign * volume - of_1 - of_2 - of_3;
  Nearest best;
  if (of_0 > 0.0 && of_1 > 0.0 && of_2 > 0.0 && of_3 > 0.0) {
    best.squared = 0.0;
    return best;
  }
  if (!(of_0 > 0.0)) keep_nearer(of_face(s, 1, 2, 3), best);
  if (!(of_1 > 0.0)) keep_nearer(of_face(s, 0, 2, 3), best);
  if (!(of_2 > 0.0)) keep_nearer(of_face(s, 0, 1, 3), best);
  if (!(of_3 > 0.0)) keep_nearer(of_face(s, 0, 1, 2), best);
  return best;
}

Nearest nearest_of(const Simplex& s) {
  if (s.count == 1) return of_corner(s, 0);
  if (s.count == 2) return of_edge(s, 0, 1);
  return s.count == 3 ? of_face(s, 0, 1, 2) : of_solid(s);
}

// Corners without a share go.
void reduce(const Nearest& nearest, Simplex& s) {
  int kept = 0;
  for (int i = 0; i < s.count; ++i) {
    if (!(nearest.shares[i] > 0.0)) continue;
    if (kept != i) s.corners[kept] = s.corners[i];
    s.shares[kept++] = nearest.shares[i];
  }
  s.count = kept;
}

bool has(const Simplex& s, const Vec3& gap) {
  for (int i = 0; i < s.count; ++i)
    if (s.corners[i].gap == gap) return true;
  return false;
}

}  // namespace

double skin_of(const CompiledShape& shape) {
  const bool round = shape.kind == ShapeKind::kSphere || shape.kind == ShapeKind::kCapsule;
  return round ? shape.radius_m : 0.0;
}

CoreGap core_gap(const Core& a, const Core& b, const Vec3& guess, double tiny_m, double far_m) {
  constexpr int kMostTrials = 64;
  constexpr double kNearEnough = 1e-10;  // of the distance
  Simplex simplex;
  Vec3 nearest = guess;
  double squared = 0.0, reached = 0.0;
  for (int i = 0;; ++i) {
    Corner& next = simplex.corners[simplex.count];
    next.on_a = farthest(a, nearest);
    next.on_b = farthest(b, -nearest);
    next.gap = next.on_b - next.on_a;
    reached = nearest.dot(next.gap);
    if (reached > far_m * nearest.norm()) return {.overlap = false, .far = true};
    if (i > 0) {
      const bool near_enough = squared - reached <= kNearEnough * squared;
      if (near_enough || has(simplex, next.gap) || i + 1 == kMostTrials) break;
    }
    ++simplex.count;
    const Nearest found = nearest_of(simplex);
    if (!(found.squared > tiny_m * tiny_m)) return {.overlap = true, .far = false};
    // Rounding is all that is left to gain.
    if (i > 0 && !(found.squared < squared)) {
      --simplex.count;
      break;
    }
    reduce(found, simplex);
    nearest = found.point;
    squared = found.squared;
  }
  CoreGap gap;
  gap.distance_m = std::sqrt(squared);
  gap.normal = nearest / gap.distance_m;
  gap.least_m = reached / gap.distance_m;
  for (int i = 0; i < simplex.count; ++i) {
    gap.on_a += simplex.corners[i].on_a * simplex.shares[i];
    gap.on_b += simplex.corners[i].on_b * simplex.shares[i];
  }
  return gap;
}

namespace {

// A solid that has shrunk: down to its inmost segment or rectangle, of share 1, all surfaces come
// in by the same; then that shrinks to its middle, at 2. A hull does so from the start.
struct Shrunk {
  Core core;
  double round_m = 0.0;  // what is left of the skin around the core

  Shrunk(const PlacedShape& solid, double share) : core{solid} {
    if (solid.shape.kind == ShapeKind::kHull) {
      core.scale = 1.0 - 0.5 * share;
      return;
    }
    const double in = std::min(share, 1.0);
    core.scale = std::min(1.0, 2.0 - share);
    const double skin = skin_of(solid.shape);
    round_m = (1.0 - in) * skin;
    core.skin_m = skin > 0.0 ? skin : in * 0.5 * solid.shape.min_extent_m;
  }
};

}  // namespace

// Along a fixed direction the gap is linear in the share, so the largest gap of all directions is
// convex in it: from where they are apart, Newton's method comes down to where they touch.
ShrunkTouch touch_of_shrunk(const PlacedShape& a, const PlacedShape& b, bool b_too) {
  constexpr double kTiny = 1e-10;    // of the width
  constexpr double kFirst = 1e-3;    // of the size, taken off
  constexpr double kAll = 2.0;       // of what can be taken off
  constexpr double kExact = 1.01;    // ratio of what is taken off
  constexpr double kBeyond = 1.001;  // so that they are apart there, but for rounding
  const Vec3 between = b.pose.position - a.pose.position;
  ShrunkTouch touch{between == Vec3::Zero() ? Vec3(Vec3::UnitZ()) : Vec3(between.normalized()),
                    a.pose.position};
  double gap_m = 0.0;
  const auto are_apart = [&](double share) {
    const Shrunk of_a(a, share), of_b(b, b_too ? share : 0.0);
    const CoreGap gap = core_gap(of_a.core, of_b.core, touch.normal,
                                 kTiny * (a.shape.min_extent_m + b.shape.min_extent_m));
    gap_m = gap.least_m - of_a.round_m - of_b.round_m;
    if (gap.overlap || gap_m <= 0.0) return false;
    touch = {gap.normal, gap.on_b - gap.normal * of_b.round_m};
    return true;
  };
  double less = 0.0, more = kFirst;
  while (!are_apart(more)) {
    if (more == kAll) return touch;
    less = more;
    more = std::min(kAll, 4.0 * more);
  }
  double next = 0.0;
  const auto foretell = [&] {
    const double depth_m = std::max(0.0, -separation_along(a, b, touch.normal));
    next = more * depth_m / (depth_m + gap_m);
  };
  foretell();
  while (more > kExact * std::max(less, next) && more > kTiny) {
    const double middle = less > 0.0 ? std::sqrt(less * more) : 0.1 * more;
    const double share = next * kBeyond > less ? next * kBeyond : middle;
    if (are_apart(share))
      more = share, foretell();
    else
      less = share, next = 0.0;
  }
  return touch;
}

}  // namespace soda::physics
