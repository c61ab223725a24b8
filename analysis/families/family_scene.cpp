#include "analysis/families/family_scene.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/measures/measures.hpp"
#include "physics/shapes/mass_properties.hpp"

namespace soda::analysis {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

FamilyScene scene_under_gravity() {
  FamilyScene scene;
  scene.scene.gravity_m_s2 = Vec3(0.0, 0.0, -kFamilyGravity_m_s2);
  scene.scene.dt_s = kFamilyStep_s;
  return scene;
}

std::uint32_t add_shape(FamilyScene& scene, physics::Shape shape) {
  scene.scene.shapes.push_back(std::move(shape));
  return static_cast<std::uint32_t>(scene.scene.shapes.size() - 1);
}

BodyState& add_body(FamilyScene& scene, std::uint32_t shape, const Vec3& position_m, double mass_kg,
                    const physics::Material& material) {
  const physics::MassProperties mass = physics::mass_properties(scene.scene.shapes[shape]);
  physics::BodyParams body;
  body.label = static_cast<std::uint32_t>(scene.scene.bodies.size());
  body.shape = shape;
  body.material = material;
  body.mass_kg = mass_kg;
  body.inertia_local_kg_m2 = mass_kg / mass.volume_m3 * mass.inertia_per_density_m5;
  body.inverse_inertia_local = body.inertia_local_kg_m2.inverse();
  scene.scene.bodies.push_back(body);
  scene.states.emplace_back().position_m = position_m;
  return scene.states.back();
}

void add_floor(FamilyScene& scene, const physics::Material& material) {
  physics::StaticBody floor;
  floor.shape = add_shape(scene, physics::HalfSpace{});
  floor.material = material;
  scene.scene.statics.push_back(floor);
}

void add_ball_joint(FamilyScene& scene, std::uint32_t a, std::optional<std::uint32_t> b,
                    const Vec3& anchor_m, double reach_m) {
  const auto local = [&](std::uint32_t body) -> Vec3 {
    const BodyState& state = scene.states[body];
    return state.orientation.conjugate() * (anchor_m - state.position_m);
  };
  physics::Joint joint;
  joint.label = static_cast<std::uint32_t>(scene.scene.joints.size());
  joint.a = BodyId{a};
  joint.anchor_a_m = local(a);
  joint.anchor_b_m = b ? local(*b) : anchor_m;
  if (b) joint.b = BodyId{*b};
  joint.reach_m = reach_m;
  scene.scene.joints.push_back(joint);
}

void let_pass_through(FamilyScene& scene) {
  for (physics::BodyParams& body : scene.scene.bodies)
    body.filter.groups = body.filter.ignored_groups = 1;
}

double graded_mass_kg(int i, int n, double ratio) {
  return n < 2 ? 1.0 : std::pow(ratio, static_cast<double>(i) / (n - 1));
}

double largest_joint_gap_m(const FamilyView& view) {
  double gap = 0.0;
  const auto anchor = [&](BodyId body, const Vec3& local_m) -> Vec3 {
    if (body == physics::kWorldBody) return local_m;
    const BodyState& state = view.states[physics::index_of(body)];
    return state.position_m + state.orientation * local_m;
  };
  for (const physics::Joint& joint : view.scene.joints)
    gap = std::max(gap,
                   (anchor(joint.a, joint.anchor_a_m) - anchor(joint.b, joint.anchor_b_m)).norm());
  return gap;
}

double largest_way_m(const FamilyView& view, std::span<const BodyState> start) {
  double way = 0.0;
  for (std::size_t i = 0; i < start.size(); ++i)
    way = std::max(way, (view.states[i].position_m - start[i].position_m).norm());
  return way;
}

double energy_joule(const FamilyView& view) {
  const physics::Mechanics now = physics::measure(view.scene, view.ids, view.states);
  return now.kinetic_energy_joule + now.potential_energy_joule;
}

}  // namespace soda::analysis
