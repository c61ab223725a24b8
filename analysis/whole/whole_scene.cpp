#include "analysis/whole/whole_scene.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/whole/scene_idioms.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

constexpr double kMostBodies = 300.0;
constexpr std::uint32_t kMostWorlds = 64;

std::string steps_of(SceneDraw& d) {
  return json_of(static_cast<int>(d.chance.powers(20.0, 400.0)));
}

void add_settings(SceneDraw& d) {
  JsonObject solver;
  if (d.chance.one_in(6)) solver.set("iterations", json_of(1 + d.chance.below(60)));
  if (d.chance.one_in(8))
    solver.set("restitution_threshold_m_s", json_of(d.plain(d.chance.powers(0.001, 1.0))));
  for (const char* key : {"warm_starting", "direct", "rest"})
    if (d.chance.one_in(10)) solver.set(key, "false");
  if (d.chance.one_in(40) && d.scene[ScenePart::kJoints].empty())
    solver.set("contact_response", "false");
  if (d.chance.one_in(20)) solver.set("broadphase", quoted("all-pairs"));
  if (d.chance.one_in(6)) solver.set("narrowphase", quoted(d.chance.one_in(2) ? "fcl" : "own"));
  if (d.chance.one_in(12)) solver.set("quality", quoted("fast"));
  if (!solver.fields.empty()) d.scene.head.set("solver", solver.text());
  if (d.chance.one_in(25)) d.scene.head.set("accuracy", "{\"tolerance\": 0.001}");
}

// So that a body's middle, face or corner lies on a corner, an edge or a face of cells.
Vec3 border_through(SceneDraw& d, double cell_m) {
  Vec3 place = d.corners_m[d.chance.below(static_cast<std::uint32_t>(d.corners_m.size()))];
  if (!d.bodies.empty() && d.chance.one_in(2)) {
    const AddedBody& body = d.bodies[d.chance.below(static_cast<std::uint32_t>(d.bodies.size()))];
    place = body.position_m;
    if (d.chance.one_in(2)) place += 0.5 * body.size_m;
  }
  for (int i = 0; i < 3; ++i)
    if (d.chance.one_in(3)) place[i] += cell_m * d.chance.between(0, 1);
  return place;
}

void add_territory(SceneDraw& d) {
  Vec3 low = d.corners_m.front(), high = low;
  for (const Vec3& corner : d.corners_m) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const double room = std::max((high - low).maxCoeff(), 0.5 * d.unit_m);
  const double cell = std::max(2e-3, d.plain(room / d.chance.powers(1.5, 12.0)));
  const Vec3 border = border_through(d, cell);
  constexpr int kMostCells = 24;
  std::string counts;
  Vec3 origin;
  double cells = 1.0;
  for (int i = 0; i < 3; ++i) {
    const double before = std::floor((border[i] - low[i]) / cell) + d.chance.below(2);
    const double count = std::clamp(std::floor((high[i] - low[i]) / cell) + 1.0 + d.chance.below(3),
                                    1.0, static_cast<double>(kMostCells));
    origin[i] = border[i] - cell * std::min(before, count);
    counts += (i > 0 ? ", " : "") + json_of(static_cast<int>(count));
    cells *= count;
  }
  constexpr std::uint32_t kWorlds[] = {1, 2, 2, 3, 4, 4, 5, 8, 8, 12, 16, 24, 48, kMostWorlds};
  const auto most = static_cast<std::uint32_t>(std::min(cells, 1e6));
  constexpr const char* kMaps[] = {"blocks", "paper", "k-means", "statics"};
  d.scene.cells = most;
  JsonObject territory;
  territory.set("origin_m", json_of(origin))
      .set("cell_size_m", json_of(cell))
      .set("cells", "[" + counts + "]")
      .set("worlds", json_of(std::min(most, d.chance.one_of(kWorlds))))
      .set("map", quoted(d.chance.one_of(kMaps)));
  if (d.chance.one_in(2)) territory.set("seed", json_of(d.chance.below(1000)));
  d.scene.head.set("territory", territory.text());
}

void add_execution(SceneDraw& d) {
  constexpr int kBuffers[] = {1, 2, 3, 5, 8, 16, 48, 48, 64};
  if (!d.chance.one_in(3)) d.scene.head.set("buffer_entries", json_of(d.chance.one_of(kBuffers)));
  constexpr int kThreads[] = {1, 2, 4};
  if (!d.chance.one_in(3))
    d.scene.head.set("executor", "{\"kind\": \"threads\", \"threads\": " +
                                     json_of(d.chance.one_of(kThreads)) + "}");
  if (d.chance.one_in(6)) {
    JsonObject balancing;
    balancing.set("policy", quoted(d.chance.one_in(2) ? "paper" : "random"))
        .set("interval_steps", json_of(1 + d.chance.below(12)))
        .set("seed", json_of(d.chance.below(100)));
    d.scene.head.set("balancing", balancing.text());
  }
}

// At steps where something is going on. Bodies that hang on joints stay.
void add_inputs(SceneDraw& d) {
  const auto joints = d.scene[ScenePart::kJoints];
  const std::uint32_t count = 1 + d.chance.below(12);
  for (std::uint32_t id = 0; id < count && !d.bodies.empty(); ++id) {
    const std::uint32_t place = d.chance.below(static_cast<std::uint32_t>(d.bodies.size()));
    const AddedBody& body = d.bodies[place];
    const bool held = std::ranges::any_of(joints, [&](const JsonObject& joint) {
      const std::string* const other = joint.find("other_body");
      const std::string name = json_of(body.id);
      return *joint.find("body") == name || (other != nullptr && *other == name);
    });
    JsonObject input;
    const auto begin = [&](const char* type) -> JsonObject& {
      return input.set("type", quoted(type))
          .set("id", json_of(id))
          .set("step", json_of(d.chance.below(60)))
          .set("body", json_of(body.id));
    };
    const double speed = d.length(0.1, 5.0);
    switch (d.chance.below(held ? 3 : 5)) {
      case 0:
        begin("push").set("impulse_newton_s",
                          json_of(Vec3(body.mass_kg * speed * d.chance.direction())));
        if (d.chance.one_in(2))
          input.set("point_m", json_of(Vec3(0.3 * body.size_m.minCoeff() * d.chance.direction())));
        break;
      case 1:
        begin("set-velocity").set("velocity_m_s", json_of(Vec3(speed * d.chance.direction())));
        break;
      case 2:
        begin("change-material")
            .set("friction", json_of(d.plain(d.chance.between(0, 1))))
            .set("restitution", json_of(d.plain(d.chance.between(0, 1))));
        break;
      case 3:
        begin("remove");
        break;
      default:
        if (d.chance.one_in(2)) d.scene[ScenePart::kBodies][place].set("present", "false");
        begin("add");
        if (d.chance.one_in(2))
          input.set("position_m", json_of(Vec3(body.position_m + Vec3(0, 0, d.length(1, 3)))));
    }
    d.scene[ScenePart::kInputs].push_back(std::move(input));
  }
}

// Some motors become servos, and some get another task on their way. Chances of their own: without
// motors, a scene is what it was.
void add_motor_tasks(SceneDraw& d) {
  Chance chance(d.seed, 13);
  auto next_id = static_cast<std::uint32_t>(d.scene[ScenePart::kInputs].size());
  for (JsonObject& joint : d.scene[ScenePart::kJoints]) {
    const bool turns = joint.find("motor_speed_rad_s") != nullptr;
    if (!turns && joint.find("motor_speed_m_s") == nullptr) continue;
    const char* const target = turns ? "motor_target_rad" : "motor_target_m";
    const auto within = [&](double share) {
      const std::string* const least = joint.find(turns ? "min_angle_rad" : "min_way_m");
      const std::string* const most = joint.find(turns ? "max_angle_rad" : "max_way_m");
      const double low = least != nullptr ? std::stod(*least) : -1.0;
      const double high = most != nullptr ? std::stod(*most) : 1.0;
      return json_of(low + share * (high - low));
    };
    if (chance.one_in(3)) {
      joint.set(target, within(chance.between(0, 1)));
      if (chance.one_in(2)) joint.set("motor_time_constant_s", json_of(chance.powers(1e-3, 1.0)));
    }
    if (!chance.one_in(3)) continue;
    JsonObject& input = d.scene[ScenePart::kInputs].emplace_back();
    input.set("type", quoted("set-motor"))
        .set("id", json_of(next_id++))
        .set("step", json_of(chance.below(60)))
        .set("joint", *joint.find("id"));
    if (chance.one_in(2))
      input.set(target, within(chance.between(0, 1)));
    else
      input.set(turns ? "motor_speed_rad_s" : "motor_speed_m_s", json_of(chance.between(-5, 5)));
  }
}

// Some joints can break, at loads about the weights that they hold. Chances of their own, too.
void add_breaking_joints(SceneDraw& d) {
  Chance chance(d.seed, 16);
  if (!chance.one_in(3)) return;
  for (JsonObject& joint : d.scene[ScenePart::kJoints]) {
    const auto body = std::ranges::find(d.bodies, *joint.find("body"),
                                        [](const AddedBody& b) { return json_of(b.id); });
    if (body == d.bodies.end() || !chance.one_in(2)) continue;
    const double weight = body->mass_kg * std::max(d.gravity_m_s2, 0.1);
    joint.set("break_force_newton", json_of(d.plain(weight * chance.powers(0.1, 300.0))));
    const std::string& type = *joint.find("type");
    if (type != quoted("hinge") && type != quoted("slider") && type != quoted("fixed")) continue;
    if (chance.one_in(2))
      joint.set("break_torque_newton_m",
                json_of(d.plain(weight * body->size_m.maxCoeff() * chance.powers(0.1, 300.0))));
  }
}

void add_idioms(SceneDraw& d) {
  const std::uint32_t idioms = d.chance.one_in(3) ? 2 + d.chance.below(2) : 1;
  for (std::uint32_t i = 0; i < idioms && d.bodies_left() > 0; ++i) {
    const Vec3 at(d.length(2.0, 4.0) * i, d.length(-1.0, 1.0) * i, 0.0);
    add_idiom(d, std::max(1u, d.bodies_left() / (idioms - i)), at);
  }
}

}  // namespace

WholeScene draw_whole_scene(std::uint64_t seed) {
  Chance size(seed, 12);
  SceneDraw d(seed, static_cast<std::uint32_t>(size.powers(1.0, kMostBodies + 1.0)));
  JsonObject& head = d.scene.head;
  head.set("format", "1")
      .set("description", quoted("Whole random scene of seed " + std::to_string(seed)))
      .set("gravity_m_s2", json_of(Vec3(0, 0, 0.0 - d.gravity_m_s2)))
      .set("time_step_s", json_of(d.time_step_s))
      .set("steps", steps_of(d));
  add_ground(d);
  add_idioms(d);
  add_settings(d);
  if (d.chance.one_in(4)) add_inputs(d);
  add_motor_tasks(d);
  add_breaking_joints(d);
  if (!d.chance.one_in(12)) add_territory(d);
  add_execution(d);
  return d.scene;
}

}  // namespace soda::analysis
