#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl/narrowphase/continuous_collision_result.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/forces/forces.hpp"
#include "physics/math/disjoint_sets.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// Whether the body spins at a constant rate, and nothing but gravity ever acts on it in flight.
bool flies_simply(const BodyParams& params) {
  return params.joints == 0 && !params.kinematic && !is_pushed(params) && !is_forced(params) &&
         is_isotropic(params.inertia_local_kg_m2);
}

// libfcl is compiled for baseline x86-64. Flags that change Eigen's alignment change these sizes
// and corrupt data silently.
static_assert(sizeof(fcl::CollisionObjectd) == 224 && alignof(fcl::CollisionObjectd) == 16);
static_assert(sizeof(fcl::ContinuousCollisionResultd) == 272);

constexpr double kCylinderSkin = 0.1;  // of the smaller of radius and half length

std::shared_ptr<fcl::CollisionGeometryd> make_convex(const CompiledShape& shape) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>(shape.vertices_m.begin(),
                                                               shape.vertices_m.end());
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& face : shape.faces) {
    faces->push_back(static_cast<int>(face.size()));
    for (const std::uint32_t v : face) faces->push_back(static_cast<int>(v));
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(shape.faces.size()), faces);
}

std::shared_ptr<fcl::CollisionGeometryd> make_fcl(const CompiledShape& shape) {
  const double r = shape.radius_m, length = 2.0 * shape.half_length_m;
  std::shared_ptr<fcl::CollisionGeometryd> out;
  switch (shape.kind) {
    case ShapeKind::kSphere:
      out = std::make_shared<fcl::Sphered>(r);
      break;
    case ShapeKind::kBox:
      out = std::make_shared<fcl::Boxd>(2.0 * shape.half_extents_m);
      break;
    case ShapeKind::kCapsule:
      out = std::make_shared<fcl::Capsuled>(r, length);
      break;
    case ShapeKind::kCylinder:
      out = std::make_shared<fcl::Cylinderd>(r, length);
      break;
    case ShapeKind::kHull:
      out = make_convex(shape);
      break;
    case ShapeKind::kMesh:
    case ShapeKind::kHalfSpace:
    case ShapeKind::kCompound:
      return nullptr;
  }
  out->computeLocalAABB();
  return out;
}

ShapeGeometry make_geometry(const Shape& shape, std::span<const Shape> shapes,
                            Narrowphase routine) {
  ShapeGeometry out;
  out.shape = compile(shape, shapes);
  if (routine == Narrowphase::kFcl) out.whole = make_fcl(out.shape);
  const double r = out.shape.radius_m;
  if (out.shape.kind == ShapeKind::kSphere || out.shape.kind == ShapeKind::kCapsule)
    out.core_skin_m = r;
  if (out.shape.kind == ShapeKind::kCylinder)
    out.core_skin_m = kCylinderSkin * std::min(r, out.shape.half_length_m);
  return out;
}

StaticGeometry place(const StaticBody& body, const ShapeGeometry& geometry) {
  StaticGeometry out;
  out.shape = body.shape;
  out.pose = {body.orientation.toRotationMatrix(), body.position_m};
  out.is_half_space = geometry.shape.kind == ShapeKind::kHalfSpace;
  if (out.is_half_space) {
    out.plane.normal = out.pose.rotation * geometry.shape.half_space.normal;
    out.plane.offset_m = geometry.shape.half_space.offset_m + out.plane.normal.dot(body.position_m);
  } else {
    out.box = tight_aabb(geometry.shape, out.pose);
  }
  return out;
}

std::vector<std::uint32_t> articulations_of(const SceneDescription& scene) {
  if (scene.joints.empty()) return {};
  std::vector<std::uint32_t> parent(scene.bodies.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (const Joint& joint : scene.joints) {
    if (joint.b == kWorldBody || can_break(joint)) continue;
    const std::uint32_t a = find_root(parent, index_of(joint.a)),
                        b = find_root(parent, index_of(joint.b));
    parent[std::max(a, b)] = std::min(a, b);
  }
  std::vector<std::uint32_t> articulations(scene.bodies.size(), kNone);
  for (std::uint32_t i = 0; i < articulations.size(); ++i)
    if (scene.bodies[i].joints > 0) articulations[i] = find_root(parent, i);
  return articulations;
}

std::shared_ptr<const GeometryImpl> build(const SceneDescription& scene) {
  auto impl = std::make_shared<GeometryImpl>();
  for (const Joint& joint : scene.joints) {
    if (joint.b == kWorldBody) continue;
    impl->joint_ends.push_back({joint.a, joint.anchor_a_m, joint.reach_m, joint.label});
    impl->joint_ends.push_back({joint.b, joint.anchor_b_m, joint.reach_m, joint.label});
  }
  std::stable_sort(impl->joint_ends.begin(), impl->joint_ends.end(),
                   [](const JointEnd& x, const JointEnd& y) { return x.body < y.body; });
  for (const Shape& shape : scene.shapes)
    impl->shapes.push_back(make_geometry(shape, scene.shapes, scene.narrowphase));
  for (const StaticBody& body : scene.statics) {
    impl->statics.push_back(place(body, impl->shapes[body.shape]));
    if (impl->statics.back().is_half_space)
      impl->floors.push_back(static_cast<std::uint32_t>(impl->statics.size() - 1));
  }
  for (const BodyParams& body : scene.bodies) {
    impl->body_shapes.push_back(body.shape);
    impl->flies_simply.push_back(flies_simply(body));
  }
  impl->articulations = articulations_of(scene);
  return impl;
}

bool reaches_half_space(const Aabb& box, const FacePlane& plane) {
  double lowest = 0.0;
  for (int i = 0; i < 3; ++i) {
    lowest += plane.normal[i] * (plane.normal[i] > 0.0 ? box.min[i] : box.max[i]);
  }
  return !(lowest > plane.offset_m);
}

}  // namespace

Geometry::Geometry(const SceneDescription& scene) : impl_(build(scene)) {}
Geometry::~Geometry() = default;
Geometry::Geometry(Geometry&&) noexcept = default;
Geometry& Geometry::operator=(Geometry&&) noexcept = default;

// So that the two bodies of a joint meet: the anchors, which are in one place, and what may be
// between them.
void cover_joints(const GeometryImpl& impl, double dt_s, BodyId id, const BodyState& state,
                  Aabb& box) {
  auto end = std::lower_bound(impl.joint_ends.begin(), impl.joint_ends.end(), id,
                              [](const JointEnd& e, BodyId body) { return e.body < body; });
  const double speed = state.linear_velocity_m_s.norm(),
               angular_speed = state.angular_velocity_rad_s.norm();
  for (; end != impl.joint_ends.end() && end->body == id; ++end) {
    if (std::ranges::binary_search(state.broken_joints, end->joint)) continue;
    const Vec3 arm = state.orientation * end->anchor_local_m;
    const Vec3 anchor = state.position_m + arm;
    const double reach =
        end->reach_m + (speed + std::min(angular_speed * dt_s, 2.0) / dt_s * arm.norm()) * dt_s;
    for (int i = 0; i < 3; ++i) {
      box.min[i] = std::min(box.min[i], anchor[i] - reach);
      box.max[i] = std::max(box.max[i], anchor[i] + reach);
    }
  }
}

namespace {

// As tight_aabb(), boxes in place: there are many.
inline Aabb tight_box(const CompiledShape& shape, const BodyState& state) {
  const Vec3& at = state.position_m;
  if (shape.kind == ShapeKind::kSphere) return tight_aabb(shape, {Mat3::Identity(), at});
  const Mat3 rotation = state.orientation.toRotationMatrix();
  if (shape.kind != ShapeKind::kBox) return tight_aabb(shape, {rotation, at});
  const double x = shape.half_extents_m.x(), y = shape.half_extents_m.y(),
               z = shape.half_extents_m.z();
  Vec3 half;
  for (int i = 0; i < 3; ++i)
    half[i] =
        std::abs(rotation(i, 0)) * x + std::abs(rotation(i, 1)) * y + std::abs(rotation(i, 2)) * z;
  return {at - half, at + half};
}

}  // namespace

Aabb swept_solid(const SceneDescription& scene, const Geometry& geometry, BodyId id,
                 const BodyState& now) {
  const SeenAhead ahead(scene, scene.dt_s, id, now);
  const BodyState& state = ahead.state();
  constexpr double kLargest = 1e300;
  const GeometryImpl& impl = geometry.impl();
  const CompiledShape& shape = impl.shapes[impl.body_shapes[index_of(id)]].shape;
  Aabb box = tight_box(shape, state);
  // Semi-implicit motion reaches v dt + g dt^2; every slower path to it lies in between.
  const Vec3 path = state.linear_velocity_m_s * scene.dt_s;
  const Vec3 end = path + field_of(scene, scene.bodies[index_of(id)]) * (scene.dt_s * scene.dt_s);
  double reach = kContactMargin * shape.min_extent_m;
  if (shape.kind != ShapeKind::kSphere) {
    // A point at distance R moves by at most |w| dt R, and never by more than 2 R.
    const double rotation = std::min(state.angular_velocity_rad_s.norm() * scene.dt_s, 2.0);
    reach += rotation * shape.bounding_radius_m;
  }
  const Vec3 unpushed = now.linear_velocity_m_s * scene.dt_s;
  for (int i = 0; i < 3; ++i) {
    const double low = std::min({0.0, path[i], end[i], unpushed[i]});
    const double high = std::max({0.0, path[i], end[i], unpushed[i]});
    box.min[i] = std::clamp(box.min[i] + low - reach, -kLargest, kLargest);
    box.max[i] = std::clamp(box.max[i] + high + reach, -kLargest, kLargest);
  }
  return box;
}

Aabb swept_aabb(const SceneDescription& scene, const Geometry& geometry, BodyId id,
                const BodyState& state) {
  Aabb box = swept_solid(scene, geometry, id, state);
  const GeometryImpl& impl = geometry.impl();
  if (!impl.joint_ends.empty()) cover_joints(impl, scene.dt_s, id, state, box);
  return box;
}

void find_static_pairs(const Geometry& geometry, std::span<const Aabb> boxes,
                       std::vector<IndexPair>& pairs, StageCounters& counters) {
  pairs.clear();
  const std::vector<StaticGeometry>& statics = geometry.impl().statics;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (std::uint32_t s = 0; s < statics.size(); ++s) {
      const bool near = statics[s].is_half_space ? reaches_half_space(boxes[i], statics[s].plane)
                                                 : overlap(boxes[i], statics[s].box);
      if (near) pairs.push_back({i, s});
    }
  }
  counters.candidate_pairs += pairs.size();
}

}  // namespace soda::physics
