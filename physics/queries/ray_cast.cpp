#include "physics/queries/ray_cast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// In the frame of the shape.
struct LocalRay {
  Vec3 from, direction;
  double length;

  Vec3 at(double distance) const { return from + direction * distance; }
};

// Where a ray enters, at `distance` >= 0; kNever: it does not.
struct RayEntry {
  double distance = kNever;
  Vec3 normal = Vec3::UnitZ();

  void keep_nearer(const RayEntry& other) {
    if (other.distance < distance) *this = other;
  }
};

// The part of a ray that is in a convex solid, cut off half space by half space.
class ConvexPassage {
 public:
  explicit ConvexPassage(const LocalRay& ray) : ray_(ray) {}

  void cut(const Vec3& normal, double offset_m) {
    const double above = normal.dot(ray_.from) - offset_m, speed = normal.dot(ray_.direction);
    if (speed == 0.0) {
      if (above > 0.0) leave_ = -kNever;
    } else if (speed > 0.0) {
      leave_ = std::min(leave_, -above / speed);
    } else if (const double distance = -above / speed; distance > enter_) {
      enter_ = distance;
      normal_ = normal;
    }
  }
  // An endless cylinder about z, or a sphere, given by the ray's quadratic: a w^2 + 2 b w + c <= 0.
  void cut_round(double a, double b, double c, bool is_sphere) {
    const double root = b * b - a * c;
    if (a == 0.0 ? c > 0.0 : root < 0.0) leave_ = -kNever;
    if (a == 0.0 || root < 0.0) return;
    const double distance = (-b - std::sqrt(root)) / a;
    leave_ = std::min(leave_, (-b + std::sqrt(root)) / a);
    if (!(distance > enter_)) return;
    enter_ = distance;
    normal_ = ray_.at(distance);
    if (!is_sphere) normal_.z() = 0.0;
    normal_.normalize();
  }
  RayEntry entry() const {
    if (!(enter_ >= 0.0 && enter_ <= leave_ && enter_ <= ray_.length)) return {};
    return {enter_, normal_};
  }

 private:
  const LocalRay& ray_;
  double enter_ = -kNever, leave_ = kNever;
  Vec3 normal_ = Vec3::UnitZ();
};

RayEntry enter_sphere(const LocalRay& ray, const Vec3& center, double radius) {
  const LocalRay moved{ray.from - center, ray.direction, ray.length};
  ConvexPassage inside(moved);
  inside.cut_round(ray.direction.squaredNorm(), moved.from.dot(ray.direction),
                   moved.from.squaredNorm() - radius * radius, true);
  return inside.entry();
}

RayEntry enter_cylinder(const LocalRay& ray, const CompiledShape& shape) {
  const Vec3 &o = ray.from, &d = ray.direction;
  ConvexPassage inside(ray);
  inside.cut_round(d.x() * d.x() + d.y() * d.y(), o.x() * d.x() + o.y() * d.y(),
                   o.x() * o.x() + o.y() * o.y() - shape.radius_m * shape.radius_m, false);
  inside.cut(Vec3::UnitZ(), shape.half_length_m);
  inside.cut(-Vec3::UnitZ(), shape.half_length_m);
  return inside.entry();
}

// Its caps are within the two balls, so the first of three entries counts: all from outside.
RayEntry enter_capsule(const LocalRay& ray, const CompiledShape& shape) {
  const double half = shape.half_length_m, at = std::clamp(ray.from.z(), -half, half);
  if ((ray.from - Vec3(0.0, 0.0, at)).squaredNorm() < shape.radius_m * shape.radius_m) return {};
  RayEntry first = enter_cylinder(ray, shape);
  for (const double end : {-half, half})
    first.keep_nearer(enter_sphere(ray, Vec3(0.0, 0.0, end), shape.radius_m));
  return first;
}

RayEntry enter_planes(const LocalRay& ray, const CompiledShape& shape) {
  ConvexPassage inside(ray);
  for (const FacePlane& plane : shape.face_planes) inside.cut(plane.normal, plane.offset_m);
  return inside.entry();
}

bool reaches(const LocalRay& ray, const Aabb& box) {
  double enter = 0.0, leave = ray.length;
  for (int i = 0; i < 3; ++i) {
    if (ray.direction[i] == 0.0) {
      if (ray.from[i] < box.min[i] || ray.from[i] > box.max[i]) return false;
      continue;
    }
    const double to_min = (box.min[i] - ray.from[i]) / ray.direction[i],
                 to_max = (box.max[i] - ray.from[i]) / ray.direction[i];
    enter = std::max(enter, std::min(to_min, to_max));
    leave = std::min(leave, std::max(to_min, to_max));
  }
  return enter <= leave;
}

// By the volumes of the tetrahedra that the ray makes with the edges (T. Moeller and B. Trumbore,
// "Fast, minimum storage ray-triangle intersection", 1997).
RayEntry enter_triangle(const LocalRay& ray, const MeshTriangle& triangle) {
  const Vec3 &a = triangle.corners_m[0], u = triangle.corners_m[1] - a,
             v = triangle.corners_m[2] - a;
  const Vec3 across = ray.direction.cross(v);
  const double volume = u.dot(across);
  if (!(volume > 0.0)) return {};  // along it, or from behind
  const Vec3 to_start = ray.from - a;
  const double along_u = to_start.dot(across);
  const Vec3 up = to_start.cross(u);
  const double along_v = ray.direction.dot(up);
  if (along_u < 0.0 || along_v < 0.0 || along_u + along_v > volume) return {};
  const double distance = v.dot(up) / volume;
  if (!(distance >= 0.0 && distance <= ray.length)) return {};
  return {distance, triangle.plane.normal};
}

RayEntry enter_mesh(const LocalRay& ray, const CompiledShape& shape) {
  RayEntry first;
  std::uint32_t nearest = kNone;
  shape.tree.visit(
      [&ray](const Aabb& box) { return reaches(ray, box); },
      [&](std::uint32_t i) {
        const RayEntry entry = enter_triangle(ray, shape.triangles[i]);
        if (entry.distance > first.distance || (entry.distance == first.distance && i > nearest))
          return;
        if (entry.distance == kNever) return;
        first = entry;
        nearest = i;
      });
  return first;
}

RayEntry enter(const LocalRay& ray, const CompiledShape& shape) {
  switch (shape.kind) {
    case ShapeKind::kSphere:
      return enter_sphere(ray, Vec3::Zero(), shape.radius_m);
    case ShapeKind::kCapsule:
      return enter_capsule(ray, shape);
    case ShapeKind::kCylinder:
      return enter_cylinder(ray, shape);
    case ShapeKind::kBox:
    case ShapeKind::kHull:
      return enter_planes(ray, shape);
    case ShapeKind::kMesh:
      return enter_mesh(ray, shape);
    case ShapeKind::kHalfSpace: {
      ConvexPassage inside(ray);
      inside.cut(shape.half_space.normal, shape.half_space.offset_m);
      return inside.entry();
    }
    case ShapeKind::kCompound:
      break;
  }
  RayEntry first;
  for (const CompiledPart& part : shape.parts) {
    RayEntry entry = enter(
        {part.pose.to_local(ray.from), part.pose.direction_to_local(ray.direction), ray.length},
        *part.solid);
    entry.normal = part.pose.rotation * entry.normal;
    first.keep_nearer(entry);
  }
  return first;
}

// Whether the ray passes within `radius` of a place.
bool passes(const Ray& ray, const Vec3& place, double radius) {
  const Vec3 to_place = place - ray.from_m;
  const double along = std::clamp(to_place.dot(ray.direction), 0.0, ray.length_m);
  return (to_place - ray.direction * along).squaredNorm() <= radius * radius;
}

void keep_first(const Ray& ray, BodyId id, const CompiledShape& shape, const Pose& pose,
                std::optional<RayHit>& hit) {
  const RayEntry entry = enter(
      {pose.to_local(ray.from_m), pose.direction_to_local(ray.direction), ray.length_m}, shape);
  if (entry.distance == kNever || (hit && !(entry.distance < hit->distance_m))) return;
  hit = RayHit{id, entry.distance, ray.from_m + ray.direction * entry.distance,
               pose.rotation * entry.normal};
}

}  // namespace

std::optional<RayHit> cast_ray(const SceneDescription& scene, const Geometry& geometry,
                               std::span<const BodyId> ids, std::span<const BodyState> states,
                               const Ray& ray) {
  std::optional<RayHit> hit;
  const GeometryImpl& impl = geometry.impl();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const CompiledShape& shape = shape_of(scene, geometry, ids[i]);
    if (passes(ray, states[i].position_m, shape.bounding_radius_m))
      keep_first(ray, ids[i], shape,
                 {states[i].orientation.toRotationMatrix(), states[i].position_m}, hit);
  }
  for (std::uint32_t i = 0; i < impl.statics.size(); ++i)
    keep_first(ray, static_id(i), impl.shapes[impl.statics[i].shape].shape, impl.statics[i].pose,
               hit);
  return hit;
}

}  // namespace soda::physics
