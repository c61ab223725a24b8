// Scenes for tests of the physics layer.
#pragma once

#include <vector>

#include "physics/measures/measures.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "physics/step/step.hpp"

namespace soda::physics::test {

inline constexpr double kGravity = 9.81;

// A scene with its state and the loop around physics::step.
struct World {
  SceneDescription scene;
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  StepScratch scratch;
  StepReport report;
  StageCounters counters;

  std::uint32_t add_shape(Shape shape) {
    scene.shapes.push_back(std::move(shape));
    return static_cast<std::uint32_t>(scene.shapes.size() - 1);
  }

  BodyState& add_body(std::uint32_t shape, const Vec3& position, double density = 1000.0,
                      Material material = {}) {
    const MassProperties p = mass_properties(scene.shapes[shape], scene.shapes);
    BodyParams params;
    params.label = static_cast<std::uint32_t>(scene.bodies.size());
    params.shape = shape;
    params.material = material;
    params.mass_kg = density * p.volume_m3;
    params.inertia_local_kg_m2 = density * p.inertia_per_density_m5;
    params.inverse_inertia_local = params.inertia_local_kg_m2.inverse();
    ids.push_back(static_cast<BodyId>(scene.bodies.size()));
    scene.bodies.push_back(params);
    states.emplace_back();
    states.back().position_m = position;
    return states.back();
  }

  void add_static(std::uint32_t shape, const Vec3& position = Vec3::Zero(),
                  const Quat& orientation = Quat::Identity(), Material material = {}) {
    StaticBody body;
    body.shape = shape;
    body.material = material;
    body.position_m = position;
    body.orientation = orientation;
    scene.statics.push_back(body);
  }

  void add_floor(Material material = {}) {
    add_static(add_shape(HalfSpace{}), Vec3::Zero(), Quat::Identity(), material);
  }

  void run(int steps) { run(steps, Geometry(scene)); }
  void run(int steps, const Geometry& geometry) {
    for (int i = 0; i < steps; ++i) {
      step(scene, geometry, ids, states, {scratch, report, counters});
    }
  }

  std::uint64_t digest_of_states() const { return digest(ids, states); }
  Mechanics mechanics() const { return measure(scene, ids, states); }
};

inline double energy_joule(const World& world) {
  const Mechanics now = world.mechanics();
  return now.kinetic_energy_joule + now.potential_energy_joule;
}

inline World under_gravity() {
  World world;
  world.scene.gravity_m_s2 = Vec3(0.0, 0.0, -kGravity);
  return world;
}

// The manifolds of one pair.
inline std::vector<ContactManifold> contacts_of(const World& world, BodyId a, BodyId b) {
  const Geometry geometry(world.scene);
  StageCounters counters;
  std::vector<ContactManifold> out;
  collide({world.scene, geometry, world.scene.dt_s, a, world.states[index_of(a)], b,
           is_static(b) ? nullptr : &world.states[index_of(b)]},
          out, counters);
  return out;
}

// Angles are test inputs here, so libm is fine.
inline Quat about(const Vec3& axis, double angle_rad) {
  return Quat(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

}  // namespace soda::physics::test
