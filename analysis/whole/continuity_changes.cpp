#include "analysis/whole/continuity_changes.hpp"

#include <algorithm>

#include "analysis/text/exit_codes.hpp"
#include "analysis/whole/scene_draw.hpp"
#include "analysis/whole/whole_scene.hpp"
#include "scenarios/read_json.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

constexpr const char* kNames[] = {"tiny-force",  "far-body",  "far-contact",     "far-joint",
                                  "far-spring",  "far-input", "unused-material", "unused-drive",
                                  "default-key", "longer-row"};
constexpr double kTinyForce_newton = 1e-12;
// Out of the way of everything, and beyond no floor that would stop it.
const Vec3 kFarAway_m(4000.0, 4000.0, 4000.0);
constexpr std::uint32_t kFarId = 2'000'000;  // after all others

JsonObject& add_far_body(WholeScene& scene, std::uint32_t number) {
  JsonObject body;
  body.set("id", json_of(kFarId + number))
      .set("shape", box_shape(Vec3(1, 1, 1)).object.text())
      .set("mass_kg", "1")
      .set("material", *scene[ScenePart::kMaterials].front().find("name"))
      .set("position_m", json_of(Vec3(kFarAway_m + number * Vec3(1, 0, 0))));
  scene[ScenePart::kBodies].push_back(std::move(body));
  return scene[ScenePart::kBodies].back();
}

void add_far_joint(WholeScene& scene, const char* type) {
  add_far_body(scene, 0);
  add_far_body(scene, 1).set("position_m", json_of(Vec3(kFarAway_m + Vec3(1.5, 0, 0))));
  JsonObject joint;
  joint.set("id", json_of(kFarId))
      .set("type", quoted(type))
      .set("body", json_of(kFarId))
      .set("other_body", json_of(kFarId + 1))
      .set("anchor_m", json_of(Vec3(kFarAway_m + Vec3(0.75, 0, 0))));
  if (std::string(type) == "spring")
    joint.set("other_anchor_m", json_of(Vec3(kFarAway_m + Vec3(1.5, 0, 0))))
        .set("stiffness_newton_m", "10");
  scene[ScenePart::kJoints].push_back(std::move(joint));
}

void add_far_input(WholeScene& scene) {
  add_far_body(scene, 0);
  JsonObject input;
  input.set("type", quoted("push"))
      .set("id", json_of(kFarId))
      .set("step", "1")
      .set("body", json_of(kFarId))
      .set("impulse_newton_s", json_of(Vec3(1, 2, 3)));
  scene[ScenePart::kInputs].push_back(std::move(input));
}

bool add_tiny_force(WholeScene& scene, Chance& chance) {
  std::vector<JsonObject>& bodies = scene[ScenePart::kBodies];
  if (bodies.empty()) return false;
  JsonObject& body = bodies[chance.below(static_cast<std::uint32_t>(bodies.size()))];
  if (body.find("force_newton") != nullptr) return false;
  body.set("force_newton", json_of(Vec3(kTinyForce_newton * chance.direction())));
  return true;
}

// A key of a body, a static or the solver.
bool add_default_key(WholeScene& scene, Chance& chance) {
  struct Default {
    ScenePart part;
    const char *key, *value;
  };
  constexpr Default kDefaults[] = {{ScenePart::kBodies, "force_newton", "[0, 0, 0]"},
                                   {ScenePart::kBodies, "body_force_newton", "[0, 0, 0]"},
                                   {ScenePart::kBodies, "torque_newton_m", "[0, 0, 0]"},
                                   {ScenePart::kBodies, "linear_damping_1_s", "0"},
                                   {ScenePart::kBodies, "angular_damping_1_s", "0"},
                                   {ScenePart::kBodies, "velocity_m_s", "[0, 0, 0]"},
                                   {ScenePart::kBodies, "angular_velocity_rad_s", "[0, 0, 0]"},
                                   {ScenePart::kBodies, "present", "true"},
                                   {ScenePart::kStatics, "surface_velocity_m_s", "[0, 0, 0]"},
                                   {ScenePart::kGenerators, "force_newton", "[0, 0, 0]"},
                                   {ScenePart::kJoints, "can_collide", "false"}};
  if (chance.one_in(8) && scene.head.find("solver") == nullptr) {
    scene.head.set("solver", "{\"iterations\": 30, \"restitution_threshold_m_s\": 0.05}");
    return true;
  }
  const Default& chosen = kDefaults[chance.below(std::size(kDefaults))];
  std::vector<JsonObject>& objects = scene[chosen.part];
  if (objects.empty()) return false;
  JsonObject& object = objects[chance.below(static_cast<std::uint32_t>(objects.size()))];
  if (object.find(chosen.key) != nullptr) return false;
  object.set(chosen.key, chosen.value);
  return true;
}

void add_unused_material(WholeScene& scene) {
  JsonObject material;
  material.set("name", quoted("of nothing")).set("friction", "0.37").set("restitution", "0.83");
  scene[ScenePart::kMaterials].push_back(std::move(material));
}

void add_unused_drive(WholeScene& scene) {
  JsonObject drive;
  drive.set("name", quoted("of nobody"))
      .set("velocity_m_s", json_of(Vec3(1, 0, 0)))
      .set("time_constant_s", "1")
      .set("max_acceleration_m_s2", "1");
  scene[ScenePart::kDrives].push_back(std::move(drive));
}

// Equal boxes or balls on a floor, side by side, touching, at rest.
WholeScene row_at_rest(std::uint64_t seed) {
  SceneDraw d(seed, 40);
  d.scene.head.set("format", "1")
      .set("gravity_m_s2", json_of(Vec3(0, 0, -9.81)))
      .set("time_step_s", json_of(d.time_step_s))
      .set("steps", "60");
  JsonObject floor;
  floor.set("type", quoted("halfspace"));
  d.add_static(floor, Vec3::Zero());
  const double edge = d.length(0.1, 1.0);
  const DrawnShape shape =
      d.chance.one_in(2) ? sphere_shape(0.5 * edge) : box_shape(Vec3(edge, edge, edge));
  JsonObject more;
  more.set("material", d.material());
  const std::uint32_t count = 1 + static_cast<std::uint32_t>(d.chance.powers(1.0, 30.0));
  for (std::uint32_t i = 0; i < count; ++i) d.add_body(shape, Vec3(i * edge, 0, 0.5 * edge), more);
  for (JsonObject& body : d.scene[ScenePart::kBodies]) {
    body.drop("density_kg_m3");
    body.set("mass_kg", "1");
  }
  return d.scene;
}

// One more of the last body, as far from it as the last from the one before.
bool lengthen_row(WholeScene& scene) {
  std::vector<JsonObject>& bodies = scene[ScenePart::kBodies];
  if (bodies.size() < 2) return false;
  const auto place = [](const JsonObject& body) {
    scenarios::FaultList faults;
    const scenarios::JsonTree tree = scenarios::parse_json(*body.find("position_m"), faults);
    Vec3 at = Vec3::Zero();
    int i = 0;
    for (const auto* v = tree.root()->first_child; v != nullptr && i < 3; v = v->next_sibling)
      at[i++] = v->number;
    return at;
  };
  const Vec3 last = place(bodies.back()), before = place(bodies[bodies.size() - 2]);
  JsonObject more = bodies.back();
  more.set("id", json_of(kFarId)).set("position_m", json_of(Vec3(last + (last - before))));
  bodies.push_back(std::move(more));
  return true;
}

bool apply(WholeScene& scene, Chance& chance, ContinuityKind kind) {
  switch (kind) {
    case ContinuityKind::kTinyForce:
      return add_tiny_force(scene, chance);
    case ContinuityKind::kFarBody:
      add_far_body(scene, 0);
      return true;
    case ContinuityKind::kFarContact:
      add_far_body(scene, 0);
      add_far_body(scene, 1);
      return true;
    case ContinuityKind::kFarJoint:
      add_far_joint(scene, "ball");
      return true;
    case ContinuityKind::kFarSpring:
      add_far_joint(scene, "spring");
      return true;
    case ContinuityKind::kFarInput:
      add_far_input(scene);
      return true;
    case ContinuityKind::kUnusedMaterial:
      add_unused_material(scene);
      return true;
    case ContinuityKind::kUnusedDrive:
      add_unused_drive(scene);
      return true;
    case ContinuityKind::kDefaultKey:
      return add_default_key(scene, chance);
    case ContinuityKind::kLongerRow:
      return lengthen_row(scene);
    case ContinuityKind::kCount:
      break;
  }
  return false;
}

}  // namespace

const char* name_of(ContinuityKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

std::vector<ContinuityKind> parse_continuity_kinds(const std::vector<std::string>& names) {
  std::vector<ContinuityKind> kinds;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(kNames, name);
    if (found == std::end(kNames)) {
      std::string all;
      for (const char* known : kNames) all += (all.empty() ? "" : ", ") + std::string(known);
      std::string what = "--kinds: found " + name;
      what += "; allowed: " + all;
      throw UsageError(what);
    }
    kinds.push_back(static_cast<ContinuityKind>(found - std::begin(kNames)));
  }
  return kinds;
}

WholeScene draw_continuity_scene(std::uint64_t seed, ContinuityKind kind) {
  return kind == ContinuityKind::kLongerRow ? row_at_rest(seed) : draw_whole_scene(seed);
}

std::optional<ContinuityPair> change(const WholeScene& scene, std::uint64_t seed,
                                     ContinuityKind kind) {
  Chance chance(seed, 14);
  ContinuityPair pair{scene, scene, 0.0};
  if (!apply(pair.changed, chance, kind)) return {};
  if (kind == ContinuityKind::kTinyForce) pair.force_newton = kTinyForce_newton;
  return pair;
}

WholeScene shaken(const WholeScene& scene, std::uint64_t seed) {
  constexpr double kShake = 1e-13;
  Chance chance(seed, 15);
  WholeScene moved = scene;
  for (JsonObject& body : moved[ScenePart::kBodies]) {
    scenarios::FaultList faults;
    const scenarios::JsonTree tree = scenarios::parse_json(*body.find("position_m"), faults);
    Vec3 at = Vec3::Zero();
    int i = 0;
    for (const auto* v = tree.root()->first_child; v != nullptr && i < 3; v = v->next_sibling)
      at[i++] = v->number;
    const double scale = std::max(1e-3, at.cwiseAbs().maxCoeff());
    body.set("position_m", json_of(Vec3(at + kShake * scale * chance.direction())));
  }
  return moved;
}

}  // namespace soda::analysis
