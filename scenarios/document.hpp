// What a scenario file says, key by key, before anything is looked up, computed or generated.
// Member initialisers are the defaults of the format; its tables (format.cpp) read them from here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/options/run_options.hpp"
#include "models/territory/territory.hpp"
#include "physics/model/scene.hpp"
#include "scenarios/json_tree.hpp"
#include "scenarios/known_answer.hpp"
#include "scenarios/quality.hpp"

namespace soda::scenarios {

using physics::Vec3;
using IntVec3 = std::array<std::int64_t, 3>;

// Every object of a file: where it stands, and whether it has no fault inside. The values of an
// unsound object are defaults where the file's were faulty.
struct Located {
  const JsonValue* json = nullptr;
  bool sound = false;
};

struct SphereSpec : Located {
  double radius_m = 0.0;
};
struct BoxSpec : Located {
  Vec3 size_m = Vec3::Zero();
};
struct CapsuleSpec : Located {
  double radius_m = 0.0, length_m = 0.0;
};
struct CylinderSpec : Located {
  double radius_m = 0.0, length_m = 0.0;
};
struct HullSpec : Located {
  std::vector<Vec3> points_m;
};
struct MeshSpec : Located {
  std::optional<std::string> file;
  double unit_m = 1.0;
  std::vector<Vec3> vertices_m;
  std::vector<IntVec3> triangles;
};
struct HalfSpaceSpec : Located {
  Vec3 normal = Vec3::UnitZ();
  double offset_m = 0.0;
};
struct QuaternionSpec : Located {
  double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
};
struct AxisAngleSpec : Located {
  Vec3 axis = Vec3::UnitZ();
  double angle_deg = 0.0;
};
using OrientationSpec = std::variant<QuaternionSpec, AxisAngleSpec>;

using ConvexShapeSpec = std::variant<SphereSpec, BoxSpec, CapsuleSpec, CylinderSpec, HullSpec>;
struct PartSpec : Located {
  ConvexShapeSpec shape;
  Vec3 position_m = Vec3::Zero();
  OrientationSpec orientation;
};
struct CompoundSpec : Located {
  std::vector<PartSpec> parts;
};
using SolidShapeSpec =
    std::variant<SphereSpec, BoxSpec, CapsuleSpec, CylinderSpec, HullSpec, CompoundSpec>;
using StaticShapeSpec = std::variant<SphereSpec, BoxSpec, CapsuleSpec, CylinderSpec, HullSpec,
                                     CompoundSpec, MeshSpec, HalfSpaceSpec>;

struct MaterialSpec : Located {
  std::string name;
  double friction = 0.0, restitution = 0.0;
  double rolling_friction_m = 0.0, torsional_friction_m = 0.0;
};

struct DriveSpec : Located {
  std::string name;
  std::optional<Vec3> velocity_m_s;
  std::vector<Vec3> way_points_m;
  std::optional<double> speed_m_s, half_width_m;
  double time_constant_s = 0.0, max_acceleration_m_s2 = 0.0;
};

struct IgnoredCollisionSpec : Located {
  std::string group, with;
};

// What a body and the bodies of a generator have in common.
struct SolidSpec : Located {
  SolidShapeSpec shape;
  std::optional<double> mass_kg, density_kg_m3;
  std::optional<Vec3> principal_inertia_kg_m2, center_of_mass_m;
  std::string material;
  std::optional<std::string> drive, collision_group;
  Vec3 force_newton = Vec3::Zero(), body_force_newton = Vec3::Zero(),
       torque_newton_m = Vec3::Zero();
  double linear_damping_1_s = 0.0, angular_damping_1_s = 0.0;
};

struct WayPointSpec : Located {
  double time_s = 0.0;
  Vec3 position_m = Vec3::Zero();
  OrientationSpec orientation;
};

struct BodySpec : SolidSpec {
  std::int64_t id = -1;
  Vec3 position_m = Vec3::Zero();
  OrientationSpec orientation;
  Vec3 velocity_m_s = Vec3::Zero();
  Vec3 angular_velocity_rad_s = Vec3::Zero();
  bool present = true;
  bool kinematic = false;
  std::vector<WayPointSpec> path;
};

struct StaticSpec : Located {
  std::string name;
  std::optional<std::string> collision_group;
  StaticShapeSpec shape;
  std::string material;
  Vec3 position_m = Vec3::Zero();
  OrientationSpec orientation;
  Vec3 surface_velocity_m_s = Vec3::Zero();
};

struct GeneratorBase : SolidSpec {
  std::int64_t first_id = -1;
};
// Generators whose bodies start alike.
struct RegularBase : GeneratorBase {
  Vec3 position_m = Vec3::Zero();
  OrientationSpec orientation;
  Vec3 velocity_m_s = Vec3::Zero();
  Vec3 angular_velocity_rad_s = Vec3::Zero();
};
struct GridSpec : RegularBase {
  IntVec3 count{1, 1, 1};
  Vec3 spacing_m = Vec3::Zero();
};
struct StackSpec : RegularBase {
  std::int64_t count = 1;
  double gap_m = 0.0;
};
struct PyramidSpec : RegularBase {
  std::int64_t rows = 1;
  double side_gap_m = 0.0, gap_m = 0.0;
};
enum class Axis { kX, kY, kZ };
struct ChainSpec : RegularBase {
  std::int64_t count = 1;
  Axis axis = Axis::kX;
  double gap_m = 0.0;
};
struct ScatterBase : GeneratorBase {
  std::int64_t count = 1;
  Vec3 region_min_m = Vec3::Zero(), region_max_m = Vec3::Zero();
  double min_gap_m = 0.0;
  bool random_orientation = true;
  std::int64_t seed = 1;
};
struct RandomSpec : ScatterBase {};
struct GasSpec : ScatterBase {
  double max_speed_m_s = 0.0;
  double max_spin_rad_s = 0.0;
};
using GeneratorSpec =
    std::variant<GridSpec, StackSpec, PyramidSpec, ChainSpec, RandomSpec, GasSpec>;

// Joints. Anchors and axes: at the start, world frame.
struct JointBase : Located {
  std::int64_t id = -1;
  std::int64_t body = -1;
  std::optional<std::int64_t> other_body;
  Vec3 anchor_m = Vec3::Zero();
  bool can_collide = false;
  std::optional<double> reach_m, break_force_newton;
};
struct BallSpec : JointBase {};
struct FixedSpec : JointBase {
  std::optional<double> break_torque_newton_m;
};
struct HingeSpec : JointBase {
  Vec3 axis = Vec3::Zero();
  std::optional<double> break_torque_newton_m;
  std::optional<double> min_angle_rad, max_angle_rad;
  std::optional<double> motor_speed_rad_s, motor_torque_newton_m, motor_target_rad;
  std::optional<double> motor_time_constant_s;
};
struct SliderSpec : JointBase {
  Vec3 axis = Vec3::Zero();
  std::optional<double> break_torque_newton_m;
  std::optional<double> min_way_m, max_way_m;
  std::optional<double> motor_speed_m_s, motor_force_newton, motor_target_m;
  std::optional<double> motor_time_constant_s;
};
struct DistanceSpec : JointBase {
  Vec3 other_anchor_m = Vec3::Zero();
  std::optional<double> length_m;
};
struct SpringSpec : JointBase {
  Vec3 other_anchor_m = Vec3::Zero();
  std::optional<double> length_m;
  double stiffness_newton_m = 0.0, damping_newton_s_m = 0.0;
};
using JointSpec =
    std::variant<BallSpec, FixedSpec, HingeSpec, SliderSpec, DistanceSpec, SpringSpec>;

// User input: what is done to a body or a joint, and when; without a time, at once.
struct InputBase : Located {
  std::int64_t id = -1;
  std::optional<std::int64_t> step;
  std::optional<double> time_s;
};
struct BodyInputBase : InputBase {
  std::int64_t body = -1;
};
struct AddSpec : BodyInputBase {
  std::optional<Vec3> position_m, velocity_m_s, angular_velocity_rad_s;
  OrientationSpec orientation;
};
struct RemoveSpec : BodyInputBase {};
struct PushSpec : BodyInputBase {
  Vec3 impulse_newton_s = Vec3::Zero();
  Vec3 point_m = Vec3::Zero();
};
struct SetVelocitySpec : BodyInputBase {
  std::optional<Vec3> velocity_m_s, angular_velocity_rad_s;
};
struct ChangeMaterialSpec : BodyInputBase {
  double friction = 0.0, restitution = 0.0;
  double rolling_friction_m = 0.0, torsional_friction_m = 0.0;
};
struct SetMotorSpec : InputBase {
  std::int64_t joint = -1;
  std::optional<double> motor_speed_rad_s, motor_torque_newton_m, motor_target_rad;  // of hinges
  std::optional<double> motor_speed_m_s, motor_force_newton, motor_target_m;         // of sliders
};
using InputSpec =
    std::variant<AddSpec, RemoveSpec, PushSpec, SetVelocitySpec, ChangeMaterialSpec, SetMotorSpec>;

// Bounds on measures of error; reference_tables.cpp says what each is.
struct BoundsSpec : Located {
  std::optional<double> position_m, end_position_m, gap_m, velocity_m_s, end_velocity_m_s,
      attitude_rad, spin_rad_s, end_spin_rad_s, side_m, lift_m, stop_time_s, rest_speed_m_s, apex_m,
      energy_rel, energy_gain_rel, momentum_rel, angular_momentum_rel, displacement_rel,
      penetration_m, penetration_p99_m, speed_m_s, passed, force_rel, pressure_rel, speeds_rel,
      step_ms;
};
struct ReferenceBase : Located {
  BoundsSpec must, stretch;
};
template <class Answer>
struct AnswerSpec : ReferenceBase, Answer {};
struct StoredEndSpec : Located {
  std::int64_t body = -1;
  Vec3 position_m = Vec3::Zero();
  OrientationSpec orientation;
};
struct StoredRunSpec : ReferenceBase {
  std::vector<StoredEndSpec> ends;
  double error_m = 0.0;
};
using ReferenceSpec = std::variant<
    AnswerSpec<FreeFlight>, AnswerSpec<TorqueFree>, AnswerSpec<Sliding>, AnswerSpec<Rolling>,
    AnswerSpec<Bouncing>, AnswerSpec<TwoSpheres>, AnswerSpec<FloorImpact>, AnswerSpec<SphereLine>,
    AnswerSpec<SlidingRow>, AnswerSpec<AtRest>, AnswerSpec<Conserved>, AnswerSpec<StackForces>,
    AnswerSpec<OneSide>, AnswerSpec<Separation>, AnswerSpec<Pile>, AnswerSpec<Reversal>,
    AnswerSpec<HardSphereGas>, AnswerSpec<ForcedFlight>, AnswerSpec<DampedOscillator>,
    AnswerSpec<SteadyPrecession>, AnswerSpec<JointTravel>, AnswerSpec<HangingChain>,
    AnswerSpec<JointsHold>, StoredRunSpec>;

struct SolverSpec : Located {
  Quality quality = Quality::kBalanced;
  std::optional<std::int64_t> iterations;
  double restitution_threshold_m_s = physics::SolverSettings{}.restitution_threshold_m_s;
  double push_out_1_s = physics::SolverSettings{}.push_out_1_s;
  bool contact_response = physics::SolverSettings{}.contact_response;
  bool warm_starting = physics::SolverSettings{}.warm_starting;
  bool direct = physics::SolverSettings{}.direct;
  bool rest = physics::SolverSettings{}.rest;
  physics::Broadphase broadphase = physics::Broadphase::kGrid;
  physics::Narrowphase narrowphase = physics::Narrowphase::kAuto;
};

struct AccuracySpec : Located {
  double tolerance = 0.0;  // 0: no accuracy mode
};

struct TerritorySpec : Located {
  Vec3 origin_m = Vec3::Zero();
  double cell_size_m = 1.0;
  IntVec3 cells{1, 1, 1};
  std::int64_t worlds = 1;
  models::MapKind map = models::MapKind::kBlocks;
  std::int64_t seed = 1;
};

struct ExecutorSpec : Located {
  models::ExecutorKind kind = models::ExecutorKind::kSequential;
  std::int64_t threads = 1;
  std::int64_t scheduling_seed = 0;
};

struct BalancingSpec : Located {
  models::BalancingPolicy policy = models::BalancingPolicy::kOff;
  std::int64_t interval_steps = models::BalancingOptions{}.interval;
  std::int64_t seed = 1;
};

struct OutputSpec : Located {
  std::optional<std::string> log;
  bool step_digests = false;
};

struct DocumentSpec : Located {
  std::string schema;
  std::int64_t format = 0;
  std::string name, description;
  Vec3 gravity_m_s2 = Vec3::Zero();
  double time_step_s = 0.0;
  std::optional<double> duration_s;
  std::optional<std::int64_t> steps;
  SolverSpec solver;
  AccuracySpec accuracy;
  std::vector<MaterialSpec> materials;
  std::vector<DriveSpec> drives;
  std::vector<IgnoredCollisionSpec> ignored_collisions;
  std::vector<BodySpec> bodies;
  std::vector<StaticSpec> statics;
  std::vector<GeneratorSpec> generators;
  std::vector<JointSpec> joints;
  std::vector<InputSpec> inputs;
  std::vector<ReferenceSpec> references;
  TerritorySpec territory;
  std::int64_t buffer_entries = 48;
  ExecutorSpec executor;
  BalancingSpec balancing;
  OutputSpec output;
};

}  // namespace soda::scenarios
