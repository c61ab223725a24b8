#include "scenarios/shape_tables.hpp"

#include <array>

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"

namespace soda::scenarios {
namespace {

constexpr Limits kOffset{-kMaxLength_m, kMaxLength_m};

// Shapes.

constexpr Field kSphereFields[] = {
    field<SphereSpec, &SphereSpec::radius_m>("radius_m", kRequired, kLength, "Radius."),
};
constexpr ObjectTable kSphere = object_table<SphereSpec>("sphere", "A sphere.", kSphereFields);

constexpr Field kBoxFields[] = {
    field<BoxSpec, &BoxSpec::size_m>("size_m", kRequired, kLength,
                                     "Edge lengths along the local axes."),
};
constexpr ObjectTable kBox = object_table<BoxSpec>("box", "A box.", kBoxFields);

constexpr Field kCapsuleFields[] = {
    field<CapsuleSpec, &CapsuleSpec::radius_m>("radius_m", kRequired, kLength, "Radius."),
    field<CapsuleSpec, &CapsuleSpec::length_m>(
        "length_m", kRequired, kLength, "Length of the cylindrical part, without the two caps."),
};
constexpr ObjectTable kCapsule =
    object_table<CapsuleSpec>("capsule", "A capsule around the local z axis.", kCapsuleFields);

constexpr Field kCylinderFields[] = {
    field<CylinderSpec, &CylinderSpec::radius_m>("radius_m", kRequired, kLength, "Radius."),
    field<CylinderSpec, &CylinderSpec::length_m>("length_m", kRequired, kLength, "Length."),
};
constexpr ObjectTable kCylinder =
    object_table<CylinderSpec>("cylinder", "A cylinder around the local z axis.", kCylinderFields);

constexpr Field kHullFields[] = {
    field<HullSpec, &HullSpec::points_m>(
        "points_m", kRequired, list_of(4, 4096, -kMaxLength_m, kMaxLength_m),
        "Points whose convex hull is the shape, in a frame of their own choice."),
};
constexpr ObjectTable kHull = object_table<HullSpec>("hull", "A convex hull.", kHullFields);

constexpr std::string_view kMeshFileKeys[] = {"file"};
constexpr std::string_view kMeshInlineKeys[] = {"vertices_m", "triangles"};
constexpr Alternatives kMeshAlternatives{kMeshFileKeys, kMeshInlineKeys};
constexpr Field kMeshFields[] = {
    field<MeshSpec, &MeshSpec::file>(
        "file", kOptional, Limits{.min_items = 1, .max_items = 1000},
        "Mesh file (.obj or .stl); a relative path starts at the scenario's folder."),
    field<MeshSpec, &MeshSpec::unit_m>("unit_m", kOptional, Limits{1e-6, 1e6},
                                       "Length of one unit of the mesh's coordinates."),
    field<MeshSpec, &MeshSpec::vertices_m>(
        "vertices_m", kOptional, list_of(3, 1'000'000, -kMaxLength_m, kMaxLength_m), "Vertices."),
    field<MeshSpec, &MeshSpec::triangles>(
        "triangles", kOptional, list_of(1, 1'000'000, 0, 999'999),
        "Indices of three vertices each, counter-clockwise seen from outside."),
};
constexpr ObjectTable kMesh = object_table<MeshSpec>(
    "mesh", "A triangle mesh, hollow. Static only.", kMeshFields, &kMeshAlternatives);

constexpr Field kHalfSpaceFields[] = {
    field<HalfSpaceSpec, &HalfSpaceSpec::normal>("normal", kOptional, Limits{-1e6, 1e6},
                                                 "Outward normal, of any length but zero."),
    field<HalfSpaceSpec, &HalfSpaceSpec::offset_m>(
        "offset_m", kOptional, kPosition, "Distance of the surface from the origin along normal."),
};
constexpr ObjectTable kHalfSpace = object_table<HalfSpaceSpec>(
    "halfspace", "Everything below a plane. Static only.", kHalfSpaceFields);

// Those that may be parts of a compound, and others.
template <class Spec, std::size_t N>
constexpr std::array<ChoiceEntry, 5 + N> convex_and(const std::array<ChoiceEntry, N>& others) {
  std::array<ChoiceEntry, 5 + N> all{choice_entry<Spec, SphereSpec>("sphere", kSphere),
                                     choice_entry<Spec, BoxSpec>("box", kBox),
                                     choice_entry<Spec, CapsuleSpec>("capsule", kCapsule),
                                     choice_entry<Spec, CylinderSpec>("cylinder", kCylinder),
                                     choice_entry<Spec, HullSpec>("hull", kHull)};
  for (std::size_t i = 0; i < N; ++i) all[5 + i] = others[i];
  return all;
}

constexpr auto kConvexEntries = convex_and<ConvexShapeSpec>(std::array<ChoiceEntry, 0>{});
constexpr std::string_view kNoParts[] = {"compound", "mesh", "halfspace"};
constexpr ChoiceTable kConvexShape{.name = "convex-shape",
                                   .doc = "The shape of a compound's part.",
                                   .tag = "type",
                                   .entries = kConvexEntries,
                                   .elsewhere = kNoParts,
                                   .elsewhere_hint = "no part of a compound may have this shape"};

constexpr Field kPartFields[] = {
    choice_field<PartSpec, &PartSpec::shape>("shape", kRequired, kNone, kConvexShape, "Shape."),
    field<PartSpec, &PartSpec::position_m>("position_m", kOptional, kOffset,
                                           "Origin of the part's frame in the compound's."),
    choice_field<PartSpec, &PartSpec::orientation>("orientation", kOptional, kNone, kOrientation,
                                                   "Part to compound; not turned by default."),
};
constexpr ObjectTable kPart = object_table<PartSpec>("part", "A part of a compound.", kPartFields);
constexpr Field kCompoundFields[] = {
    object_field<CompoundSpec, &CompoundSpec::parts>(
        "parts", kRequired, list_of(1, physics::kMostParts), kPart,
        "Convex solids that hold together, in a frame of their own choice. They are filled evenly; "
        "where they overlap, mass counts twice."),
};
constexpr ObjectTable kCompound =
    object_table<CompoundSpec>("compound", "Several convex solids in one body.", kCompoundFields);

constexpr auto kSolidEntries = convex_and<SolidShapeSpec>(
    std::array{choice_entry<SolidShapeSpec, CompoundSpec>("compound", kCompound)});
constexpr std::string_view kStaticOnly[] = {"mesh", "halfspace"};
constexpr auto kStaticEntries = convex_and<StaticShapeSpec>(
    std::array{choice_entry<StaticShapeSpec, CompoundSpec>("compound", kCompound),
               choice_entry<StaticShapeSpec, MeshSpec>("mesh", kMesh),
               choice_entry<StaticShapeSpec, HalfSpaceSpec>("halfspace", kHalfSpace)});

// Orientations.

constexpr Limits kComponent{-1.001, 1.001};
constexpr Field kQuaternionFields[] = {
    field<QuaternionSpec, &QuaternionSpec::w>("w", kRequired, kComponent, "Real part."),
    field<QuaternionSpec, &QuaternionSpec::x>("x", kRequired, kComponent, "Part along x."),
    field<QuaternionSpec, &QuaternionSpec::y>("y", kRequired, kComponent, "Part along y."),
    field<QuaternionSpec, &QuaternionSpec::z>("z", kRequired, kComponent, "Part along z."),
};
constexpr ObjectTable kQuaternion = object_table<QuaternionSpec>(
    "quaternion", "A unit quaternion (norm within 0.001 of 1; normalised when read).",
    kQuaternionFields);

constexpr Field kAxisAngleFields[] = {
    field<AxisAngleSpec, &AxisAngleSpec::axis>("axis", kRequired, Limits{-1e6, 1e6},
                                               "Axis of rotation, of any length but zero."),
    field<AxisAngleSpec, &AxisAngleSpec::angle_deg>(
        "angle_deg", kRequired, Limits{-1e6, 1e6},
        "Angle, right-handed; whole turns count for nothing."),
};
constexpr ObjectTable kAxisAngle =
    object_table<AxisAngleSpec>("axis-angle", "A rotation about an axis.", kAxisAngleFields);

constexpr ChoiceEntry kOrientationEntries[] = {
    choice_entry<OrientationSpec, QuaternionSpec>("quaternion", kQuaternion),
    choice_entry<OrientationSpec, AxisAngleSpec>("axis-angle", kAxisAngle),
};
}  // namespace

constexpr ChoiceTable kSolidShape{.name = "solid-shape",
                                  .doc = "The shape of a moving body.",
                                  .tag = "type",
                                  .entries = kSolidEntries,
                                  .elsewhere = kStaticOnly,
                                  .elsewhere_hint = "only statics may have this shape"};

constexpr ChoiceTable kStaticShape{.name = "static-shape",
                                   .doc = "The shape of an immovable body.",
                                   .tag = "type",
                                   .entries = kStaticEntries,
                                   .elsewhere = {},
                                   .elsewhere_hint = {}};

constexpr ChoiceTable kOrientation{.name = "orientation",
                                   .doc = "Local to world.",
                                   .tag = {},
                                   .entries = kOrientationEntries,
                                   .elsewhere = {},
                                   .elsewhere_hint = {}};

}  // namespace soda::scenarios
