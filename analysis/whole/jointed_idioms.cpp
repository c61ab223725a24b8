// Idioms with joints, springs and motors.
#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/whole/scene_idioms.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

const std::string kAlongY = json_of(Vec3(0, 1, 0));

JsonObject lying_along_y() {
  JsonObject more;
  more.set("orientation", "{\"axis\": [1, 0, 0], \"angle_deg\": 90}");
  return more;
}

void chain(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double link = d.length(0.1, 0.6);
  const bool level = d.chance.one_in(2);  // else it hangs
  const Vec3 way = level ? Vec3(1, 0, 0) : Vec3(0, 0, -1);
  const Vec3 start(at_m.x(), at_m.y(), d.unit_m + link * (level ? 2.0 : count + 1.0));
  constexpr const char* kTypes[] = {"ball", "ball", "hinge", "distance", "fixed"};
  const char* const type = d.chance.one_of(kTypes);
  std::optional<AddedBody> last;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 middle = start + (i + 0.5) * link * way;
    const bool end = i + 1 == count;
    const DrawnShape shape = end && d.chance.one_in(2)
                                 ? sphere_shape(link)
                                 : box_shape(Vec3(0.9 * link, 0.3 * link, 0.3 * link));
    const Vec3 place = end ? Vec3(middle + 0.5 * (shape.size_m.x() - link) * way) : middle;
    const AddedBody body = d.add_body(shape, place);
    const Vec3 anchor = start + static_cast<double>(i) * link * way;
    if (last || !d.chance.one_in(6)) {
      JsonObject& joint = d.add_joint(type, body, last ? &*last : nullptr, anchor);
      if (joint.find("type") == nullptr) continue;
      if (*joint.find("type") == quoted("hinge")) joint.set("axis", kAlongY);
      if (*joint.find("type") == quoted("distance"))
        joint.set("other_anchor_m", json_of(Vec3(anchor - 0.1 * link * way)));
    }
    last = body;
  }
}

void bridge(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double plank = d.length(0.3, 1.0), high = 2.0 * d.unit_m;
  const std::uint32_t planks = std::max(1u, count * 2 / 3);
  std::vector<AddedBody> all;
  const Vec3 start(at_m.x(), at_m.y(), high);
  for (std::uint32_t i = 0; i < planks; ++i) {
    all.push_back(d.add_body(box_shape(Vec3(0.95 * plank, 1.5 * plank, 0.1 * plank)),
                             start + Vec3((i + 0.5) * plank, 0, 0)));
    d.add_joint("hinge", all.back(), i > 0 ? &all[i - 1] : nullptr, start + Vec3(i * plank, 0, 0))
        .set("axis", kAlongY);
  }
  if (!d.chance.one_in(4))
    d.add_joint("hinge", all.back(), nullptr, start + Vec3(planks * plank, 0, 0))
        .set("axis", kAlongY);
  for (std::uint32_t i = planks; i < count; ++i)
    d.add_body(d.any_shape(0.7 * plank),
               start + Vec3((i - planks + 0.5) * plank, 0, plank * (0.6 + 0.5 * (i % 3))));
}

void car(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const std::uint32_t cars = std::max(1u, count / 5);
  const double wheel = d.length(0.2, 0.4);
  const double speed = d.plain(d.chance.between(2, 20));
  const std::string grip = d.material(1.0, 0.0);
  for (std::uint32_t c = 0; c < std::min(cars, 10u); ++c) {
    const Vec3 at(at_m.x(), at_m.y() + 5.0 * wheel * c, 1.5 * wheel);
    const AddedBody body = d.add_body(box_shape(Vec3(6.0 * wheel, 2.5 * wheel, wheel)), at);
    for (const Vec3& corner :
         {Vec3(2, 1.6, -0.5), Vec3(2, -1.6, -0.5), Vec3(-2, 1.6, -0.5), Vec3(-2, -1.6, -0.5)}) {
      const Vec3 axle = at + wheel * corner;
      JsonObject more = lying_along_y();
      more.set("material", grip);
      const DrawnShape round =
          d.chance.one_in(3) ? sphere_shape(wheel) : cylinder_shape(wheel, 0.6 * wheel);
      const AddedBody rim = d.add_body(round, axle, more);
      JsonObject& joint = d.add_joint("hinge", rim, &body, axle).set("axis", kAlongY);
      if (corner.x() > 0 || d.chance.one_in(2))
        joint.set("motor_speed_rad_s", json_of(speed))
            .set("motor_torque_newton_m",
                 json_of(d.plain(5.0 * body.mass_kg * wheel * d.chance.powers(0.1, 10))));
    }
  }
  if (d.chance.one_in(2))
    d.add_static(box_shape(Vec3(2.0 * wheel, 50.0 * wheel, 0.3 * wheel)).object,
                 Vec3(at_m.x() + 8.0 * wheel, at_m.y(), 0.15 * wheel));
}

void doll(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const std::uint32_t dolls = std::max(1u, count / 6);
  const double s = d.length(0.3, 1.0);
  for (std::uint32_t k = 0; k < std::min(dolls, 20u); ++k) {
    const std::uint32_t layer = k / 16;
    const Vec3 at(at_m.x() + 1.2 * s * (k % 4), at_m.y() + 1.2 * s * (k / 4 % 4),
                  s * (2.0 + 2.5 * layer));
    const AddedBody torso = d.add_body(box_shape(Vec3(0.4 * s, 0.25 * s, 0.6 * s)), at);
    const AddedBody head = d.add_body(sphere_shape(0.15 * s), at + Vec3(0, 0, 0.45 * s));
    d.add_joint("ball", head, &torso, at + Vec3(0, 0, 0.3 * s));
    for (const Vec3& limb :
         {Vec3(0.3, 0, 0.1), Vec3(-0.3, 0, 0.1), Vec3(0.12, 0, -0.55), Vec3(-0.12, 0, -0.55)}) {
      const AddedBody part = d.add_body(capsule_shape(0.07 * s, 0.3 * s), at + s * limb);
      JsonObject& joint = d.add_joint(d.chance.one_in(3) ? "ball" : "hinge", part, &torso,
                                      at + s * limb + Vec3(0, 0, 0.2 * s));
      if (*joint.find("type") == quoted("ball")) continue;
      joint.set("axis", kAlongY);
      if (!d.chance.one_in(3))
        joint.set("min_angle_rad", json_of(-d.plain(d.chance.between(0, 1.5))))
            .set("max_angle_rad", json_of(d.plain(d.chance.between(0, 1.5))));
    }
  }
}

void sleds(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = d.length(0.2, 0.8);
  const bool net = d.chance.one_in(2);  // else a train
  const std::uint32_t side =
      net ? std::max(1u, static_cast<std::uint32_t>(std::sqrt(count))) : count;
  std::vector<AddedBody> all;
  for (std::uint32_t i = 0; i < (net ? side * side : count); ++i) {
    const std::uint32_t row = i / side;
    const Vec3 at(at_m.x() + 1.5 * edge * (i % side), at_m.y() + 1.5 * edge * row, 0.5 * edge);
    all.push_back(d.add_body(box_shape(Vec3(edge, edge, edge)), at));
    const double rate = d.chance.powers(0.02, 3.0) / d.time_step_s;
    const auto spring = [&](const AddedBody* other, const Vec3& there) {
      JsonObject& joint = d.add_joint("spring", all[i], other, all[i].position_m);
      joint.set("other_anchor_m", json_of(there))
          .set("stiffness_newton_m", json_of(all[i].mass_kg * rate * rate));
      if (d.chance.one_in(2))
        joint.set("damping_newton_s_m", json_of(all[i].mass_kg * rate * d.chance.powers(0.01, 1)));
      if (d.chance.one_in(3)) joint.set("length_m", json_of(edge * d.chance.between(0.5, 2.5)));
      joint.set("can_collide", "true");
    };
    if (i % side > 0) spring(&all[i - 1], all[i - 1].position_m);
    if (net && i >= side) spring(&all[i - side], all[i - side].position_m);
    if (i == 0) spring(nullptr, at - Vec3(1.5 * edge, 0, 0));
  }
}

void machine(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double s = d.unit_m;
  const Vec3 hub(at_m.x(), at_m.y(), 2.5 * s);
  const AddedBody wheel = d.add_body(cylinder_shape(0.4 * s, 0.6 * s), hub, lying_along_y());
  d.add_joint("hinge", wheel, nullptr, hub)
      .set("axis", kAlongY)
      .set("motor_speed_rad_s", json_of(d.plain(d.chance.between(-4, 4))))
      .set("motor_torque_newton_m",
           json_of(d.plain(wheel.mass_kg * s * d.chance.powers(0.1, 100))));
  for (const Vec3& side : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
    const Vec3 size = side.x() != 0.0 ? Vec3(s, 0.5 * s, 0.1 * s) : Vec3(0.1 * s, 0.5 * s, s);
    const AddedBody paddle = d.add_body(box_shape(size), hub + 0.9 * s * side);
    d.add_joint("fixed", paddle, &wheel, hub + 0.4 * s * side);
  }
  const Vec3 at(at_m.x() + 4.0 * s, at_m.y(), 0.6 * s);
  const AddedBody lift = d.add_body(box_shape(Vec3(s, s, 0.2 * s)), at);
  d.add_joint("slider", lift, nullptr, at)
      .set("axis", json_of(Vec3(0, 0, 1)))
      .set("min_way_m", json_of(-d.length(0, 0.4)))
      .set("max_way_m", json_of(d.length(0, 2)))
      .set("motor_speed_m_s", json_of(d.length(-1, 1)))
      .set("motor_force_newton", json_of(d.plain(lift.mass_kg * d.chance.powers(1, 100))));
  for (std::uint32_t i = 6; i < count; ++i)
    d.add_body(d.any_shape(0.5 * s),
               (i % 3 == 0 ? at : hub) + Vec3(d.length(-0.5, 0.5), 0, s * (1.2 + 0.3 * i)));
}

// Anything held by anything.
void tangle(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double size = d.length(0.2, 1.0);
  const double room = size * std::cbrt(static_cast<double>(count));
  std::vector<AddedBody> all;
  constexpr const char* kTypes[] = {"ball", "hinge", "slider", "fixed", "distance"};
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 at = at_m + room * d.chance.direction() + Vec3(0, 0, room + size);
    all.push_back(d.add_body(d.any_shape(size), at));
    if (d.chance.one_in(3)) continue;
    const AddedBody* const other = i > 0 && !d.chance.one_in(5) ? &all[d.chance.below(i)] : nullptr;
    const Vec3 there =
        other != nullptr ? other->position_m : Vec3(at + size * d.chance.direction());
    const std::string type = d.chance.one_of(kTypes);
    JsonObject& joint =
        d.add_joint(type, all[i], other, type == "distance" ? at : Vec3(0.5 * (at + there)));
    joint.set("reach_m", "100000");
    if (type == "distance") joint.set("other_anchor_m", json_of(there));
    if (type == "hinge" || type == "slider") joint.set("axis", json_of(d.chance.direction()));
    if (type == "slider" || (type == "hinge" && d.chance.one_in(2))) {
      joint.set(type == "hinge" ? "min_angle_rad" : "min_way_m", json_of(-d.chance.between(0, 1.5)))
          .set(type == "hinge" ? "max_angle_rad" : "max_way_m", json_of(d.chance.between(0, 1.5)));
    }
    if (d.chance.one_in(4)) joint.set("can_collide", "true");
  }
}

}  // namespace

void add_jointed_idiom(SceneDraw& draw, std::uint32_t count, const Vec3& at_m) {
  constexpr Idiom kIdioms[] = {chain, chain, bridge, car, doll, sleds, machine, tangle};
  draw.chance.one_of(kIdioms)(draw, count, at_m);
}

}  // namespace soda::analysis
