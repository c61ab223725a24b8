// Small scenes built in code, for tests of the layers below the JSON reader.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/mass_properties.hpp"

namespace soda::test {

struct Scene {
  physics::SceneDescription description;
  std::vector<physics::BodyState> states;

  explicit Scene(const physics::Vec3& gravity_m_s2 = physics::Vec3::Zero()) {
    description.gravity_m_s2 = gravity_m_s2;
  }

  std::uint32_t shape(const physics::Shape& shape) {
    description.shapes.push_back(shape);
    return static_cast<std::uint32_t>(description.shapes.size() - 1);
  }

  physics::BodyState& body(std::uint32_t shape, const physics::Vec3& position_m,
                           const physics::Vec3& velocity_m_s = physics::Vec3::Zero(),
                           physics::Material material = {}) {
    constexpr double kDensity = 1000.0;
    const physics::MassProperties mass =
        physics::mass_properties(description.shapes[shape], description.shapes);
    physics::BodyParams params;
    params.label = static_cast<std::uint32_t>(description.bodies.size());
    params.shape = shape;
    params.material = material;
    params.mass_kg = kDensity * mass.volume_m3;
    params.inertia_local_kg_m2 = kDensity * mass.inertia_per_density_m5;
    params.inverse_inertia_local = params.inertia_local_kg_m2.inverse();
    description.bodies.push_back(params);
    physics::BodyState state;
    state.position_m = position_m;
    state.linear_velocity_m_s = velocity_m_s;
    states.push_back(state);
    return states.back();
  }

  // Solid below z = 0.
  void ground(physics::Material material = {}) {
    physics::StaticBody ground;
    ground.name = "ground";
    ground.shape = shape(physics::HalfSpace{});
    ground.material = material;
    description.statics.push_back(ground);
  }
};

// splitmix64: a seeded choice generator whose values do not depend on the standard library.
class Choices {
 public:
  explicit Choices(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t below(std::uint64_t bound) { return next() % bound; }
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1p-53);
  }
  physics::Vec3 vector(double low, double high) {
    const double x = between(low, high), y = between(low, high), z = between(low, high);
    return {x, y, z};
  }

 private:
  std::uint64_t state_;
};

}  // namespace soda::test
