#include "physics/shapes/compiled_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/math/disjoint_sets.hpp"

namespace soda::physics {
namespace {

// Two unit normals whose dot product exceeds this belong to one plane (angle below 1.4e-5 rad).
constexpr double kCoplanarDot = 1.0 - 1e-10;

FacePlane plane_through(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 cross = (b - a).cross(c - a);
  const double length = cross.norm();
  FacePlane plane;
  plane.normal = length > 0.0 ? Vec3(cross / length) : Vec3(Vec3::UnitZ());
  plane.offset_m = plane.normal.dot(a);
  return plane;
}

// Newell's normal is exact for triangles and averages the rounding of larger faces.
FacePlane plane_of_face(const std::vector<Vec3>& vertices, const std::vector<std::uint32_t>& face) {
  Vec3 sum = Vec3::Zero();
  const Vec3& origin = vertices[face[0]];
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    sum += (vertices[face[i]] - origin).cross(vertices[face[i + 1]] - origin);
  }
  FacePlane plane;
  plane.normal = sum / sum.norm();
  plane.offset_m = -1e300;
  for (const std::uint32_t v : face) {
    plane.offset_m = std::max(plane.offset_m, plane.normal.dot(vertices[v]));
  }
  return plane;
}

void compile_hull(const ConvexHull& hull, CompiledShape& out) {
  out.vertices_m = hull.vertices_m;
  out.faces = hull.faces;
  out.min_extent_m = 1e300;
  for (const auto& face : hull.faces) {
    const FacePlane plane = plane_of_face(hull.vertices_m, face);
    out.face_planes.push_back(plane);
    double lowest = plane.offset_m;
    for (const Vec3& v : hull.vertices_m) lowest = std::min(lowest, plane.normal.dot(v));
    out.min_extent_m = std::min(out.min_extent_m, plane.offset_m - lowest);
  }
  for (const Vec3& v : hull.vertices_m) {
    out.bounding_radius_m = std::max(out.bounding_radius_m, v.norm());
  }
}

void compile_box(const Box& box, CompiledShape& out) {
  out.half_extents_m = box.half_extents_m;
  out.min_extent_m = 2.0 * box.half_extents_m.minCoeff();
  out.bounding_radius_m = box.half_extents_m.norm();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      out.face_planes.push_back({sign * Vec3::Unit(axis), box.half_extents_m[axis]});
    }
  }
}

struct MeshEdge {
  std::uint32_t low = 0, high = 0;  // vertex indices
  std::uint32_t triangle = 0, side = 0;
};

// For each vertex the first one of its place: files may have corners once for each triangle.
std::vector<std::uint32_t> welded(const std::vector<Vec3>& vertices) {
  std::vector<std::uint32_t> order(vertices.size()), first(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t x, std::uint32_t y) {
    if (vertices[x] != vertices[y]) return comes_before(vertices[x], vertices[y]);
    return x < y;
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && vertices[order[i]] == vertices[order[i - 1]];
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

std::vector<MeshEdge> sorted_edges(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> first = welded(mesh.vertices_m);
  std::vector<MeshEdge> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t a = first[mesh.triangles[t][side]],
                          b = first[mesh.triangles[t][(side + 1) % 3]];
      edges.push_back({std::min(a, b), std::max(a, b), t, side});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const MeshEdge& x, const MeshEdge& y) {
    return std::array{x.low, x.high, x.triangle, x.side} <
           std::array{y.low, y.high, y.triangle, y.side};
  });
  return edges;
}

// Marks the edges between two triangles that are flat or concave, and joins coplanar triangles.
void connect_triangles(const TriangleMesh& mesh, CompiledShape& out) {
  std::vector<std::uint32_t> parent(out.triangles.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const std::vector<MeshEdge> edges = sorted_edges(mesh);
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const MeshEdge& first = edges[i];
    const MeshEdge& second = edges[i + 1];
    if (first.low != second.low || first.high != second.high) continue;
    MeshTriangle& a = out.triangles[first.triangle];
    MeshTriangle& b = out.triangles[second.triangle];
    const bool coplanar = a.plane.normal.dot(b.plane.normal) > kCoplanarDot;
    const Vec3& apex = b.corners_m[(second.side + 2) % 3];
    const bool convex = a.plane.normal.dot(apex) < a.plane.offset_m;
    if (coplanar || !convex) {
      a.edge_active[first.side] = false;
      b.edge_active[second.side] = false;
    }
    a.edge_limit[first.side] = b.plane.normal;
    b.edge_limit[second.side] = a.plane.normal;
    b.edge_own[second.side] = false;
    if (coplanar) {
      const std::uint32_t ra = find_root(parent, first.triangle);
      const std::uint32_t rb = find_root(parent, second.triangle);
      parent[std::max(ra, rb)] = std::min(ra, rb);
    }
  }
  for (std::uint32_t t = 0; t < parent.size(); ++t) {
    out.triangles[t].group = find_root(parent, t);
  }
}

bool is_thin(const MeshTriangle& t) {
  constexpr double kThin = 1e-12;  // height over the longest side
  const Vec3 u = t.corners_m[1] - t.corners_m[0], v = t.corners_m[2] - t.corners_m[0];
  const double longest = std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()});
  return !(u.cross(v).norm() > kThin * longest);
}

void compile_mesh(const TriangleMesh& mesh, CompiledShape& out) {
  for (const auto& triangle : mesh.triangles) {
    MeshTriangle t;
    for (std::size_t i = 0; i < 3; ++i) t.corners_m[i] = mesh.vertices_m[triangle[i]];
    t.plane = plane_through(t.corners_m[0], t.corners_m[1], t.corners_m[2]);
    // Without an area it touches nothing.
    if (is_thin(t)) t.plane = {Vec3::Zero(), 0.0};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 away = (t.corners_m[(i + 1) % 3] - t.corners_m[i]).cross(t.plane.normal);
      const double length = away.norm();
      t.edge_limit[i] = length > 0.0 ? Vec3(away / length) : t.plane.normal;
    }
    out.triangles.push_back(t);
  }
  connect_triangles(mesh, out);
  std::vector<std::array<Vec3, 3>> corners;
  corners.reserve(out.triangles.size());
  for (const MeshTriangle& t : out.triangles) corners.push_back(t.corners_m);
  out.tree = TriangleTree(corners);
  for (const Vec3& v : mesh.vertices_m) {
    out.bounding_radius_m = std::max(out.bounding_radius_m, v.norm());
  }
}

void compile_round(double radius_m, double half_length_m, CompiledShape& out) {
  out.radius_m = radius_m;
  out.half_length_m = half_length_m;
}

// Exact for solids.
double farthest_m(const CompiledShape& solid, const Vec3& from) {
  const double across = std::sqrt(from.x() * from.x() + from.y() * from.y());
  const double along = std::abs(from.z()) + solid.half_length_m;
  switch (solid.kind) {
    case ShapeKind::kBox:
      return (from.cwiseAbs() + solid.half_extents_m).norm();
    case ShapeKind::kCylinder:
      return Vec3(across + solid.radius_m, 0.0, along).norm();
    case ShapeKind::kHull: {
      double most = 0.0;
      for (const Vec3& v : solid.vertices_m) most = std::max(most, (v - from).norm());
      return most;
    }
    default:
      return Vec3(across, 0.0, along).norm() + solid.radius_m;
  }
}

void compile_compound(const Compound& compound, std::span<const Shape> shapes, CompiledShape& out) {
  out.min_extent_m = 1e300;
  for (const CompoundPart& part : compound.parts) {
    auto solid = std::make_shared<const CompiledShape>(compile(shapes[part.shape]));
    const Pose pose{part.orientation.toRotationMatrix(), part.position_m};
    const double reach = farthest_m(*solid, pose.to_local(Vec3::Zero()));
    out.min_extent_m = std::min(out.min_extent_m, solid->min_extent_m);
    out.bounding_radius_m = std::max(out.bounding_radius_m, reach);
    out.parts.push_back({part.shape, pose, std::move(solid)});
  }
}

}  // namespace

CompiledShape compile(const Shape& shape, std::span<const Shape> shapes) {
  CompiledShape out;
  out.kind = static_cast<ShapeKind>(shape.index());
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    compile_round(sphere->radius_m, 0.0, out);
    out.min_extent_m = 2.0 * sphere->radius_m;
    out.bounding_radius_m = sphere->radius_m;
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    compile_box(*box, out);
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    compile_round(capsule->radius_m, 0.5 * capsule->length_m, out);
    out.min_extent_m = 2.0 * capsule->radius_m;
    out.bounding_radius_m = out.radius_m + out.half_length_m;
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    compile_round(cylinder->radius_m, 0.5 * cylinder->length_m, out);
    out.min_extent_m = std::min(2.0 * cylinder->radius_m, cylinder->length_m);
    out.face_planes = {{Vec3::UnitZ(), out.half_length_m}, {-Vec3::UnitZ(), out.half_length_m}};
    out.bounding_radius_m =
        std::sqrt(out.radius_m * out.radius_m + out.half_length_m * out.half_length_m);
  } else if (const auto* hull = std::get_if<ConvexHull>(&shape)) {
    compile_hull(*hull, out);
  } else if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
    compile_mesh(*mesh, out);
  } else if (const auto* compound = std::get_if<Compound>(&shape)) {
    compile_compound(*compound, shapes, out);
  } else {
    const HalfSpace& half_space = std::get<HalfSpace>(shape);
    const double length = half_space.normal.norm();
    out.half_space = {half_space.normal / length, half_space.offset_m / length};
  }
  const Aabb box = tight_aabb(out, {Mat3::Identity(), Vec3::Zero()});
  out.reach_m = box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs());
  return out;
}

namespace {

Vec3 support_of_parts(const CompiledShape& shape, const Vec3& direction) {
  Vec3 best = Vec3::Zero();
  double farthest = -1e300;
  for (const CompiledPart& part : shape.parts) {
    const Vec3 point =
        part.pose.to_world(support(*part.solid, part.pose.direction_to_local(direction)));
    const double dot = direction.dot(point);
    if (dot > farthest) best = point, farthest = dot;
  }
  return best;
}

}  // namespace

Vec3 support(const CompiledShape& shape, const Vec3& direction) {
  switch (shape.kind) {
    case ShapeKind::kSphere: {
      const double length = direction.norm();
      return length > 0.0 ? Vec3(direction * (shape.radius_m / length)) : Vec3(Vec3::Zero());
    }
    case ShapeKind::kBox:
      return {std::copysign(shape.half_extents_m.x(), direction.x()),
              std::copysign(shape.half_extents_m.y(), direction.y()),
              std::copysign(shape.half_extents_m.z(), direction.z())};
    case ShapeKind::kCapsule: {
      const double length = direction.norm();
      Vec3 point = Vec3::Zero();
      if (length > 0.0) point = direction * (shape.radius_m / length);
      point.z() += std::copysign(shape.half_length_m, direction.z());
      return point;
    }
    case ShapeKind::kCylinder: {
      const double radial =
          std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
      const double scale = radial > 0.0 ? shape.radius_m / radial : 0.0;
      return {direction.x() * scale, direction.y() * scale,
              std::copysign(shape.half_length_m, direction.z())};
    }
    case ShapeKind::kHull: {
      std::size_t best = 0;
      double best_dot = direction.dot(shape.vertices_m[0]);
      for (std::size_t i = 1; i < shape.vertices_m.size(); ++i) {
        const double dot = direction.dot(shape.vertices_m[i]);
        if (dot > best_dot) best = i, best_dot = dot;
      }
      return shape.vertices_m[best];
    }
    case ShapeKind::kCompound:
      return support_of_parts(shape, direction);
    case ShapeKind::kMesh:
    case ShapeKind::kHalfSpace:
      break;
  }
  return Vec3::Zero();
}

namespace {

Aabb around_points(const CompiledShape& shape, const Pose& pose) {
  Aabb box{Vec3::Constant(1e300), Vec3::Constant(-1e300)};
  const auto include = [&](const Vec3& local) {
    const Vec3 world = pose.to_world(local);
    box.min = box.min.cwiseMin(world);
    box.max = box.max.cwiseMax(world);
  };
  for (const Vec3& v : shape.vertices_m) include(v);
  for (const MeshTriangle& t : shape.triangles) {
    for (const Vec3& v : t.corners_m) include(v);
  }
  return box;
}

Aabb around_parts(const CompiledShape& shape, const Pose& pose) {
  Aabb box{Vec3::Constant(1e300), Vec3::Constant(-1e300)};
  for (const CompiledPart& part : shape.parts) {
    const Aabb one = tight_aabb(
        *part.solid, {pose.rotation * part.pose.rotation, pose.to_world(part.pose.position)});
    box.min = box.min.cwiseMin(one.min);
    box.max = box.max.cwiseMax(one.max);
  }
  return box;
}

}  // namespace

Aabb tight_aabb(const CompiledShape& shape, const Pose& pose) {
  Vec3 half = Vec3::Constant(shape.radius_m);
  switch (shape.kind) {
    case ShapeKind::kSphere:
    case ShapeKind::kHalfSpace:
      break;
    case ShapeKind::kBox:
      for (int i = 0; i < 3; ++i) {
        half[i] = std::abs(pose.rotation(i, 0)) * shape.half_extents_m.x() +
                  std::abs(pose.rotation(i, 1)) * shape.half_extents_m.y() +
                  std::abs(pose.rotation(i, 2)) * shape.half_extents_m.z();
      }
      break;
    case ShapeKind::kCapsule:
      half += pose.rotation.col(2).cwiseAbs() * shape.half_length_m;
      break;
    case ShapeKind::kCylinder:
      for (int i = 0; i < 3; ++i) {
        const double c = std::abs(pose.rotation(i, 2));
        half[i] = shape.half_length_m * c + shape.radius_m * std::sqrt(std::max(0.0, 1 - c * c));
      }
      break;
    case ShapeKind::kHull:
    case ShapeKind::kMesh:
      return around_points(shape, pose);
    case ShapeKind::kCompound:
      return around_parts(shape, pose);
  }
  return {pose.position - half, pose.position + half};
}

}  // namespace soda::physics
