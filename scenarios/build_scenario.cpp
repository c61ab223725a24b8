#include "scenarios/build_scenario.hpp"

#include <algorithm>
#include <cmath>

#include "physics/shapes/mass_properties.hpp"
#include "scenarios/cross_checks.hpp"
#include "scenarios/format.hpp"
#include "scenarios/generators.hpp"
#include "scenarios/inputs.hpp"
#include "scenarios/joints.hpp"
#include "scenarios/kinematic.hpp"
#include "scenarios/orientation.hpp"
#include "scenarios/output_place.hpp"
#include "scenarios/references.hpp"
#include "scenarios/shapes.hpp"
#include "scenarios/warnings.hpp"

namespace soda::scenarios {
namespace {

using physics::BodyParams;
using physics::BodyState;
using physics::Mat3;

struct BuiltBody {
  BodyParams params;
  BodyState state;
  const JsonValue* place = nullptr;  // its own, or its generator's
  bool present = true;
  std::vector<PathLeg> legs = {};
};

// The bodies found so far, in the order of the file.
struct Bodies {
  std::vector<BuiltBody> built;
  std::vector<BoundingSphere> spheres;
};

// What bodies are made from besides the document.
struct Parts {
  std::vector<physics::Shape>& shapes;
  ShapeIndex& index;
  const MaterialIndex& materials;
  const DriveIndex& drives;
  const GroupIndex& groups;
  std::vector<physics::BodyForces>& forces;
};

// Of generated bodies.
struct StatesWanted {
  bool wanted = true;
  std::optional<std::uint64_t> seed;
};

std::string folder_of(const std::string& file) {
  const std::size_t slash = file.rfind('/');
  return slash == std::string::npos ? "" : file.substr(0, slash + 1);
}

std::string stem_of(const std::string& file) {
  std::string name = file.substr(folder_of(file).size());
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos || dot == 0 ? name : name.substr(0, dot);
}

// By cofactors. Inertia tensors are symmetric and positive definite.
Mat3 inverse_of_symmetric(const Mat3& m) {
  const double a = m(0, 0), b = m(0, 1), c = m(0, 2), d = m(1, 1), e = m(1, 2), f = m(2, 2);
  const double aa = d * f - e * e, bb = c * e - b * f, cc = b * e - c * d;
  const double determinant = a * aa + b * bb + c * cc;
  const double dd = a * f - c * c, ee = b * c - a * e, ff = a * d - b * b;
  Mat3 inverse;
  inverse << aa, bb, cc, bb, dd, ee, cc, ee, ff;
  for (int i = 0; i < 9; ++i) inverse.data()[i] /= determinant;
  return inverse;
}

physics::CollisionFilter filter_of(const std::optional<std::string>& group,
                                   const GroupIndex& groups) {
  return group ? groups.find(*group)->second : physics::CollisionFilter{};
}

// Of the shape filled evenly, or those that the file gives. False, and a fault, if no body can have
// these.
bool set_inertia(const SolidSpec& spec, const PlacedShape& shape, BodyParams& params,
                 FaultList& faults) {
  Mat3& inertia = params.inertia_local_kg_m2;
  const double density = params.mass_kg / shape.mass.volume_m3;
  for (int i = 0; i < 9; ++i)
    inertia.data()[i] = density * shape.mass.inertia_per_density_m5.data()[i];
  if (spec.principal_inertia_kg_m2) {
    const Vec3& moments = *spec.principal_inertia_kg_m2;
    for (int i = 0; i < 3; ++i) {
      if (moments[i] <= moments[(i + 1) % 3] + moments[(i + 2) % 3]) continue;
      add_fault(
          faults, *find_member(*spec.json, "principal_inertia_kg_m2"),
          {"a moment of " + number_text(moments[i]) + " kg m^2 beside others of " +
               number_text(moments[(i + 1) % 3]) + " and " + number_text(moments[(i + 2) % 3]),
           "each at most the sum of the other two", ""});
      return false;
    }
    inertia = Mat3::Zero();
    for (int i = 0; i < 3; ++i) inertia(i, i) = moments[i];
  }
  params.inverse_inertia_local = inverse_of_symmetric(inertia);
  return true;
}

// Where they stand in the scene; bodies alike that follow each other share them.
std::uint32_t forces_of(const SolidSpec& spec, std::vector<physics::BodyForces>& forces) {
  const physics::BodyForces own{.body_force_newton = spec.body_force_newton,
                                .torque_newton_m = spec.torque_newton_m,
                                .linear_damping_1_s = spec.linear_damping_1_s,
                                .angular_damping_1_s = spec.angular_damping_1_s};
  if (own == physics::BodyForces{}) return physics::kNone;
  if (forces.empty() || !(forces.back() == own)) forces.push_back(own);
  return static_cast<std::uint32_t>(forces.size() - 1);
}

// Everything of a body but its id; nothing if it has a fault.
std::optional<BodyParams> params_of(const SolidSpec& spec, const PlacedShape& shape,
                                    const Parts& parts, bool kinematic, FaultList& faults) {
  const physics::Material* material =
      find_material(parts.materials, spec.material, *spec.json, faults);
  const std::optional<std::uint32_t> drive = find_drive(parts.drives, spec, faults);
  if (!spec.sound || !material || !drive) return std::nullopt;
  BodyParams params;
  params.shape = shape.index;
  params.drive = *drive;
  params.forces = forces_of(spec, parts.forces);
  params.material = *material;
  params.filter = filter_of(spec.collision_group, parts.groups);
  params.kinematic = kinematic;
  if (kinematic) {
    params.inverse_inertia_local = Mat3::Zero();
    return params;
  }
  params.mass_kg = spec.mass_kg ? *spec.mass_kg : *spec.density_kg_m3 * shape.mass.volume_m3;
  if (!(params.mass_kg >= kMinMass_kg && params.mass_kg <= kMaxMass_kg)) {
    add_fault(
        faults, *find_member(*spec.json, "density_kg_m3"),
        {"a density that makes a mass of " + number_text(params.mass_kg) + " kg",
         "a mass from " + number_text(kMinMass_kg) + " to " + number_text(kMaxMass_kg) + " kg",
         ""});
    return std::nullopt;
  }
  params.own_field_m_s2 = spec.force_newton / params.mass_kg;
  if (!set_inertia(spec, shape, params, faults)) return std::nullopt;
  return params;
}

bool within_limits(const Vec3& position_m) {
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(position_m[i]) <= kMaxPosition_m)) return false;
  }
  return true;
}

void add_body(Bodies& bodies, const BodyParams& params, BodyState state, const PlacedShape& shape,
              const JsonValue* place) {
  bodies.spheres.push_back({state.position_m, shape.bounding_radius_m});
  bodies.built.push_back({params, std::move(state), place});
}

void build_body(const BodySpec& spec, double time_step_s, Parts parts, Bodies& bodies,
                FaultList& faults) {
  if (!spec.json) return;
  const std::size_t before = faults.size();
  if (spec.sound) check_kinematic(spec, faults);
  const bool clear = faults.size() == before;
  const auto shape = place_body_shape(spec, parts.shapes, parts.index, faults);
  const physics::Quat orientation = orientation_of(spec.orientation, faults);
  if (!clear) return;
  auto params = params_of(spec, shape.value_or(PlacedShape{}), parts, spec.kinematic, faults);
  if (!shape || !params) return;
  params->label = static_cast<std::uint32_t>(spec.id);
  BodyState state;
  const Vec3 center = orientation._transformVector(shape->center_m);
  state.position_m = Vec3(spec.position_m.x() + center.x(), spec.position_m.y() + center.y(),
                          spec.position_m.z() + center.z());
  state.orientation = orientation;
  state.linear_velocity_m_s = spec.velocity_m_s;
  state.angular_velocity_rad_s = spec.angular_velocity_rad_s;
  std::vector<PathLeg> legs = legs_of(spec, shape->center_m, state, time_step_s, faults);
  if (!legs.empty()) {
    state.linear_velocity_m_s = legs.front().linear_m_s;
    state.angular_velocity_rad_s = legs.front().angular_rad_s;
  }
  add_body(bodies, *params, std::move(state), *shape, spec.json);
  bodies.built.back().present = spec.present;
  bodies.built.back().legs = std::move(legs);
}

// Where bodies begin: joints, references and inputs that add a body keep some of it.
bool uses_states(const DocumentSpec& document) {
  return !document.joints.empty() || !document.references.empty() ||
         std::ranges::any_of(document.inputs, [](const InputSpec& input) {
           return std::holds_alternative<AddSpec>(input);
         });
}

void build_generated(const GeneratorSpec& generator, Parts parts, const StatesWanted& states,
                     Bodies& bodies, FaultList& faults) {
  const GeneratorBase& base =
      std::visit([](const auto& s) -> const GeneratorBase& { return s; }, generator);
  if (!base.json) return;
  const auto shape = place_body_shape(base, parts.shapes, parts.index, faults);
  auto params = params_of(base, shape.value_or(PlacedShape{}), parts, false, faults);
  const auto room = static_cast<std::int64_t>(kMaxBodies - bodies.built.size());
  if (!shape || !params || count_of(generator) > room) return;
  params->label = static_cast<std::uint32_t>(base.first_id);
  std::vector<BodyState> begun =
      states.wanted ? generate(generator, *shape, bodies.spheres, states.seed, faults)
                    : std::vector<BodyState>(static_cast<std::size_t>(count_of(generator)));
  bodies.built.reserve(bodies.built.size() + begun.size());
  bodies.spheres.reserve(bodies.spheres.size() + begun.size());
  for (BodyState& state : begun) {
    if (!within_limits(state.position_m)) {
      add_fault(faults, *base.json,
                {"body " + std::to_string(params->label) + " placed beyond 1e9 m",
                 "positions within 1e9 m in each component", ""});
      return;
    }
    add_body(bodies, *params, std::move(state), *shape, base.json);
    ++params->label;
  }
}

void build_static(const StaticSpec& spec, const MeshFiles& files, Parts parts,
                  std::vector<physics::StaticBody>& statics, FaultList& faults) {
  if (!spec.json) return;
  const auto shape = place_shape(spec.shape, files, parts.shapes, parts.index, faults);
  const physics::Quat orientation = orientation_of(spec.orientation, faults);
  const physics::Material* material =
      find_material(parts.materials, spec.material, *spec.json, faults);
  if (!spec.sound || !shape || !material) return;
  const Vec3 center = orientation._transformVector(shape->center_m);
  const Vec3 position(spec.position_m.x() + center.x(), spec.position_m.y() + center.y(),
                      spec.position_m.z() + center.z());
  statics.push_back(
      {.name = spec.name,
       .shape = shape->index,
       .material = *material,
       .position_m = position,
       .orientation = orientation,
       .surface_velocity_m_s = orientation._transformVector(spec.surface_velocity_m_s),
       .filter = filter_of(spec.collision_group, parts.groups)});
}

// After all that users can give.
constexpr std::uint32_t kFirstPathInput = static_cast<std::uint32_t>(kMaxBodyId) + 1;

// The legs but the first, with which the body starts.
void append_path_inputs(const std::vector<PathLeg>& legs, physics::BodyId body,
                        std::vector<models::UserInput>& script) {
  for (std::size_t i = 1; i < legs.size(); ++i) {
    models::UserInput input;
    input.id = kFirstPathInput + static_cast<std::uint32_t>(script.size());
    input.step = legs[i].step;
    input.kind = models::InputKind::kSetVelocity;
    input.body = body;
    input.sets_linear = input.sets_angular = true;
    input.state.linear_velocity_m_s = legs[i].linear_m_s;
    input.state.angular_velocity_rad_s = legs[i].angular_rad_s;
    script.push_back(input);
  }
}

// Bodies by id: the index of each becomes its BodyId. Returns where they stand.
std::vector<const JsonValue*> order_bodies(Bodies bodies, Scenario& scenario) {
  std::vector<const JsonValue*> places;
  const auto label_of = [](const BuiltBody& body) { return body.params.label; };
  if (!std::ranges::is_sorted(bodies.built, {}, label_of))
    std::ranges::sort(bodies.built, {}, label_of);
  places.reserve(bodies.built.size());
  scenario.scene.bodies.reserve(bodies.built.size());
  scenario.initial.reserve(bodies.built.size());
  for (BuiltBody& body : bodies.built) {
    if (!body.present)
      scenario.run.inputs.absent.push_back(
          physics::BodyId{static_cast<std::uint32_t>(scenario.initial.size())});
    append_path_inputs(body.legs,
                       physics::BodyId{static_cast<std::uint32_t>(scenario.initial.size())},
                       scenario.run.inputs.script);
    scenario.scene.bodies.push_back(body.params);
    scenario.initial.push_back(std::move(body.state));
    places.push_back(body.place);
  }
  return places;
}

void build_inputs(const std::vector<InputSpec>& inputs, Scenario& scenario, FaultList& faults) {
  InputBuilder builder(scenario);
  for (const InputSpec& spec : inputs)
    if (const auto input = builder.build(spec, faults))
      scenario.run.inputs.script.push_back(*input);
}

models::TerritoryOptions territory_of(const TerritorySpec& spec,
                                      std::optional<std::uint64_t> seed) {
  models::TerritoryOptions options;
  options.grid.origin_m = spec.origin_m;
  options.grid.cell_size_m = spec.cell_size_m;
  for (int i = 0; i < 3; ++i) options.grid.cells[i] = static_cast<std::int32_t>(spec.cells[i]);
  options.worlds = static_cast<std::uint32_t>(spec.worlds);
  options.map = spec.map;
  options.seed = seed.value_or(static_cast<std::uint64_t>(spec.seed));
  return options;
}

void set_solver(const DocumentSpec& document, physics::SceneDescription& scene) {
  const SolverSpec& spec = document.solver;
  set_quality(spec.quality, scene);
  if (spec.iterations) scene.solver.iterations = static_cast<int>(*spec.iterations);
  if (document.accuracy.json != nullptr) scene.tolerance = document.accuracy.tolerance;
  scene.solver.restitution_threshold_m_s = spec.restitution_threshold_m_s;
  scene.solver.push_out_1_s = spec.push_out_1_s;
  scene.solver.contact_response = spec.contact_response;
  scene.solver.warm_starting = spec.warm_starting;
  scene.solver.direct = spec.direct;
  scene.solver.rest = spec.rest;
  scene.broadphase = spec.broadphase;
  scene.narrowphase = spec.narrowphase;
}

models::RunOptions run_of(const DocumentSpec& document, FaultList& faults) {
  models::RunOptions run;
  run.executor = document.executor.kind;
  run.threads = static_cast<unsigned>(document.executor.threads);
  run.steps = steps_of(document, faults);
  run.buffer = document.buffer_entries;
  run.scheduling_seed = static_cast<std::uint64_t>(document.executor.scheduling_seed);
  run.balancing = {document.balancing.policy, document.balancing.interval_steps,
                   static_cast<std::uint64_t>(document.balancing.seed)};
  return run;
}

}  // namespace

Scenario build_scenario(const DocumentSpec& document, const std::string& file,
                        const BuildOptions& options, MeshFiles files, FaultList& faults) {
  check_ids(document, faults);
  check_static_names(document.statics, faults);
  check_territory(document.territory, faults);

  Scenario scenario;
  scenario.name = document.name.empty() ? stem_of(file) : document.name;
  scenario.description = document.description;
  scenario.scene.gravity_m_s2 = document.gravity_m_s2;
  scenario.scene.dt_s = document.time_step_s;
  set_solver(document, scenario.scene);
  scenario.territory = territory_of(document.territory, options.seed);
  scenario.run = run_of(document, faults);
  scenario.output = {log_place(document.output, folder_of(file), faults),
                     document.output.step_digests};

  const MaterialIndex materials = index_materials(document.materials, faults);
  ShapeIndex index;
  const DriveIndex drives = index_drives(document, scenario.scene.drives, faults);
  const GroupIndex groups = index_groups(document, faults);
  const Parts parts{scenario.scene.shapes, index, materials, drives, groups, scenario.scene.forces};
  Bodies bodies;
  for (const BodySpec& body : document.bodies)
    build_body(body, document.time_step_s, parts, bodies, faults);
  const StatesWanted states{options.extent != ScenarioExtent::kNoStates || uses_states(document),
                            options.seed};
  for (const GeneratorSpec& generator : document.generators) {
    build_generated(generator, parts, states, bodies, faults);
  }
  files.folder = folder_of(file);
  for (const StaticSpec& spec : document.statics) {
    build_static(spec, files, parts, scenario.scene.statics, faults);
  }
  if (!faults.empty()) return scenario;
  const std::vector<const JsonValue*> places = order_bodies(std::move(bodies), scenario);
  // Whether their bodies exist can be told only of a scene that is whole.
  build_joints(document.joints, scenario, faults);
  build_inputs(document.inputs, scenario, faults);
  scenario.references = build_references(document.references, scenario, faults);
  if (faults.empty() && options.extent == ScenarioExtent::kAll)
    scenario.warnings = find_warnings({document, scenario, places, placed_boxes(scenario)});
  return scenario;
}

}  // namespace soda::scenarios
