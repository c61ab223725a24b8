#include "scenarios/format.hpp"

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"
#include "scenarios/input_tables.hpp"
#include "scenarios/joint_tables.hpp"
#include "scenarios/reference_tables.hpp"
#include "scenarios/run_tables.hpp"
#include "scenarios/shape_tables.hpp"

namespace soda::scenarios {

template <>
inline constexpr std::array kNamesOf<Axis> = std::to_array<std::string_view>({"x", "y", "z"});

namespace {

// Bodies, statics, materials.

constexpr Field kMaterialFields[] = {
    field<MaterialSpec, &MaterialSpec::name>("name", kRequired, kLabel,
                                             "By which bodies refer to it; unique."),
    field<MaterialSpec, &MaterialSpec::friction>(
        "friction", kRequired, Limits{0.0, 100.0},
        "Coulomb coefficient; a pair takes the geometric mean."),
    field<MaterialSpec, &MaterialSpec::restitution>(
        "restitution", kRequired, kUnitInterval,
        "Relative speed after over before an impact; a pair takes the maximum."),
    field<MaterialSpec, &MaterialSpec::rolling_friction_m>(
        "rolling_friction_m", kOptional, Limits{0.0, 1e5},
        "The most that a contact turns a rolling body back, over the force on it; a pair takes the "
        "larger one. A ball stays on slopes up to this over its radius."),
    field<MaterialSpec, &MaterialSpec::torsional_friction_m>(
        "torsional_friction_m", kOptional, Limits{0.0, 1e5},
        "The same about the contact's normal, of what spins on the spot."),
};
constexpr ObjectTable kMaterial =
    object_table<MaterialSpec>("material", "A surface.", kMaterialFields);

constexpr std::string_view kFreeKeys[] = {"velocity_m_s"};
constexpr std::string_view kLaneKeys[] = {"way_points_m", "speed_m_s", "half_width_m"};
constexpr Alternatives kDriveAlternatives{kFreeKeys, kLaneKeys};
constexpr Field kDriveFields[] = {
    field<DriveSpec, &DriveSpec::name>("name", kRequired, kLabel,
                                       "By which bodies refer to it; unique."),
    field<DriveSpec, &DriveSpec::velocity_m_s>("velocity_m_s", kOptional, kSpeed,
                                               "Wanted velocity; or give a lane."),
    field<DriveSpec, &DriveSpec::way_points_m>(
        "way_points_m", kOptional, list_of(2, 1000, -kMaxPosition_m, kMaxPosition_m),
        "Lane: bodies go along its nearest segment, as seen along gravity. Its first and last "
        "segment go on without end."),
    field<DriveSpec, &DriveSpec::speed_m_s>("speed_m_s", kOptional, Limits{0.0, 1e6},
                                            "Wanted speed along the lane."),
    field<DriveSpec, &DriveSpec::half_width_m>("half_width_m", kOptional, kLength,
                                               "Half the width of the lane; bodies outside are "
                                               "steered back, by 45 degrees at twice this."),
    field<DriveSpec, &DriveSpec::time_constant_s>(
        "time_constant_s", kRequired, Limits{1e-3, 1e6},
        "Time in which a difference to the wanted velocity falls to 1/e."),
    field<DriveSpec, &DriveSpec::max_acceleration_m_s2>(
        "max_acceleration_m_s2", kRequired, Limits{0.0, 1e6}, "Greatest push, over the mass."),
};
constexpr ObjectTable kDrive = object_table<DriveSpec>(
    "drive", "What pushes bodies towards a wanted velocity, in the plane orthogonal to gravity.",
    kDriveFields, &kDriveAlternatives);

constexpr std::string_view kGroupDoc =
    "Collision group, by a name of your own; ignored_collisions says which groups pass through "
    "each other.";
constexpr Field kIgnoredCollisionFields[] = {
    field<IgnoredCollisionSpec, &IgnoredCollisionSpec::group>("group", kRequired, kLabel,
                                                              "A group of bodies or statics."),
    field<IgnoredCollisionSpec, &IgnoredCollisionSpec::with>(
        "with", kRequired, kLabel, "Another, or the same: its members pass through each other."),
};
constexpr ObjectTable kIgnoredCollision = object_table<IgnoredCollisionSpec>(
    "ignored collision", "Two collision groups whose members do not touch.",
    kIgnoredCollisionFields);

constexpr std::string_view kMassKeys[] = {"mass_kg"};
constexpr std::string_view kDensityKeys[] = {"density_kg_m3"};
constexpr Alternatives kMassAlternatives{kMassKeys, kDensityKeys};
constexpr Limits kPush{-1e15, 1e15};
constexpr Limits kDamping{0.0, 1e6};

template <class T>
constexpr std::array<Field, 13> solid_fields() {
  return {
      choice_field<T, &T::shape>("shape", kRequired, kNone, kSolidShape, "Shape."),
      field<T, &T::mass_kg>("mass_kg", kOptional, Limits{kMinMass_kg, kMaxMass_kg},
                            "Mass; or give density_kg_m3."),
      field<T, &T::density_kg_m3>("density_kg_m3", kOptional, Limits{1e-9, 1e9},
                                  "Density; or give mass_kg. The mass it makes must be allowed."),
      field<T, &T::principal_inertia_kg_m2>(
          "principal_inertia_kg_m2", kOptional, Limits{1e-15, 1e15},
          "Moments of inertia about the axes of the body's frame, through its centre of mass; by "
          "default those of its shape, filled evenly."),
      field<T, &T::center_of_mass_m>(
          "center_of_mass_m", kOptional, Limits{-kMaxLength_m, kMaxLength_m},
          "Centre of mass in the shape's frame; by default that of the shape, filled evenly. The "
          "body still turns as if its mass were spread like that, but about this point."),
      field<T, &T::material>("material", kRequired, kLabel, "Name of a material."),
      field<T, &T::collision_group>("collision_group", kOptional, kLabel, kGroupDoc),
      field<T, &T::drive>("drive", kOptional, kLabel, "Name of a drive; none by default."),
      field<T, &T::force_newton>("force_newton", kOptional, kPush,
                                 "Constant force at the centre of mass, world frame."),
      field<T, &T::body_force_newton>("body_force_newton", kOptional, kPush,
                                      "The same in the body's frame, as of a thruster."),
      field<T, &T::torque_newton_m>("torque_newton_m", kOptional, kPush,
                                    "Constant torque, world frame."),
      field<T, &T::linear_damping_1_s>("linear_damping_1_s", kOptional, kDamping,
                                       "Rate at which its momentum decays."),
      field<T, &T::angular_damping_1_s>("angular_damping_1_s", kOptional, kDamping,
                                        "Rate at which its angular momentum decays."),
  };
}

template <class T>
constexpr std::array<Field, 4> motion_fields(std::string_view position_doc) {
  return {
      field<T, &T::position_m>("position_m", kRequired, kPosition, position_doc),
      choice_field<T, &T::orientation>("orientation", kOptional, kNone, kOrientation,
                                       "Orientation; not turned by default."),
      field<T, &T::velocity_m_s>("velocity_m_s", kOptional, kSpeed,
                                 "Velocity of the centre of mass."),
      field<T, &T::angular_velocity_rad_s>("angular_velocity_rad_s", kOptional, kSpeed,
                                           "Angular velocity, world frame."),
  };
}

template <std::size_t... N>
constexpr auto concat(const std::array<Field, N>&... parts) {
  std::array<Field, (N + ...)> all{};
  std::size_t at = 0;
  const auto append = [&](const auto& part) {
    for (const Field& f : part) all[at++] = f;
  };
  (append(parts), ...);
  return all;
}

constexpr Field kWayPointFields[] = {
    field<WayPointSpec, &WayPointSpec::time_s>("time_s", kRequired, Limits{0.0, 1e9},
                                               "When it is there: a whole number of steps."),
    field<WayPointSpec, &WayPointSpec::position_m>("position_m", kRequired, kPosition,
                                                   "Where; as position_m of the body."),
    choice_field<WayPointSpec, &WayPointSpec::orientation>(
        "orientation", kOptional, kNone, kOrientation,
        "Orientation; that of the way point before by default. It turns the shorter way round."),
};
constexpr ObjectTable kWayPoint =
    object_table<WayPointSpec>("way point", "A pose of a kinematic body.", kWayPointFields);

constexpr Alternatives kBodyMassAlternatives{kMassKeys, kDensityKeys, "kinematic"};
constexpr auto kBodyFields = concat(
    std::array{field<BodySpec, &BodySpec::id>(
        "id", kRequired, kId, "Identity, unique over bodies and generators; orders the bodies.")},
    solid_fields<BodySpec>(),
    motion_fields<BodySpec>(
        "Origin of the shape's frame: the centre of mass, but for hulls, compounds and bodies with "
        "center_of_mass_m."),
    std::array{field<BodySpec, &BodySpec::present>(
        "present", kOptional, kNone, "false: it takes part only when an input has added it.")},
    std::array{
        field<BodySpec, &BodySpec::kinematic>(
            "kinematic", kOptional, kNone,
            "true: it moves by its velocities alone, whatever it meets: a lift, a pusher. No mass, "
            "drive, force, damping or joint then. It touches no static and no other of its kind."),
        object_field<BodySpec, &BodySpec::path>(
            "path", kOptional, list_of(2, 10'000), kWayPoint,
            "Where a kinematic body comes by, at constant velocities in between; the first way "
            "point is where it starts, at 0 s. It stands still after the last.")});
constexpr ObjectTable kBody =
    object_table<BodySpec>("body", "A moving body.", kBodyFields, &kBodyMassAlternatives);

constexpr Field kStaticFields[] = {
    field<StaticSpec, &StaticSpec::name>("name", kRequired, kLabel, "Unique among the statics."),
    choice_field<StaticSpec, &StaticSpec::shape>("shape", kRequired, kNone, kStaticShape, "Shape."),
    field<StaticSpec, &StaticSpec::material>("material", kRequired, kLabel, "Name of a material."),
    field<StaticSpec, &StaticSpec::collision_group>("collision_group", kOptional, kLabel,
                                                    kGroupDoc),
    field<StaticSpec, &StaticSpec::position_m>("position_m", kOptional, kPosition,
                                               "Origin of the shape's frame."),
    choice_field<StaticSpec, &StaticSpec::orientation>(
        "orientation", kOptional, kNone, kOrientation, "Orientation; not turned by default."),
    field<StaticSpec, &StaticSpec::surface_velocity_m_s>(
        "surface_velocity_m_s", kOptional, kSpeed,
        "Velocity of the surface, as of a conveyor belt, in the static's frame: it turns with the "
        "orientation. Friction carries along what lies on it."),
};
constexpr ObjectTable kStatic =
    object_table<StaticSpec>("static", "An immovable body.", kStaticFields);

// Generators.

template <class T>
constexpr auto generator_fields() {
  return concat(std::array{field<T, &T::first_id>("first_id", kRequired, kId,
                                                  "Id of the first body; the others count up.")},
                solid_fields<T>());
}

constexpr auto kGridFields = concat(
    generator_fields<GridSpec>(),
    std::array{field<GridSpec, &GridSpec::count>("count", kRequired, kCount,
                                                 "Bodies along x, y, z; ids run along x first."),
               field<GridSpec, &GridSpec::spacing_m>(
                   "spacing_m", kRequired, Limits{0.0, kMaxPosition_m},
                   "Distance of neighbouring centres along x, y, z; may be 0.")},
    motion_fields<GridSpec>("Centre of mass of the first body."));
constexpr ObjectTable kGrid =
    object_table<GridSpec>("grid", "Bodies on a lattice.", kGridFields, &kMassAlternatives);

constexpr auto kStackFields = concat(
    generator_fields<StackSpec>(),
    std::array{field<StackSpec, &StackSpec::count>("count", kRequired, kCount, "Bodies, upwards."),
               field<StackSpec, &StackSpec::gap_m>(
                   "gap_m", kOptional, kGap, "Vertical gap; 0 lets them touch, < 0 overlap.")},
    motion_fields<StackSpec>("Centre of mass of the lowest body."));
constexpr ObjectTable kStack = object_table<StackSpec>(
    "stack", "Bodies on top of each other along z.", kStackFields, &kMassAlternatives);

constexpr auto kPyramidFields = concat(
    generator_fields<PyramidSpec>(),
    std::array{
        field<PyramidSpec, &PyramidSpec::rows>(
            "rows", kRequired, Limits{1.0, 1000.0},
            "Rows; the lowest has as many bodies. Ids run along x, then upwards."),
        field<PyramidSpec, &PyramidSpec::side_gap_m>("side_gap_m", kOptional, kGap,
                                                     "Gap between neighbours of a row."),
        field<PyramidSpec, &PyramidSpec::gap_m>("gap_m", kOptional, kGap, "Gap between rows.")},
    motion_fields<PyramidSpec>("Centre of mass of the first body of the lowest row."));
constexpr ObjectTable kPyramid =
    object_table<PyramidSpec>("pyramid", "A wall in the x-z plane whose rows shorten by one.",
                              kPyramidFields, &kMassAlternatives);

constexpr auto kChainFields =
    concat(generator_fields<ChainSpec>(),
           std::array{field<ChainSpec, &ChainSpec::count>("count", kRequired, kCount, "Bodies."),
                      field<ChainSpec, &ChainSpec::axis>("axis", kRequired, kNone,
                                                         "Direction in which the chain runs."),
                      field<ChainSpec, &ChainSpec::gap_m>("gap_m", kOptional, kGap,
                                                          "Gap; 0 lets them touch, < 0 overlap.")},
           motion_fields<ChainSpec>("Centre of mass of the first body."));
constexpr ObjectTable kChain = object_table<ChainSpec>(
    "chain", "Bodies in a row, each touching the next.", kChainFields, &kMassAlternatives);

template <class T>
constexpr auto scatter_fields() {
  return concat(
      generator_fields<T>(),
      std::array{
          field<T, &T::count>("count", kRequired, kCount, "Bodies."),
          field<T, &T::region_min_m>("region_min_m", kRequired, kPosition,
                                     "Least corner of the box in which the centres lie."),
          field<T, &T::region_max_m>("region_max_m", kRequired, kPosition, "Greatest corner."),
          field<T, &T::min_gap_m>("min_gap_m", kOptional, Limits{0.0, 1e5},
                                  "Least gap between bounding spheres."),
          field<T, &T::random_orientation>("random_orientation", kOptional, kNone,
                                           "Turned at random (uniformly), or not at all."),
          field<T, &T::seed>("seed", kRequired, kSeed, "Seed of the placement."),
      });
}

constexpr auto kRandomFields = scatter_fields<RandomSpec>();
constexpr ObjectTable kRandom = object_table<RandomSpec>(
    "random",
    "Bodies at rest at random places. Their bounding spheres overlap neither each other nor those "
    "of bodies further up in the file.",
    kRandomFields, &kMassAlternatives);

constexpr auto kGasFields = concat(
    scatter_fields<GasSpec>(),
    std::array{field<GasSpec, &GasSpec::max_speed_m_s>(
                   "max_speed_m_s", kRequired, Limits{0.0, 1e6},
                   "Velocities are uniform in the ball of this radius."),
               field<GasSpec, &GasSpec::max_spin_rad_s>(
                   "max_spin_rad_s", kOptional, Limits{0.0, 1e6}, "Angular velocities likewise.")});
constexpr ObjectTable kGas = object_table<GasSpec>("gas", "Like random, with random velocities.",
                                                   kGasFields, &kMassAlternatives);

constexpr ChoiceEntry kGeneratorEntries[] = {
    choice_entry<GeneratorSpec, GridSpec>("grid", kGrid),
    choice_entry<GeneratorSpec, StackSpec>("stack", kStack),
    choice_entry<GeneratorSpec, PyramidSpec>("pyramid", kPyramid),
    choice_entry<GeneratorSpec, ChainSpec>("chain", kChain),
    choice_entry<GeneratorSpec, RandomSpec>("random", kRandom),
    choice_entry<GeneratorSpec, GasSpec>("gas", kGas),
};
constexpr ChoiceTable kGenerator{.name = "generator",
                                 .doc = "A rule that makes many bodies of one shape.",
                                 .tag = "type",
                                 .entries = kGeneratorEntries,
                                 .elsewhere = {},
                                 .elsewhere_hint = {}};

// The file.

constexpr std::string_view kDurationKeys[] = {"duration_s"};
constexpr std::string_view kStepsKeys[] = {"steps"};
constexpr Alternatives kDurationAlternatives{kDurationKeys, kStepsKeys};
constexpr Field kDocumentFields[] = {
    field<DocumentSpec, &DocumentSpec::schema>("$schema", kOptional, kText,
                                               "For editors; not looked at."),
    field<DocumentSpec, &DocumentSpec::format>(
        "format", kRequired, Limits{double(kFormatVersion), double(kFormatVersion)},
        "Version of the format."),
    field<DocumentSpec, &DocumentSpec::name>(
        "name", kOptional, Limits{.min_items = 0, .max_items = 200},
        "Name of the scenario; if empty or absent, the file's name without folder and ending."),
    field<DocumentSpec, &DocumentSpec::description>("description", kOptional, kText,
                                                    "What the scene shows."),
    field<DocumentSpec, &DocumentSpec::gravity_m_s2>("gravity_m_s2", kRequired, kSpeed,
                                                     "Gravity; z points up in the library."),
    field<DocumentSpec, &DocumentSpec::time_step_s>("time_step_s", kRequired, Limits{1e-6, 1.0},
                                                    "Length of a step."),
    field<DocumentSpec, &DocumentSpec::duration_s>(
        "duration_s", kOptional, Limits{0.0, 1e9},
        "Length of the run: a whole number of steps, within a relative 1e-9; or give steps."),
    field<DocumentSpec, &DocumentSpec::steps>("steps", kOptional, Limits{0.0, double{kMaxSteps}},
                                              "Length of the run; or give duration_s."),
    object_field<DocumentSpec, &DocumentSpec::solver>("solver", kOptional, kNone, kSolver,
                                                      "Settings of the contact solver."),
    object_field<DocumentSpec, &DocumentSpec::accuracy>(
        "accuracy", kOptional, kNone, kAccuracy,
        "Accuracy mode; without it, one step of the contact solver a step, for all but single "
        "bodies."),
    object_field<DocumentSpec, &DocumentSpec::materials>("materials", kOptional, list_of(0, 10'000),
                                                         kMaterial, "Surfaces."),
    object_field<DocumentSpec, &DocumentSpec::drives>("drives", kOptional, list_of(0, 10'000),
                                                      kDrive, "What pushes bodies."),
    object_field<DocumentSpec, &DocumentSpec::ignored_collisions>(
        "ignored_collisions", kOptional, list_of(0, 10'000), kIgnoredCollision,
        "Which collision groups pass through each other; all others touch."),
    object_field<DocumentSpec, &DocumentSpec::bodies>("bodies", kOptional, list_of(0, kMaxBodies),
                                                      kBody, "Moving bodies, one by one."),
    object_field<DocumentSpec, &DocumentSpec::statics>("statics", kOptional, list_of(0, 100'000),
                                                       kStatic, "Immovable environment."),
    choice_field<DocumentSpec, &DocumentSpec::generators>(
        "generators", kOptional, list_of(0, 10'000), kGenerator,
        "Moving bodies by rule, in this order; at most 1,000,000 bodies in all."),
    choice_field<DocumentSpec, &DocumentSpec::joints>(
        "joints", kOptional, list_of(0, 1'000'000), kJoint,
        "What holds bodies together, or to the world."),
    choice_field<DocumentSpec, &DocumentSpec::inputs>("inputs", kOptional, list_of(0, 1'000'000),
                                                      kInput,
                                                      "What a user does to bodies, in any order."),
    choice_field<DocumentSpec, &DocumentSpec::references>(
        "references", kOptional, list_of(0, 100), kReference,
        "What is known of the run beforehand; soda accuracy compares it."),
    object_field<DocumentSpec, &DocumentSpec::territory>(
        "territory", kOptional, kNone, kTerritory,
        "Division of space; one cell and one world by default."),
    field<DocumentSpec, &DocumentSpec::buffer_entries>(
        "buffer_entries", kOptional, Limits{1.0, double{kMaxBufferEntries}},
        "Steps a world may run ahead: the size of its transform buffer."),
    object_field<DocumentSpec, &DocumentSpec::executor>(
        "executor", kOptional, kNone, kExecutor, "Default executor; the command line may differ."),
    object_field<DocumentSpec, &DocumentSpec::balancing>(
        "balancing", kOptional, kNone, kBalancing,
        "Load balancing, off without it; the command line may differ."),
    object_field<DocumentSpec, &DocumentSpec::output>("output", kOptional, kNone, kOutput,
                                                      "What a run writes beside its report."),
};
constexpr ObjectTable kDocument = object_table<DocumentSpec>(
    "scenario", "A SODA scenario.", kDocumentFields, &kDurationAlternatives);

}  // namespace

const ObjectTable& document_table() { return kDocument; }

}  // namespace soda::scenarios
