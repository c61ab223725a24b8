// What does not change during a run: shapes, materials, bodies' parameters, static environment.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "physics/model/ids.hpp"
#include "physics/model/joint.hpp"

namespace soda::physics {

struct Material {
  double friction = 0.5;     // Coulomb coefficient, >= 0; a pair takes the geometric mean
  double restitution = 0.0;  // in [0, 1]; a pair takes the maximum
  // The most that a contact turns bodies back as they roll (about axes in its plane) and as they
  // rotate (about its normal), over its force: N m / N, >= 0. A pair takes the larger ones.
  double rolling_friction_m = 0.0, torsional_friction_m = 0.0;
};

// Shapes are given in a local frame whose origin is the centre of mass.
struct Sphere {
  double radius_m = 0.5;
};
struct Box {
  Vec3 half_extents_m = Vec3(0.5, 0.5, 0.5);
};
struct Capsule {  // around the local z axis
  double radius_m = 0.5;
  double length_m = 1.0;  // of the cylindrical part
};
struct Cylinder {  // around the local z axis
  double radius_m = 0.5;
  double length_m = 1.0;
};
struct ConvexHull {  // made by make_convex_hull (mass_properties.hpp)
  std::vector<Vec3> vertices_m;
  // Each face: vertex indices in order, counter-clockwise seen from outside.
  std::vector<std::vector<std::uint32_t>> faces;
};
struct TriangleMesh {  // static only; hollow, triangles counter-clockwise seen from outside
  std::vector<Vec3> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
struct HalfSpace {  // static only; solid where normal . x <= offset, in the static's frame
  Vec3 normal = Vec3::UnitZ();
  double offset_m = 0.0;
};
// A convex solid of a body that has several: its pose in the body's frame.
struct CompoundPart {
  std::uint32_t shape = 0;  // index into SceneDescription::shapes, of a solid
  Vec3 position_m = Vec3::Zero();
  Quat orientation = Quat::Identity();
};
inline constexpr std::size_t kMostParts = 64;
struct Compound {
  std::vector<CompoundPart> parts;  // 1 .. kMostParts
};
using Shape =
    std::variant<Sphere, Box, Capsule, Cylinder, ConvexHull, TriangleMesh, HalfSpace, Compound>;

// A street along which bodies are driven. Heights do not count: all of it is seen along gravity.
// The first and the last segment go on without end.
struct Lane {
  std::vector<Vec3> way_points_m;  // >= 2; neighbours differ when seen along gravity
  double half_width_m = 1.0;       // > 0; beyond it, bodies are steered back
  double speed_m_s = 1.0;          // >= 0
};

// Legs or a motor: pushes a body in the plane orthogonal to gravity towards a wanted velocity, with
// m (wanted - v) / time constant, but at most m * max_acceleration.
struct Drive {
  double time_constant_s = 0.5;        // > 0
  double max_acceleration_m_s2 = 5.0;  // >= 0
  Vec3 velocity_m_s = Vec3::Zero();    // wanted, where there is no lane
  std::optional<Lane> lane;
};

// What pushes a body as it turns and moves: a thruster, a torque, damping. Forces act at its centre
// of mass.
struct BodyForces {
  Vec3 body_force_newton = Vec3::Zero();  // in the body's frame: a thruster
  Vec3 torque_newton_m = Vec3::Zero();    // world frame
  // The rates, >= 0, at which momentum and angular momentum decay: p' = -c p, L' = -c L.
  double linear_damping_1_s = 0.0, angular_damping_1_s = 0.0;

  bool operator==(const BodyForces&) const = default;
};

// Of the indices of a body's drive and forces.
inline constexpr std::uint32_t kNone = 0xffffffffu;
inline constexpr std::uint32_t kNoDrive = kNone;

// Groups of bodies and statics that pass through each other: a bit for each group. Two touch unless
// one is in a group that the other ignores.
struct CollisionFilter {
  std::uint64_t groups = 0, ignored_groups = 0;
};

// A dynamic body's constants.
struct BodyParams {
  std::uint32_t label = 0;         // the id by which the user knows the body; ascending with BodyId
  std::uint32_t shape = 0;         // index into SceneDescription::shapes
  std::uint32_t drive = kNoDrive;  // index into SceneDescription::drives
  std::uint32_t forces = kNone;    // index into SceneDescription::forces
  // That it has, and those of them that can not break; see order_joints().
  std::uint32_t joints = 0, lasting_joints = 0;
  // It moves as its velocities say, whatever it meets: nothing but an input changes them. Its mass
  // and inertia have no effect.
  bool kinematic = false;
  CollisionFilter filter;
  Material material;
  double mass_kg = 1.0;
  Vec3 own_field_m_s2 = Vec3::Zero();  // a constant force over its mass: acts as gravity does
  Mat3 inertia_local_kg_m2 = Mat3::Identity();  // about the centre of mass
  Mat3 inverse_inertia_local = Mat3::Identity();
};

// Immovable environment. Never part of an island.
struct StaticBody {
  std::string name;
  std::uint32_t shape = 0;
  Material material;
  Vec3 position_m = Vec3::Zero();
  Quat orientation = Quat::Identity();
  // Velocity of the surface, as of a conveyor belt: friction drives what lies on it towards this.
  // Its part along a contact's normal has no effect.
  Vec3 surface_velocity_m_s = Vec3::Zero();
  CollisionFilter filter;
};

enum class Broadphase { kGrid, kAllPairs };  // kAllPairs: the paper's Figure 8 experiment

// Whose routines say along which direction two solids meet that are neither halfspaces nor meshes.
// kAuto: FCL's for two boxes, own ones for all others. kFcl: FCL's for all. kOwn: own ones for all.
// Contact points, halfspaces, meshes and times of impact are own work for each.
enum class Narrowphase { kAuto, kFcl, kOwn };

// Settings of the contact solver. Lengths are relative to body size, see README.
struct SolverSettings {
  int iterations = 30;                      // 1 .. 1000
  double restitution_threshold_m_s = 0.05;  // slower impacts do not bounce, >= 0
  double push_out_1_s = 2.0;                // most widths that overlaps are pushed out by, > 0
  bool contact_response = true;             // false: detection only, bodies pass through each other
  bool warm_starting = true;
  bool direct = true;   // Newton's method for the islands that it pays for; false: for none
  bool rest = true;     // what does not move is left as it is (sleeping.hpp); false: all is solved
  bool refined = true;  // islands get several parts unasked where one is far off (refinement.hpp),
                        // and blows more work than iterations take (blows.hpp)
};

// Everything constant that a step needs.
struct SceneDescription {
  Vec3 gravity_m_s2 = Vec3::Zero();
  double dt_s = 1.0 / 60.0;
  Broadphase broadphase = Broadphase::kGrid;
  Narrowphase narrowphase = Narrowphase::kAuto;
  SolverSettings solver;
  // Accuracy mode: largest error of each island in a step, of its bodies' widths; islands take as
  // many substeps as it needs, and say what error is left. 0: only single bodies are treated so, to
  // 1e-7 in each part of a step, and nothing is said.
  double tolerance = 0.0;
  std::vector<Shape> shapes;
  std::vector<Drive> drives;
  std::vector<BodyForces> forces;
  std::vector<BodyParams> bodies;   // index == BodyId
  std::vector<StaticBody> statics;  // index == static_index_of(BodyId)
  std::vector<Joint> joints;        // ascending by (a, b, label): see order_joints()
  bool has_world_joints = false;
};

// Of a body or a static.
inline const Material& material_of(const SceneDescription& scene, BodyId id) {
  return is_static(id) ? scene.statics[static_index_of(id)].material
                       : scene.bodies[index_of(id)].material;
}

inline const CollisionFilter& filter_of(const SceneDescription& scene, BodyId id) {
  return is_static(id) ? scene.statics[static_index_of(id)].filter
                       : scene.bodies[index_of(id)].filter;
}

// Whether their groups let them touch; the world of joints has none.
inline bool groups_touch(const SceneDescription& scene, BodyId a, BodyId b) {
  const CollisionFilter &x = filter_of(scene, a), &y = filter_of(scene, b);
  return (x.groups & y.ignored_groups) == 0 && (y.groups & x.ignored_groups) == 0;
}

// Whether anything but gravity and a constant force acts on the body.
inline bool is_pushed(const BodyParams& body) { return (body.drive & body.forces) != kNone; }

// Whether anything that a user calls a force, a torque or damping acts on it.
inline bool is_forced(const BodyParams& body) {
  return body.forces != kNone || body.own_field_m_s2 != Vec3::Zero();
}

// The acceleration of a body that nothing pushes or touches: by gravity, and a constant force.
inline Vec3 field_of(const SceneDescription& scene, const BodyParams& body) {
  return scene.gravity_m_s2 + body.own_field_m_s2;
}

}  // namespace soda::physics
