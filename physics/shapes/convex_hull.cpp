#include <libqhull_r/qhull_ra.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>

#include "physics/math/disjoint_sets.hpp"
#include "physics/shapes/mass_properties.hpp"

namespace soda::physics {
namespace {

constexpr double kCoplanar = 1e-9;  // sine of the largest angle between faces that are one
constexpr double kFlat = 1e-9;      // thickness, of the size, below which there is no volume

struct HullTriangle {
  std::array<std::uint32_t, 3> corners;
  Vec3 normal;
};

// Runs Qhull with messages discarded. Returns the triangles of the hull, counter-clockwise seen
// from outside, or Qhull's verdict.
std::variant<std::vector<HullTriangle>, std::string> triangulated_hull(
    const std::vector<Vec3>& points) {
  std::vector<coordT> coordinates;
  for (const Vec3& p : points) coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> sink(std::fopen("/dev/null", "w"),
                                                             std::fclose);
  qhT qhull;
  qh_zero(&qhull, sink.get());
  char command[] = "qhull Qt";
  const int failed = qh_new_qhull(&qhull, 3, static_cast<int>(points.size()), coordinates.data(),
                                  False, command, sink.get(), sink.get());
  std::vector<HullTriangle> triangles;
  if (!failed) {
    for (facetT* facet = qhull.facet_list; facet && facet->next; facet = facet->next) {
      HullTriangle triangle{{}, Vec3(facet->normal[0], facet->normal[1], facet->normal[2])};
      setT* vertices = facet->vertices;
      for (int i = 0; i < 3; ++i) {
        const vertexT* vertex = static_cast<vertexT*>(vertices->e[i].p);
        triangle.corners[i] = static_cast<std::uint32_t>(qh_pointid(&qhull, vertex->point));
      }
      triangles.push_back(triangle);
    }
  }
  qh_freeqhull(&qhull, !qh_ALL);
  int current = 0, total = 0;
  qh_memfreeshort(&qhull, &current, &total);
  if (failed) return "the points have no convex hull (Qhull error " + std::to_string(failed) + ")";
  for (HullTriangle& t : triangles) {
    const Vec3& a = points[t.corners[0]];
    const Vec3 cross = (points[t.corners[1]] - a).cross(points[t.corners[2]] - a);
    if (cross.dot(t.normal) < 0.0) std::swap(t.corners[1], t.corners[2]);
  }
  return triangles;
}

// Distinct points in lexicographic order: whatever is computed from them forgets the given order.
std::vector<Vec3> sorted_unique(std::span<const Vec3> points) {
  std::vector<Vec3> sorted(points.begin(), points.end());
  for (Vec3& p : sorted) p += Vec3::Zero();  // -0 becomes 0
  std::sort(sorted.begin(), sorted.end(), comes_before);
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

// A plane through the largest face-to-be, to tell a flat cloud from a solid one.
double thickness(const std::vector<Vec3>& points) {
  const auto farthest = [&](auto score) {
    double best = 0.0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double value = score(points[i]);
      if (value > best) best = value, at = i;
    }
    return std::pair(at, best);
  };
  const Vec3& origin = points.front();
  const auto [b, length] = farthest([&](const Vec3& p) { return (p - origin).norm(); });
  if (!(length > 0.0)) return 0.0;
  const Vec3 edge = (points[b] - origin) / length;
  const auto [c, width] = farthest([&](const Vec3& p) { return edge.cross(p - origin).norm(); });
  if (!(width > kFlat * length)) return 0.0;
  const Vec3 normal = edge.cross(points[c] - origin) / width;
  const double height =
      farthest([&](const Vec3& p) { return std::abs(normal.dot(p - origin)); }).second;
  return height / length;
}

struct DirectedEdge {
  std::uint32_t from = 0, to = 0, triangle = 0;
  friend auto operator<=>(const DirectedEdge&, const DirectedEdge&) = default;
};

std::vector<DirectedEdge> sorted_edges(const std::vector<HullTriangle>& triangles) {
  std::vector<DirectedEdge> edges;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto& c = triangles[t].corners;
    for (int i = 0; i < 3; ++i) edges.push_back({c[i], c[(i + 1) % 3], t});
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

const DirectedEdge* opposite(const std::vector<DirectedEdge>& edges, const DirectedEdge& e) {
  const DirectedEdge key{e.to, e.from, 0};
  const auto it = std::lower_bound(edges.begin(), edges.end(), key);
  return it != edges.end() && it->from == e.to && it->to == e.from ? &*it : nullptr;
}

// The outline of each set of coplanar triangles: the edges whose other side is another set.
std::vector<std::vector<std::uint32_t>> merged_faces(const std::vector<HullTriangle>& triangles) {
  std::vector<std::uint32_t> parent(triangles.size());
  for (std::uint32_t t = 0; t < parent.size(); ++t) parent[t] = t;
  const std::vector<DirectedEdge> edges = sorted_edges(triangles);
  for (const DirectedEdge& e : edges) {
    const DirectedEdge* other = opposite(edges, e);
    if (!other) continue;
    const Vec3& n = triangles[e.triangle].normal;
    const Vec3& m = triangles[other->triangle].normal;
    if (n.dot(m) > 0.0 && n.cross(m).norm() < kCoplanar) {
      const std::uint32_t a = find_root(parent, e.triangle);
      const std::uint32_t b = find_root(parent, other->triangle);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<std::vector<DirectedEdge>> outline(triangles.size());
  for (const DirectedEdge& e : edges) {
    const DirectedEdge* other = opposite(edges, e);
    const std::uint32_t face = find_root(parent, e.triangle);
    if (!other || find_root(parent, other->triangle) != face) outline[face].push_back(e);
  }
  std::vector<std::vector<std::uint32_t>> faces;
  for (const auto& border : outline) {
    if (border.empty()) continue;
    // Sorted by start, so the walk begins at the smallest corner.
    std::vector<std::uint32_t> face{border.front().from};
    std::uint32_t at = border.front().to;
    while (at != face.front() && face.size() <= border.size()) {
      face.push_back(at);
      const auto next = std::lower_bound(border.begin(), border.end(), DirectedEdge{at, 0, 0});
      if (next == border.end() || next->from != at) break;
      at = next->to;
    }
    faces.push_back(std::move(face));
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

}  // namespace

std::variant<ConvexHull, std::string> make_convex_hull(std::span<const Vec3> points_m) {
  if (points_m.size() < 4) return "a hull needs at least four points";
  for (const Vec3& p : points_m) {
    if (!p.allFinite()) return "a point is not finite";
  }
  const std::vector<Vec3> points = sorted_unique(points_m);
  if (points.size() < 4) return "a hull needs at least four distinct points";
  if (!(thickness(points) > kFlat)) return "the points lie in one plane";
  auto result = triangulated_hull(points);
  if (auto* fault = std::get_if<std::string>(&result)) return *fault;
  auto faces = merged_faces(std::get<std::vector<HullTriangle>>(result));

  // Points inside, or in the middle of a merged face, are not vertices.
  std::vector<std::uint32_t> renumbered(points.size(), 0);
  for (const auto& face : faces) {
    for (const std::uint32_t v : face) renumbered[v] = 1;
  }
  ConvexHull hull;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!renumbered[i]) continue;
    renumbered[i] = static_cast<std::uint32_t>(hull.vertices_m.size());
    hull.vertices_m.push_back(points[i]);
  }
  for (auto& face : faces) {
    for (std::uint32_t& v : face) v = renumbered[v];
  }
  hull.faces = std::move(faces);
  return hull;
}

}  // namespace soda::physics
