// Drawing the parts of a scene: sizes, shapes, places, surfaces, as a user would write them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/whole/scene_parts.hpp"
#include "scenarios/random.hpp"

namespace soda::analysis {

// Random choices. Which bits libm gives does not matter: the text says them all.
class Chance {
 public:
  Chance(std::uint64_t seed, std::uint64_t purpose)
      : random_(scenarios::make_stream(seed, purpose)) {}

  std::uint64_t bits() { return scenarios::next_bits(random_); }
  std::uint32_t below(std::uint32_t bound) { return static_cast<std::uint32_t>(bits() % bound); }
  bool one_in(std::uint32_t n) { return below(n) == 0; }
  double between(double least, double most) { return scenarios::uniform(random_, least, most); }
  double powers(double least, double most);  // evenly in the logarithm
  physics::Vec3 direction();
  physics::Quat rotation() { return scenarios::uniform_rotation(random_); }
  template <class T, std::size_t N>
  T one_of(const T (&values)[N]) {
    return values[bits() % N];
  }

 private:
  scenarios::RandomStream random_;
};

// Shape of a body. Edges of its box along its own axes.
struct DrawnShape {
  JsonObject object;
  physics::Vec3 size_m = physics::Vec3::Ones();
  double volume_m3 = 1.0;
};

DrawnShape sphere_shape(double radius_m);
DrawnShape box_shape(const physics::Vec3& size_m);
DrawnShape capsule_shape(double radius_m, double length_m);
DrawnShape cylinder_shape(double radius_m, double length_m);

// A body that was added, for what refers to it.
struct AddedBody {
  std::uint32_t id = 0;
  physics::Vec3 position_m = physics::Vec3::Zero(), size_m = physics::Vec3::Ones();
  double mass_kg = 1.0;
};

// A scene that grows. Lengths are in units of the scene: a table top, a room or a valley.
class SceneDraw {
 public:
  SceneDraw(std::uint64_t seed, std::uint32_t most_bodies);

  const std::uint64_t seed;
  Chance chance;
  WholeScene scene;
  double unit_m = 1.0, time_step_s = 1.0 / 60.0, gravity_m_s2 = 9.81;
  std::vector<AddedBody> bodies;         // but those of generators
  std::vector<physics::Vec3> corners_m;  // where something is: of which the territory is made

  std::uint32_t bodies_left() const { return most_bodies_ - used_bodies_; }
  // Ids for `count` bodies of a generator: the first of them.
  std::uint32_t take_ids(std::uint32_t count);

  // In units. With two digits in a scene that a user typed, else any number. No less than a
  // millimetre, but where `least` is negative.
  double length(double least, double most);
  double plain(double value) const;
  DrawnShape any_shape(double size_m);
  std::string material();  // a new one or one that is there
  std::string material(double friction, double restitution);
  JsonObject solid(const DrawnShape& shape);  // shape, mass and surface

  AddedBody add_body(const DrawnShape& shape, const physics::Vec3& position_m,
                     const JsonObject& more = {});
  void add_static(const JsonObject& shape, const physics::Vec3& position_m,
                  const JsonObject& more = {});
  // Fills in the id. Between two bodies, or (null) a body and the world.
  JsonObject& add_joint(const std::string& type, const AddedBody& body, const AddedBody* other,
                        const physics::Vec3& anchor_m);

 private:
  double mass_of(double volume_m3, JsonObject& object);

  std::uint32_t most_bodies_ = 1, used_bodies_ = 0;
  std::uint32_t next_id_ = 0, next_joint_ = 0, next_static_ = 0, next_material_ = 0;
  double density_kg_m3_ = 1000.0;
  bool typed_ = true, wild_masses_ = false;
};

}  // namespace soda::analysis
