#include "physics/queries/overlaps.hpp"

#include "physics/narrowphase/near_triangles.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/narrowphase/triangle_solid.hpp"

namespace soda::physics {
namespace {

constexpr double kFarAway = 1e300;

// A scene of one shape: the probe's geometry is made as any other.
SceneDescription scene_of(const Probe& probe, Narrowphase narrowphase) {
  SceneDescription scene;
  scene.narrowphase = narrowphase;
  scene.shapes = {probe.shape};
  return scene;
}

Separation nearest_of(const Solid& probe, const Solid& other) {
  Vec3 guess = other.placed.pose.position - probe.placed.pose.position;
  if (!(guess.squaredNorm() > 0.0)) guess = Vec3::UnitZ();
  return separation_between(probe, other, guess);
}

Separation nearest_of_mesh(const Solid& probe, const Solid& mesh, double within_m) {
  Separation nearest{Vec3::UnitZ(), kFarAway};
  TriangleSolid triangle;
  for (const std::uint32_t i : near_triangles(probe.placed, mesh.placed, within_m)) {
    triangle.set(mesh.placed.shape.triangles[i], mesh.placed.pose);
    const Separation apart = nearest_of(probe, triangle.solid());
    if (apart.distance_m < nearest.distance_m) nearest = apart;
  }
  return nearest;
}

Separation nearest_of_parts(const GeometryImpl& impl, const Solid& probe, const Solid& other) {
  Separation nearest{Vec3::UnitZ(), kFarAway};
  for (std::uint32_t i = 0; i < part_count(other.placed.shape); ++i) {
    const Separation apart = nearest_of(probe, part_of(impl, other, i));
    if (apart.distance_m < nearest.distance_m) nearest = apart;
  }
  return nearest;
}

}  // namespace

std::vector<Neighbour> find_neighbours(const SceneDescription& scene, const Geometry& geometry,
                                       std::span<const BodyId> ids,
                                       std::span<const BodyState> states, const Probe& probe) {
  const Geometry own(scene_of(probe, scene.narrowphase));
  const GeometryImpl& impl = geometry.impl();
  const ShapeGeometry& shape = own.impl().shapes.front();
  // Coordinates are relative to the probe, as those of a pair are to its first body.
  const Solid solid{shape, {shape.shape, {probe.orientation.toRotationMatrix(), Vec3::Zero()}}};
  std::vector<Neighbour> found;
  const auto look_at = [&](BodyId id, const ShapeGeometry& other, const Mat3& rotation,
                           const Vec3& position_m) {
    const Solid there{other, {other.shape, {rotation, position_m - probe.position_m}}};
    const Separation apart = other.shape.kind == ShapeKind::kMesh
                                 ? nearest_of_mesh(solid, there, probe.within_m)
                                 : nearest_of_parts(impl, solid, there);
    if (apart.distance_m <= probe.within_m) found.push_back({id, apart.distance_m, apart.normal});
  };
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const ShapeGeometry& other = impl.shapes[scene.bodies[index_of(ids[i])].shape];
    const double reach =
        shape.shape.bounding_radius_m + other.shape.bounding_radius_m + probe.within_m;
    if ((states[i].position_m - probe.position_m).squaredNorm() <= reach * reach)
      look_at(ids[i], other, states[i].orientation.toRotationMatrix(), states[i].position_m);
  }
  for (std::uint32_t i = 0; i < impl.statics.size(); ++i) {
    const StaticGeometry& fixed = impl.statics[i];
    look_at(static_id(i), impl.shapes[fixed.shape], fixed.pose.rotation, fixed.pose.position);
  }
  return found;
}

}  // namespace soda::physics
