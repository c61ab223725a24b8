// Chains, stars and grids of ball joints.
#include <algorithm>
#include <cmath>

#include "analysis/families/family_scene.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

constexpr double kLink_m = 0.2, kLinkHalfWidth_m = 0.025, kReach_m = 0.25 * kLink_m;
constexpr double kAngle_rad = 0.5;  // of what is let go

// Gap of joints, of a link; energy, of what falling through the whole length would give.
std::function<std::vector<double>(const FamilyView&)> linkage_judge(double fall_joule,
                                                                    double start_joule) {
  return [fall_joule, start_joule](const FamilyView& view) {
    return std::vector<double>{largest_joint_gap_m(view) / kLink_m,
                               std::abs(energy_joule(view) - start_joule) / fall_joule};
  };
}

// All bodies pass through each other; `length_m` of the whole.
void judge_linkage(double length_m, FamilyScene& scene) {
  physics::order_joints(scene.scene);
  let_pass_through(scene);
  std::vector<physics::BodyId> ids;
  double mass_kg = 0.0;
  for (std::uint32_t i = 0; i < scene.states.size(); ++i) {
    ids.push_back(physics::BodyId{i});
    mass_kg += scene.scene.bodies[i].mass_kg;
  }
  const double start_joule = energy_joule({scene.scene, ids, scene.states, {}, 0, false});
  scene.judge = linkage_judge(mass_kg * kFamilyGravity_m_s2 * length_m, start_joule);
}

std::vector<FamilyMeasure> linkage_measures() {
  return {{"gap of a joint, of a link", "the largest", 1e-9, 1e-12, "rounding of places of 100 m"},
          {"energy off", "of what falling through the whole length gives", 1e-3, 1e-6,
           "a thousandth of what a case of a chain must reach"}};
}

struct HangingChain {
  double mass_ratio = 1.0;  // of the last link
  double angle_rad = kAngle_rad;
  bool is_graded = true;  // masses grow along the chain; else the last link is the only heavy one
};

FamilyScene hanging_chain(const HangingChain& chain, int n) {
  FamilyScene scene = scene_under_gravity();
  const std::uint32_t link =
      add_shape(scene, physics::Box{Vec3(kLinkHalfWidth_m, kLinkHalfWidth_m, 0.5 * kLink_m)});
  const Vec3 along(std::sin(chain.angle_rad), 0.0, -std::cos(chain.angle_rad));
  const Quat turned = physics::turn_between(-Vec3::UnitZ(), along);
  for (int i = 0; i < n; ++i) {
    const double last_kg = i + 1 == n ? chain.mass_ratio : 1.0;
    add_body(scene, link, (i + 0.5) * kLink_m * along,
             chain.is_graded ? graded_mass_kg(i, n, chain.mass_ratio) : last_kg)
        .orientation = turned;
  }
  for (int i = 0; i < n; ++i) {
    const auto a = static_cast<std::uint32_t>(i == 0 ? 0 : i - 1);
    add_ball_joint(scene, a, i == 0 ? std::nullopt : std::optional(static_cast<std::uint32_t>(i)),
                   i * kLink_m * along, kReach_m);
  }
  scene.steps = 60;
  judge_linkage(n * kLink_m, scene);
  return scene;
}

Family hanging_chain_family() {
  Family family;
  family.name = "hanging-chain";
  family.scene =
      "n links of .2 m hang from the world, 1 s: at rest, or let go half a radian off "
      "straight";
  family.measures = linkage_measures();
  family.sizes = {2,  3,  4,  5,  6,  7,  8,   9,   10,  12,  16,  20,  25, 32,
                  40, 50, 63, 64, 65, 80, 100, 128, 160, 200, 255, 256, 257};
  family.full_sizes = {320, 400, 500};
  const auto add = [&](const std::string& name, const HangingChain& chain) {
    family.series.push_back({name, [chain](int n) { return hanging_chain(chain, n); }});
  };
  add("at rest", {1.0, 0.0});
  add("let go", {1.0});
  add("let go, 1:100", {100.0});
  add("let go, 100:1", {0.01});
  add("let go, 1000 kg", {1000.0, kAngle_rad, false});
  return family;
}

// Straight, on a floor.
FamilyScene lying_chain(double mass_ratio, int n) {
  FamilyScene scene = scene_under_gravity();
  add_floor(scene, {});
  const std::uint32_t link =
      add_shape(scene, physics::Box{Vec3(0.5 * kLink_m, kLinkHalfWidth_m, kLinkHalfWidth_m)});
  for (int i = 0; i < n; ++i)
    add_body(scene, link, Vec3((i + 0.5) * kLink_m, 0, kLinkHalfWidth_m),
             graded_mass_kg(i, n, mass_ratio));
  for (int i = 1; i < n; ++i)
    add_ball_joint(scene, static_cast<std::uint32_t>(i - 1), static_cast<std::uint32_t>(i),
                   Vec3(i * kLink_m, 0, kLinkHalfWidth_m), kReach_m);
  physics::order_joints(scene.scene);
  scene.steps = 60;
  scene.judge = [start = scene.states](const FamilyView& view) {
    return std::vector<double>{largest_joint_gap_m(view) / kLink_m,
                               largest_way_m(view, start) / kLink_m};
  };
  return scene;
}

Family lying_chain_family() {
  Family family;
  family.name = "lying-chain";
  family.scene = "n links of .2 m lie straight on a floor, 1 s";
  family.measures = {
      {"gap of a joint, of a link", "the largest", 1e-6, 1e-9, "rounding of its solution"},
      {"way of a link, of its length", "the largest", 1e-3, 1e-6,
       "what rests is held to 1e-8 of its load, which moves it so far in 1 s"}};
  family.sizes = {2,  3,  4,  5,  6,  7,  8,   9,   10,  12,  16,  20,  25, 32,
                  40, 50, 63, 64, 65, 80, 100, 128, 160, 200, 255, 256, 257};
  family.full_sizes = {320, 400, 500};
  family.series = {{"equal", [](int n) { return lying_chain(1.0, n); }},
                   {"1:100", [](int n) { return lying_chain(100.0, n); }}};
  return family;
}

// n links around a ball that the world holds at its centre, in a plane; all of them fall.
FamilyScene star(double hub_kg, int n) {
  constexpr double kHub_m = 0.1, kTurn_rad = 6.283185307179586;
  FamilyScene scene = scene_under_gravity();
  const std::uint32_t hub = add_shape(scene, physics::Sphere{kHub_m});
  const std::uint32_t link =
      add_shape(scene, physics::Box{Vec3(0.5 * kLink_m, kLinkHalfWidth_m, kLinkHalfWidth_m)});
  add_body(scene, hub, Vec3::Zero(), hub_kg);
  for (int i = 0; i < n; ++i) {
    const double angle = kTurn_rad * i / n;
    const Vec3 out(std::cos(angle), std::sin(angle), 0.0);
    add_body(scene, link, (kHub_m + 0.5 * kLink_m) * out, 1.0).orientation =
        Quat(std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle));
    add_ball_joint(scene, 0, static_cast<std::uint32_t>(i + 1), kHub_m * out, kReach_m);
  }
  add_ball_joint(scene, 0, std::nullopt, Vec3::Zero(), kReach_m);
  scene.steps = 60;
  judge_linkage(kLink_m, scene);
  return scene;
}

Family star_family() {
  Family family;
  family.name = "star";
  family.scene = "n links of .2 m around a ball that the world holds, all let go level, 1 s";
  family.measures = linkage_measures();
  family.sizes = {2,  3,  4,  5,  6,  7,  8,  9,  10,  12,  16,  20,
                  25, 32, 40, 50, 63, 64, 65, 80, 100, 128, 160, 200};
  family.full_sizes = {255, 256, 257, 320, 400, 500};
  family.series = {{"hub 1 kg", [](int n) { return star(1.0, n); }},
                   {"hub 100 kg", [](int n) { return star(100.0, n); }}};
  return family;
}

// n x n plates, jointed at the middles of their edges, hang from the edge above; `angle_rad` off.
FamilyScene grid(double angle_rad, int n) {
  FamilyScene scene = scene_under_gravity();
  const std::uint32_t plate =
      add_shape(scene, physics::Box{Vec3(0.5 * kLink_m, kLinkHalfWidth_m, 0.5 * kLink_m)});
  const Vec3 down(0.0, std::sin(angle_rad), -std::cos(angle_rad));
  const Quat turned = physics::turn_between(-Vec3::UnitZ(), down);
  const auto place = [&](double column, double row) -> Vec3 {
    return kLink_m * (column * Vec3::UnitX() + row * down);
  };
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column)
      add_body(scene, plate, place(column, row + 0.5), 1.0).orientation = turned;
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column) {
      const auto body = static_cast<std::uint32_t>(row * n + column);
      const auto below = static_cast<std::uint32_t>(body + static_cast<std::uint32_t>(n));
      if (row == 0) add_ball_joint(scene, body, std::nullopt, place(column, 0), kReach_m);
      if (row + 1 < n) add_ball_joint(scene, body, below, place(column, row + 1), kReach_m);
      if (column + 1 < n)
        add_ball_joint(scene, body, body + 1, place(column + 0.5, row + 0.5), kReach_m);
    }
  scene.steps = 10;
  judge_linkage(n * kLink_m, scene);
  return scene;
}

Family grid_family() {
  Family family;
  family.name = "grid";
  family.scene =
      "n x n plates of .2 m with ball joints at the middles of their edges, hanging "
      "from the upper rim, 10 steps: at rest, or let go half a radian off";
  family.measures = linkage_measures();
  family.sizes = {2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16};
  family.full_sizes = {17, 20, 25, 32, 40, 50, 63, 64, 65, 80, 100};
  family.series = {{"at rest", [](int n) { return grid(0.0, n); }},
                   {"let go", [](int n) { return grid(kAngle_rad, n); }}};
  return family;
}

}  // namespace

std::vector<Family> joint_families() {
  return {hanging_chain_family(), lying_chain_family(), star_family(), grid_family()};
}

}  // namespace soda::analysis
