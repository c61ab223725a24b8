// Idioms without joints.
#include <algorithm>
#include <cmath>

#include "analysis/whole/scene_idioms.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

Vec3 on_floor(const Vec3& at_m, double x, double y, double z) {
  return Vec3(at_m.x() + x, at_m.y() + y, z);
}

double edge_of(SceneDraw& d) { return d.length(0.1, 1.0); }

JsonObject turned(SceneDraw& d) {
  JsonObject more;
  if (!d.chance.one_in(3)) more.set("orientation", json_of(d.chance.rotation()));
  return more;
}

void pour(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double size = edge_of(d);
  const std::uint32_t across = 1 + d.chance.below(4);
  const double room = size * across * d.chance.between(1.0, 1.6);
  if (!d.chance.one_in(3)) {
    const double thick = 0.2 * d.unit_m, half = 0.5 * (room + thick) + size;
    for (const Vec3& side : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)}) {
      const Vec3 wall = side.x() != 0.0 ? Vec3(thick, 2.0 * half, 2.0 * half)
                                        : Vec3(2.0 * half, thick, 2.0 * half);
      d.add_static(box_shape(wall).object, on_floor(at_m + half * side, 0, 0, half));
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const double layer = std::floor(static_cast<double>(i) / (across * across));
    const auto place = [&](std::uint32_t k) {
      return (k + 0.5) * room / across - 0.5 * room + 0.05 * size * d.chance.between(-1.0, 1.0);
    };
    d.add_body(d.any_shape(size),
               on_floor(at_m, d.plain(place(i % across)), d.plain(place(i / across % across)),
                        size * (1.0 + 1.1 * layer)),
               turned(d));
  }
}

void pile(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double size = edge_of(d);
  const double room = size * std::cbrt(static_cast<double>(count)) * d.chance.between(0.6, 1.2);
  for (std::uint32_t i = 0; i < count; ++i)
    d.add_body(d.any_shape(size),
               on_floor(at_m, d.plain(room * d.chance.between(-1, 1)),
                        d.plain(room * d.chance.between(-1, 1)),
                        size * 0.6 + room * d.chance.between(0, 1)),
               turned(d));
}

void stack(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = edge_of(d), gap = d.chance.one_in(3) ? d.length(0.0, 0.05) : 0.0;
  const DrawnShape shape =
      d.chance.one_in(4) ? cylinder_shape(0.5 * edge, edge) : box_shape(Vec3(edge, edge, edge));
  const std::uint32_t stacks = 1 + d.chance.below(3);
  for (std::uint32_t s = 0; s < stacks; ++s) {
    const Vec3 at = on_floor(at_m, 1.5 * edge * s, 0, 0.5 * edge);
    const std::uint32_t high = std::min(40u, std::max(1u, count / stacks));
    if (d.chance.one_in(2)) {
      JsonObject rule;
      rule.set("type", quoted("stack")).set("first_id", json_of(d.take_ids(high)));
      for (auto& [key, value] : d.solid(shape).fields) rule.set(key, value);
      rule.set("count", json_of(high)).set("gap_m", json_of(gap)).set("position_m", json_of(at));
      d.scene[ScenePart::kGenerators].push_back(std::move(rule));
      d.corners_m.push_back(at + Vec3(0, 0, edge * high));
      d.corners_m.push_back(at);
    } else {
      for (std::uint32_t i = 0; i < high; ++i) d.add_body(shape, at + Vec3(0, 0, i * (edge + gap)));
    }
  }
}

void wall(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = edge_of(d);
  const std::uint32_t columns = std::max(1u, std::min(10u, count / 2));
  const DrawnShape brick = box_shape(Vec3(0.5 * edge, edge, 0.5 * edge));
  for (std::uint32_t i = 0; i + 1 < count; ++i) {
    const std::uint32_t row = i / columns;
    const double along = (i % columns + (row % 2 == 1 ? 0.5 : 0.0)) * edge;
    d.add_body(brick, on_floor(at_m, 0, along, (row + 0.5) * 0.5 * edge));
  }
  JsonObject flying;
  flying.set("velocity_m_s", json_of(Vec3(d.length(2, 20), 0, 0)));
  d.add_body(sphere_shape(edge), on_floor(at_m, -4.0 * edge, 0.5 * columns * edge, 1.2 * edge),
             flying);
}

void row(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = edge_of(d);
  const bool touching = !d.chance.one_in(3);
  const double step = touching ? edge : edge * 1.25;
  const DrawnShape shape =
      d.chance.one_in(2) ? sphere_shape(0.5 * edge) : box_shape(Vec3(edge, edge, edge));
  const std::string stuff = d.material();
  const bool raised = d.chance.one_in(3);
  for (std::uint32_t i = 0; i < count; ++i) {
    JsonObject more;
    more.set("material", stuff);
    if (i == 0) more.set("velocity_m_s", json_of(Vec3(d.length(0.5, 5), 0, 0)));
    const double x = i * step - (i == 0 ? step : 0.0);
    d.add_body(shape, on_floor(at_m, x, 0, raised ? 2.0 * edge : 0.5 * edge), more);
  }
}

void gas(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = edge_of(d);
  const double room = edge * 2.0 * std::cbrt(static_cast<double>(count) + 1.0);
  const Vec3 middle = on_floor(at_m, 0, 0, room + edge);
  JsonObject rule;
  rule.set("type", quoted(d.chance.one_in(3) ? "random" : "gas"))
      .set("first_id", json_of(d.take_ids(count)));
  for (auto& [key, value] : d.solid(d.any_shape(edge)).fields) rule.set(key, value);
  rule.set("count", json_of(count))
      .set("region_min_m", json_of(Vec3(middle - Vec3::Constant(room))))
      .set("region_max_m", json_of(Vec3(middle + Vec3::Constant(room))))
      .set("seed", json_of(d.chance.below(1000)));
  if (*rule.find("type") == quoted("gas"))
    rule.set("max_speed_m_s", json_of(d.length(0.1, 10)))
        .set("max_spin_rad_s", json_of(d.plain(d.chance.between(0, 10))));
  d.scene[ScenePart::kGenerators].push_back(std::move(rule));
  d.corners_m.push_back(middle - Vec3::Constant(room));
  d.corners_m.push_back(middle + Vec3::Constant(room));
}

void lattice(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = edge_of(d);
  const std::uint32_t side = std::max(1u, static_cast<std::uint32_t>(std::cbrt(count)));
  const bool pyramid = d.chance.one_in(2);
  const std::uint32_t rows = std::max(
      1u, static_cast<std::uint32_t>(std::sqrt(2.0 * static_cast<double>(count) + 0.25) - 0.5));
  JsonObject rule;
  rule.set("type", quoted(pyramid ? "pyramid" : "grid"))
      .set("first_id", json_of(d.take_ids(pyramid ? rows * (rows + 1) / 2 : side * side * side)));
  for (auto& [key, value] : d.solid(box_shape(Vec3(edge, edge, edge))).fields) rule.set(key, value);
  const double step = edge * (d.chance.one_in(2) ? 1.0 : d.chance.between(1.0, 1.5));
  const Vec3 at = on_floor(at_m, 0, 0, 0.5 * edge);
  if (pyramid)
    rule.set("rows", json_of(rows));
  else
    rule.set("count", "[" + json_of(side) + ", " + json_of(side) + ", " + json_of(side) + "]")
        .set("spacing_m", json_of(Vec3(step, step, step)));
  rule.set("position_m", json_of(at));
  d.scene[ScenePart::kGenerators].push_back(std::move(rule));
  d.corners_m.push_back(at);
  d.corners_m.push_back(at + Vec3::Constant(step * (pyramid ? rows : side)));
}

void belt(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double edge = edge_of(d), length = edge * (4.0 + count);
  JsonObject moving;
  moving.set("surface_velocity_m_s", json_of(Vec3(d.length(0.5, 4), 0, 0)));
  if (d.chance.one_in(3))
    moving.set("orientation", "{\"axis\": [0, 1, 0], \"angle_deg\": " +
                                  json_of(d.plain(d.chance.between(-20, 20))) + "}");
  d.add_static(box_shape(Vec3(length, 4.0 * edge, edge)).object, on_floor(at_m, 0, 0, 2.0 * edge),
               moving);
  for (std::uint32_t i = 0; i < count; ++i)
    d.add_body(d.any_shape(edge),
               on_floor(at_m, -0.4 * length + 1.1 * edge * (i % 8),
                        edge * d.chance.between(-1.0, 1.0), edge * (3.5 + 1.2 * (i / 8.0))),
               turned(d));
}

void flying(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double size = edge_of(d);
  for (std::uint32_t i = 0; i < count; ++i) {
    JsonObject more = turned(d);
    if (!d.chance.one_in(4))
      more.set("velocity_m_s", json_of(Vec3(d.length(0.1, 10) * d.chance.direction())));
    if (d.chance.one_in(2))
      more.set("angular_velocity_rad_s",
               json_of(Vec3(d.chance.powers(0.1, 50) * d.chance.direction())));
    d.add_body(d.any_shape(size),
               on_floor(at_m, d.length(0, 4) - 2.0 * d.unit_m, d.length(0, 4) - 2.0 * d.unit_m,
                        size + d.length(0, 3)),
               more);
  }
}

void people(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  const double radius = d.length(0.2, 0.5);
  const std::string name = quoted("drive " + std::to_string(d.chance.below(100000)));
  JsonObject drive;
  drive.set("name", name);
  if (d.chance.one_in(2))
    drive.set("velocity_m_s", json_of(Vec3(d.length(0.5, 2), d.length(0, 1), 0)));
  else
    drive
        .set("way_points_m", "[" + json_of(on_floor(at_m, -2.0 * d.unit_m, 0, 0)) + ", " +
                                 json_of(on_floor(at_m, 2.0 * d.unit_m, 0, 0)) + ", " +
                                 json_of(on_floor(at_m, 2.0 * d.unit_m, 5.0 * d.unit_m, 0)) + "]")
        .set("speed_m_s", json_of(d.length(0.5, 3)))
        .set("half_width_m", json_of(d.length(0.2, 2)));
  drive.set("time_constant_s", "0.5").set("max_acceleration_m_s2", json_of(d.length(1, 10)));
  d.scene[ScenePart::kDrives].push_back(std::move(drive));
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t row = i / 6;
    JsonObject more;
    more.set("drive", name);
    d.add_body(sphere_shape(radius),
               on_floor(at_m, (i % 6) * 2.2 * radius, row * 2.1 * radius, radius), more);
  }
}

// Few bodies with everything that a body can have.
void pushed(SceneDraw& d, std::uint32_t count, const Vec3& at_m) {
  for (std::uint32_t i = 0; i < std::min(count, 5u); ++i) {
    const DrawnShape shape = d.any_shape(edge_of(d));
    const double weight = 9.81 * 1000.0 * shape.volume_m3;
    JsonObject more = turned(d);
    const auto some = [&](const char* key, double most) {
      if (d.chance.one_in(2)) more.set(key, json_of(Vec3(most * d.chance.direction())));
    };
    some("force_newton", weight * d.chance.powers(0.01, 1.5));
    some("body_force_newton", weight * d.chance.powers(0.01, 1.0));
    some("torque_newton_m", weight * d.unit_m * d.chance.powers(0.001, 0.3));
    if (d.chance.one_in(2))
      more.set("linear_damping_1_s", json_of(d.plain(d.chance.powers(0.01, 10))));
    if (d.chance.one_in(2))
      more.set("angular_damping_1_s", json_of(d.plain(d.chance.powers(0.01, 10))));
    d.add_body(shape, on_floor(at_m, 1.5 * d.unit_m * i, 0, d.length(0.3, 2)), more);
  }
}

}  // namespace

void add_loose_idiom(SceneDraw& draw, std::uint32_t count, const Vec3& at_m) {
  constexpr Idiom kIdioms[] = {pour, pour,    pile, stack,  wall,   row,
                               gas,  lattice, belt, flying, people, pushed};
  draw.chance.one_of(kIdioms)(draw, count, at_m);
}

}  // namespace soda::analysis
