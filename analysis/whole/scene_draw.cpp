#include "analysis/whole/scene_draw.hpp"

#include <algorithm>
#include <cmath>

namespace soda::analysis {
namespace {

using physics::Vec3;

double two_digits(double value) {
  if (value == 0.0) return 0.0;
  const double exponent = std::floor(std::log10(std::fabs(value)));
  const double unit = std::pow(10.0, std::fabs(exponent - 1.0));
  return exponent >= 1.0 ? std::round(value / unit) * unit : std::round(value * unit) / unit;
}

}  // namespace

double Chance::powers(double least, double most) {
  return least * std::pow(most / least, scenarios::uniform_unit(random_));
}

Vec3 Chance::direction() {
  const Vec3 v = scenarios::uniform_in_ball(random_);
  return v.norm() > 1e-3 ? Vec3(v.normalized()) : Vec3(Vec3::UnitX());
}

DrawnShape sphere_shape(double radius_m) {
  DrawnShape shape;
  shape.object.set("type", quoted("sphere")).set("radius_m", json_of(radius_m));
  shape.size_m = Vec3::Constant(2.0 * radius_m);
  shape.volume_m3 = 4.19 * radius_m * radius_m * radius_m;
  return shape;
}

DrawnShape box_shape(const Vec3& size_m) {
  DrawnShape shape;
  shape.object.set("type", quoted("box")).set("size_m", json_of(size_m));
  shape.size_m = size_m;
  shape.volume_m3 = size_m.prod();
  return shape;
}

DrawnShape capsule_shape(double radius_m, double length_m) {
  DrawnShape shape;
  shape.object.set("type", quoted("capsule"))
      .set("radius_m", json_of(radius_m))
      .set("length_m", json_of(length_m));
  shape.size_m = Vec3(2.0 * radius_m, 2.0 * radius_m, length_m + 2.0 * radius_m);
  shape.volume_m3 = 3.14 * radius_m * radius_m * (length_m + 1.33 * radius_m);
  return shape;
}

DrawnShape cylinder_shape(double radius_m, double length_m) {
  DrawnShape shape = capsule_shape(radius_m, length_m);
  shape.object.set("type", quoted("cylinder"));
  shape.size_m.z() = length_m;
  shape.volume_m3 = 3.14 * radius_m * radius_m * length_m;
  return shape;
}

SceneDraw::SceneDraw(std::uint64_t drawn_from, std::uint32_t most_bodies)
    : seed(drawn_from), chance(drawn_from, 11), most_bodies_(most_bodies) {
  constexpr double kSteps_s[] = {1.0 / 60.0,  1.0 / 60.0,  1.0 / 60.0, 1.0 / 120.0,
                                 1.0 / 240.0, 1.0 / 100.0, 1.0 / 30.0, 1.0 / 20.0};
  time_step_s = chance.one_of(kSteps_s);
  if (chance.one_in(6)) unit_m = chance.powers(0.01, 100.0);
  typed_ = !chance.one_in(3);
  if (typed_) unit_m = two_digits(unit_m);
  if (chance.one_in(8)) gravity_m_s2 = chance.one_in(2) ? 0.0 : 1.62;
  density_kg_m3_ = plain(chance.powers(100.0, 8000.0));
  wild_masses_ = chance.one_in(6);
}

std::uint32_t SceneDraw::take_ids(std::uint32_t count) {
  const std::uint32_t first = next_id_;
  next_id_ += count;
  used_bodies_ = std::min(most_bodies_, used_bodies_ + count);
  return first;
}

double SceneDraw::plain(double value) const { return typed_ ? two_digits(value) : value; }

double SceneDraw::length(double least, double most) {
  const double length = plain(unit_m * chance.between(least, most));
  return least < 0.0 ? length : std::clamp(length, 1e-3, 1e4);
}

DrawnShape SceneDraw::any_shape(double size_m) {
  const auto edge = [&] { return std::max(1e-3, plain(size_m * chance.between(0.3, 1.0))); };
  switch (chance.below(6)) {
    case 0:
      return sphere_shape(0.5 * edge());
    case 1:
      return capsule_shape(0.3 * edge(), edge());
    case 2:
      return cylinder_shape(0.5 * edge(), edge());
    case 3: {
      DrawnShape shape = box_shape(Vec3(edge(), edge(), edge()));
      std::string points;
      const std::uint32_t count = 5 + chance.below(12);
      for (std::uint32_t i = 0; i < count; ++i)
        points += (i > 0 ? ", " : "") +
                  json_of(Vec3(shape.size_m.cwiseProduct(0.5 * chance.direction())));
      shape.object = {};
      shape.object.set("type", quoted("hull")).set("points_m", "[" + points + "]");
      shape.volume_m3 *= 0.3;
      return shape;
    }
    default:
      return box_shape(Vec3(edge(), edge(), edge()));
  }
}

std::string SceneDraw::material(double friction, double restitution) {
  std::string name = quoted("stuff " + std::to_string(next_material_++));
  JsonObject material;
  material.set("name", name)
      .set("friction", json_of(friction))
      .set("restitution", json_of(restitution));
  scene[ScenePart::kMaterials].push_back(std::move(material));
  return name;
}

std::string SceneDraw::material() {
  const std::vector<JsonObject>& known = scene[ScenePart::kMaterials];
  if (!known.empty() && !chance.one_in(4))
    return *known[chance.below(static_cast<std::uint32_t>(known.size()))].find("name");
  const double friction = chance.one_in(5) ? 0.0 : plain(chance.between(0.05, 1.2));
  const double restitution =
      chance.one_in(2) ? 0.0 : (chance.one_in(6) ? 1.0 : plain(chance.between(0.05, 0.95)));
  return material(friction, restitution);
}

double SceneDraw::mass_of(double volume_m3, JsonObject& object) {
  const double density = wild_masses_ ? plain(chance.powers(1.0, 1e5)) : density_kg_m3_;
  const double mass = std::clamp(volume_m3 * density, 1e-9, 1e9);
  if (chance.one_in(2) || mass != volume_m3 * density)
    object.set("mass_kg", json_of(plain(mass)));
  else
    object.set("density_kg_m3", json_of(density));
  return mass;
}

JsonObject SceneDraw::solid(const DrawnShape& shape) {
  JsonObject object;
  object.set("shape", shape.object.text());
  mass_of(shape.volume_m3, object);
  return object.set("material", material());
}

AddedBody SceneDraw::add_body(const DrawnShape& shape, const Vec3& position_m,
                              const JsonObject& more) {
  AddedBody added{take_ids(1), position_m, shape.size_m, 1.0};
  JsonObject object;
  object.set("id", json_of(added.id)).set("shape", shape.object.text());
  added.mass_kg = mass_of(shape.volume_m3, object);
  if (more.find("material") == nullptr) object.set("material", material());
  object.set("position_m", json_of(position_m));
  for (const auto& [key, value] : more.fields) object.set(key, value);
  scene[ScenePart::kBodies].push_back(std::move(object));
  bodies.push_back(added);
  corners_m.push_back(position_m);
  return added;
}

void SceneDraw::add_static(const JsonObject& shape, const Vec3& position_m,
                           const JsonObject& more) {
  JsonObject object;
  object.set("name", quoted("static " + std::to_string(next_static_++)))
      .set("shape", shape.text())
      .set("material", material());
  if (!position_m.isZero(0.0)) object.set("position_m", json_of(position_m));
  for (const auto& [key, value] : more.fields) object.set(key, value);
  scene[ScenePart::kStatics].push_back(std::move(object));
}

JsonObject& SceneDraw::add_joint(const std::string& type, const AddedBody& body,
                                 const AddedBody* other, const Vec3& anchor_m) {
  JsonObject joint;
  joint.set("id", json_of(next_joint_++)).set("type", quoted(type)).set("body", json_of(body.id));
  if (other != nullptr) joint.set("other_body", json_of(other->id));
  joint.set("anchor_m", json_of(anchor_m));
  scene[ScenePart::kJoints].push_back(std::move(joint));
  return scene[ScenePart::kJoints].back();
}

}  // namespace soda::analysis
