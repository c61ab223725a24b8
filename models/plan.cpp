#include "models/plan.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "models/split_plan.hpp"
#include "physics/forces.hpp"
#include "physics/geometry.hpp"

namespace soda::models {
namespace {

using physics::SceneDescription;
using physics::ShapeKernel;

// What a plan line counts: one function per stage, so that plan and proof cannot drift apart.
struct Stage {
  const char* name;
  std::uint64_t (*count)(const SimulationResult&);
};

constexpr Stage kBoxes{"swept boxes", [](const SimulationResult& r) { return r.stages.boxes; }};
constexpr Stage kPairs{"broadphase pairs",
                       [](const SimulationResult& r) { return r.stages.candidate_pairs; }};
constexpr Stage kSolver{"contact solver",
                        [](const SimulationResult& r) { return r.stages.islands_solved; }};
constexpr Stage kRest{"contacts of bodies at rest",
                      [](const SimulationResult& r) { return r.stages.pairs_at_rest; }};
constexpr Stage kImpacts{"impacts located in time",
                         [](const SimulationResult& r) { return r.stages.impact_searches; }};
constexpr Stage kRefinement{"refined steps of islands",
                            [](const SimulationResult& r) { return r.stages.refined_steps; }};
constexpr Stage kBlocks{"blocks of giant islands",
                        [](const SimulationResult& r) { return r.stages.blocks_solved; }};
constexpr Stage kSplit{"giant islands split between worlds",
                       [](const SimulationResult& r) { return r.worlds.islands_split; }};
constexpr Stage kDirect{"direct contact solver",
                        [](const SimulationResult& r) { return r.stages.factor_multiplications; }};
constexpr Stage kFriction{"friction rows",
                          [](const SimulationResult& r) { return r.stages.friction_rows; }};
constexpr Stage kConveyor{"conveyor rows",
                          [](const SimulationResult& r) { return r.stages.conveyor_rows; }};
constexpr Stage kDrive{"driven bodies",
                       [](const SimulationResult& r) { return r.stages.driven_bodies; }};
constexpr Stage kForces{"forces and damping",
                        [](const SimulationResult& r) { return r.stages.forced_bodies; }};
constexpr Stage kJoints{"joint rows",
                        [](const SimulationResult& r) { return r.stages.joint_rows; }};
constexpr Stage kLimits{"limit rows",
                        [](const SimulationResult& r) { return r.stages.limit_rows; }};
constexpr Stage kMotors{"motor rows",
                        [](const SimulationResult& r) { return r.stages.motor_rows; }};
constexpr Stage kRestitution{"restitution rows",
                             [](const SimulationResult& r) { return r.stages.restitution_rows; }};
constexpr Stage kWarmStart{"warm starting",
                           [](const SimulationResult& r) { return r.stages.warm_started_rows; }};
constexpr Stage kBorderTests{"border tests",
                             [](const SimulationResult& r) { return r.worlds.border_tests; }};
constexpr Stage kGhosts{"ghost messages",
                        [](const SimulationResult& r) { return r.worlds.ghosts_sent; }};
constexpr Stage kFragments{"fragment messages",
                           [](const SimulationResult& r) { return r.worlds.fragments_sent; }};
constexpr Stage kMerge{"island merging",
                       [](const SimulationResult& r) { return r.worlds.records_sent; }};
constexpr Stage kMigration{"migration messages",
                           [](const SimulationResult& r) { return r.worlds.migrations; }};
constexpr Stage kHistory{"buffer entries for rollback",
                         [](const SimulationResult& r) { return r.worlds.entries_saved; }};
constexpr Stage kTaken{"islands taken over by repeated steps",
                       [](const SimulationResult& r) { return r.worlds.islands_taken; }};
constexpr Stage kInputs{"user input messages",
                        [](const SimulationResult& r) { return r.worlds.inputs; }};
constexpr Stage kBalancing{"load balancing", [](const SimulationResult& r) {
                             return r.worlds.bodies_sampled + r.territory_changes.size();
                           }};
constexpr Stage kRollback{"rollback", [](const SimulationResult& r) { return r.events.rollbacks; }};

// Two blocks of two layers each.
constexpr std::size_t kLeastInBlocks = 4;

constexpr std::array kStages{
    kBoxes,    kPairs,     kDrive,  kForces,    kSolver,      kDirect,     kFriction,
    kConveyor, kJoints,    kLimits, kMotors,    kRestitution, kWarmStart,  kBorderTests,
    kGhosts,   kFragments, kMerge,  kMigration, kHistory,     kTaken,      kRollback,
    kInputs,   kBalancing, kBlocks, kSplit,     kImpacts,     kRefinement, kRest};

constexpr std::size_t kKernels = static_cast<std::size_t>(ShapeKernel::kCount);

std::string kernel_line(std::size_t kernel) {
  return std::string(physics::name_of(static_cast<ShapeKernel>(kernel))) + " kernel";
}

// Which kernels some pair of the scene may need: shapes by use, not by body.
std::array<bool, kKernels> kernels_needed(const SceneDescription& scene) {
  std::vector<std::size_t> bodies_with(scene.shapes.size(), 0);
  std::vector<bool> is_static(scene.shapes.size(), false);
  for (const physics::BodyParams& body : scene.bodies) ++bodies_with[body.shape];
  for (const physics::StaticBody& fixed : scene.statics) is_static[fixed.shape] = true;
  std::array<bool, kKernels> needed{};
  for (std::size_t a = 0; a < scene.shapes.size(); ++a) {
    if (bodies_with[a] == 0) continue;
    for (std::size_t b = 0; b < scene.shapes.size(); ++b) {
      const bool dynamic_pair = b == a ? bodies_with[a] > 1 : bodies_with[b] > 0;
      if (!dynamic_pair && !is_static[b]) continue;
      needed[static_cast<std::size_t>(physics::kernel_for(scene.shapes[a], scene.shapes[b]))] =
          true;
    }
  }
  return needed;
}

bool any_pair_has_friction(const SceneDescription& scene) {
  std::size_t rough_bodies = 0, rough_statics = 0;
  for (const physics::BodyParams& body : scene.bodies) rough_bodies += body.material.friction > 0;
  for (const physics::StaticBody& fixed : scene.statics)
    rough_statics += fixed.material.friction > 0;
  return rough_bodies > 1 || (rough_bodies == 1 && rough_statics > 0);
}

bool any_body_has_forces(const SceneDescription& scene) {
  for (const physics::BodyParams& body : scene.bodies)
    if (body.forces != physics::kNone) return true;
  return false;
}

bool any_body_is_driven(const SceneDescription& scene) {
  for (const physics::BodyParams& body : scene.bodies)
    if (body.drive != physics::kNoDrive) return true;
  return false;
}

// Whether nothing but contacts and springs acts on some body.
bool any_body_is_loose(const SceneDescription& scene) {
  std::vector<bool> held(scene.bodies.size());
  for (const physics::Joint& joint : scene.joints) {
    if (joint.kind == physics::JointKind::kSpring) continue;
    held[physics::index_of(joint.a)] = true;
    if (!physics::is_static(joint.b)) held[physics::index_of(joint.b)] = true;
  }
  for (std::size_t i = 0; i < held.size(); ++i)
    if (!held[i] && !physics::is_pushed(scene.bodies[i])) return true;
  return false;
}

struct MovingSurfaces {
  bool any = false, rough = false;  // rough: some body feels them
};

MovingSurfaces moving_surfaces(const SceneDescription& scene) {
  bool rough_body = false;
  for (const physics::BodyParams& body : scene.bodies)
    rough_body = rough_body || body.material.friction > 0;
  MovingSurfaces found;
  for (const physics::StaticBody& fixed : scene.statics) {
    if (fixed.surface_velocity_m_s == physics::Vec3::Zero()) continue;
    found.any = true;
    found.rough = found.rough || (rough_body && fixed.material.friction > 0);
  }
  return found;
}

bool anything_bounces(const SceneDescription& scene) {
  for (const physics::BodyParams& body : scene.bodies)
    if (body.material.restitution > 0) return true;
  for (const physics::StaticBody& fixed : scene.statics)
    if (fixed.material.restitution > 0) return true;
  return false;
}

void add(std::vector<PlanLine>& plan, const Stage& stage, bool needed, const char* why,
         const char* why_not) {
  plan.push_back({stage.name, needed, needed ? why : why_not});
}

void add_joints(const SceneDescription& scene, std::vector<PlanLine>& plan) {
  add(plan, kJoints, !scene.joints.empty(), "joints hold bodies", "there are no joints");
  const auto has = [&scene](const auto& part) {
    return std::any_of(scene.joints.begin(), scene.joints.end(),
                       [&part](const physics::Joint& joint) { return part(joint); });
  };
  add(plan, kLimits, has([](const physics::Joint& joint) { return joint.limits.has_value(); }),
      "a joint has limits", "no joint has limits");
  add(plan, kMotors, has([](const physics::Joint& joint) { return joint.motor.has_value(); }),
      "a joint has a motor", "no joint has a motor");
}

void add_physics(const SceneDescription& scene, std::vector<PlanLine>& plan) {
  const bool bodies = !scene.bodies.empty();
  const bool pairs = scene.bodies.size() > 1 || (bodies && !scene.statics.empty());
  const bool response = pairs && scene.solver.contact_response;
  const char* no_response =
      pairs ? "detection only: contacts have no response" : "nothing can touch";
  add(plan, kBoxes, bodies, "bodies move", "the scene has no dynamic body");
  add(plan, kPairs, pairs, "bodies can meet bodies or statics", "nothing can touch");
  const std::array<bool, kKernels> kernels = kernels_needed(scene);
  for (std::size_t kernel = 0; kernel < kKernels; ++kernel) {
    plan.push_back(
        {kernel_line(kernel), kernels[kernel],
         kernels[kernel] ? "a pair of these shapes can meet" : "no such pair of shapes"});
  }
  add(plan, kDrive, any_body_is_driven(scene), "a body has a drive", "no body has a drive");
  add(plan, kForces, any_body_has_forces(scene), "a body has a force, a torque or damping",
      "no body has forces or damping of its own");
  add(plan, kSolver, response || !scene.joints.empty(),
      response ? "contacts push back" : "joints hold bodies", no_response);
  add(plan, kDirect, response && scene.solver.direct, "islands can be cheap to factorise",
      response ? "switched off in the solver settings" : no_response);
  const bool friction = any_pair_has_friction(scene);
  add(plan, kFriction, response && friction, "two materials in contact can have friction > 0",
      response ? "no pair of materials has friction > 0" : no_response);
  const MovingSurfaces belts = moving_surfaces(scene);
  add(plan, kConveyor, response && belts.rough, "a static's surface moves and has friction",
      !response   ? no_response
      : belts.any ? "surfaces move, but without friction"
                  : "no surface of a static moves");
  add_joints(scene, plan);
  add(plan, kRestitution, response && anything_bounces(scene), "a material has restitution > 0",
      response ? "no material has restitution > 0" : no_response);
  const bool loose = any_body_is_loose(scene), linked = !scene.joints.empty();
  const char* const held = "every body is driven, pushed or held by a joint";
  add(plan, kImpacts, response && (loose || linked),
      loose ? "bodies can fly into each other" : "joints can draw bodies along",
      response ? "every body is driven or pushed" : no_response);
  const bool asked = scene.tolerance > 0.0;
  add(plan, kRefinement, asked ? response || linked : response && loose,
      asked ? "islands are advanced to a tolerance" : "single bodies can slide or roll",
      response ? held : no_response);
  const bool carried = !scene.statics.empty() || scene.gravity_m_s2 == physics::Vec3::Zero();
  add(plan, kRest, response && loose && carried && scene.solver.rest, "known from the step before",
      !response ? no_response
      : !loose  ? held
      : carried ? "switched off in the solver settings"
                : "nothing carries what falls");
  add(plan, kBlocks, response && scene.bodies.size() >= kLeastInBlocks,
      "an island may have hundreds of contact points",
      response ? "too few bodies for two blocks" : no_response);
  add(plan, kWarmStart, response && scene.solver.warm_starting, "contacts last over steps",
      response ? "switched off in the solver settings" : no_response);
}

void add_division(const SceneDescription& scene, std::uint32_t worlds, const RunOptions& options,
                  std::vector<PlanLine>& plan) {
  const bool divided = worlds > 1;
  const char* one = "one world has no borders";
  add(plan, kBorderTests, divided, "space is divided", one);
  add(plan, kGhosts, divided, "bodies can reach over borders", one);
  add(plan, kFragments, divided, "contacts can have two owners", one);
  add(plan, kMerge, divided, "islands can span worlds", one);
  add(plan, kMigration, divided, "bodies can change owners", one);
  const bool optimistic = divided && options.executor != ExecutorKind::kSequential;
  const char* never = divided ? "the sequential executor never rolls back" : one;
  const bool modelled = options.executor == ExecutorKind::kVirtual;
  add(plan, kHistory, optimistic || modelled,
      divided ? "worlds run ahead of their neighbours" : "the virtual cluster can roll back any LP",
      never);
  const bool propagates = optimistic && options.rollback != RollbackMode::kInvalidate;
  add(plan, kTaken, propagates,
      options.rollback == RollbackMode::kWarm
          ? "repeated steps compute only what changed, from multipliers that depend on history"
          : "repeated steps compute only what changed",
      optimistic ? "rollbacks invalidate whole entries" : never);
  const bool splits = optimistic && scene.solver.contact_response && splits_islands(options) &&
                      scene.bodies.size() >= kLeastInBlocks;
  add(plan, kSplit, splits, "worlds solve an island of many contacts together",
      !optimistic                            ? never
      : !splits_islands(options)             ? "each world solves the whole of its islands"
      : scene.bodies.size() < kLeastInBlocks ? "too few bodies for two blocks"
                                             : "contacts move nobody");
  const bool balances = options.balancing.policy != BalancingPolicy::kOff;
  add(plan, kBalancing, divided && balances, "cells move to worlds that have less to do",
      divided ? "switched off" : one);
  add(plan, kRollback, optimistic, "a neighbour's body can turn out to have mattered", never);
}

// Of each body the roughest and springiest surface that user input may give it.
SceneDescription with_possible_materials(SceneDescription scene, const InputOptions& inputs) {
  const auto allow = [&scene](std::size_t body, const physics::Material& material) {
    physics::Material& most = scene.bodies[body].material;
    most.friction = std::max(most.friction, material.friction);
    most.restitution = std::max(most.restitution, material.restitution);
  };
  for (const UserInput& input : inputs.script)
    if (input.kind == InputKind::kChangeMaterial)
      allow(physics::index_of(input.body), input.material);
  if (inputs.live != nullptr)
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) allow(body, {1.0, 1.0});
  return scene;
}

}  // namespace

std::vector<PlanLine> make_plan(const SceneDescription& scene, std::uint32_t worlds,
                                const RunOptions& options) {
  std::vector<PlanLine> plan;
  add_physics(with_possible_materials(scene, options.inputs), plan);
  add_division(scene, worlds, options, plan);
  add(plan, kInputs, options.inputs.any(), "a user acts on bodies", "nobody acts from outside");
  return plan;
}

std::vector<std::uint64_t> plan_counters(const std::vector<PlanLine>& plan,
                                         const SimulationResult& result) {
  std::vector<std::uint64_t> counts;
  for (const PlanLine& line : plan) {
    std::uint64_t count = 0;
    for (const Stage& stage : kStages)
      if (line.stage == stage.name) count = stage.count(result);
    for (std::size_t kernel = 0; kernel < kKernels; ++kernel)
      if (line.stage == kernel_line(kernel)) count = result.stages.narrowphase_tests[kernel];
    counts.push_back(count);
  }
  return counts;
}

}  // namespace soda::models
