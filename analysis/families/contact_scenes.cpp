// Boxes and plates that slide, stacks, piles.
#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/families/family_scene.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

struct SlidingRow {
  double friction = 0.3;
  double mass_ratio = 1.0;
  bool is_pile = false;  // plates on each other, else boxes side by side
};

constexpr double kSlidingSpeed_m_s = 3.0, kPlate_m = 0.02;

// All stop where one alone does: v^2 / (2 mu g).
FamilyScene sliding_row(const SlidingRow& row, int n) {
  FamilyScene scene = scene_under_gravity();
  // Plates hold each other more than the floor does: they slide as one.
  const physics::Material material{.friction = row.is_pile ? 4.0 * row.friction : row.friction};
  add_floor(scene, {.friction = row.friction * row.friction / material.friction});
  const std::uint32_t shape = add_shape(
      scene, physics::Box{row.is_pile ? Vec3(0.5, 0.5, 0.5 * kPlate_m) : Vec3::Constant(0.5)});
  for (int i = 0; i < n; ++i)
    add_body(scene, shape, row.is_pile ? Vec3(0, 0, (0.5 + i) * kPlate_m) : Vec3(0, i, 0.5),
             graded_mass_kg(i, n, row.mass_ratio), material)
        .linear_velocity_m_s = Vec3(kSlidingSpeed_m_s, 0, 0);
  const double slowing = row.friction * kFamilyGravity_m_s2;
  scene.steps = 2 + static_cast<std::int64_t>(kSlidingSpeed_m_s / slowing / kFamilyStep_s);
  const double way_m = 0.5 * kSlidingSpeed_m_s * kSlidingSpeed_m_s / slowing;
  scene.judge = [way_m](const FamilyView& view) {
    std::vector<double> off{0.0, 0.0};
    if (!view.last) return off;
    for (const physics::BodyState& state : view.states) {
      off[0] = std::max(off[0], std::abs(state.position_m.x() - way_m));
      off[1] = std::max(off[1], state.linear_velocity_m_s.norm());
    }
    return off;
  };
  return scene;
}

Family sliding_row_family() {
  Family family;
  family.name = "sliding-row";
  family.scene = "n boxes of 1 m side by side, or n plates of 2 cm on each other, slide at 3 m/s";
  family.measures = {
      {"stopping place off, m", "against v^2 / (2 mu g)", 1e-3, 1e-8,
       "1e-8 of a way of metres: what closing in upon the stop leaves"},
      {"speed left, m/s", "", 1e-3, 1e-8, "solvers end at 1e-9 of the largest velocity"}};
  family.sizes = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 16, 20, 25, 32, 40, 50, 63, 64, 65, 80, 100};
  family.full_sizes = {128, 160, 200};
  const auto add = [&](const std::string& name, const SlidingRow& row) {
    family.series.push_back({name, [row](int n) { return sliding_row(row, n); }});
  };
  add("beside, mu .3", {0.3, 1.0, false});
  add("beside, mu .8", {0.8, 1.0, false});
  add("beside, 1:1000", {0.3, 1000.0, false});
  add("plates, mu .2", {0.2, 1.0, true});
  add("plates, 1:100", {0.2, 100.0, true});
  return family;
}

// Boxes of 1 m that stay where they are.
FamilyScene stack(double mass_ratio, int n) {
  FamilyScene scene = scene_under_gravity();
  add_floor(scene, {});
  const std::uint32_t box = add_shape(scene, physics::Box{Vec3::Constant(0.5)});
  for (int i = 0; i < n; ++i)
    add_body(scene, box, Vec3(0, 0, 0.5 + i), graded_mass_kg(i, n, mass_ratio));
  scene.steps = 120;
  scene.judge = [start = scene.states](const FamilyView& view) {
    double speed = 0.0;
    if (view.last)
      for (const physics::BodyState& state : view.states)
        speed = std::max(speed, state.linear_velocity_m_s.norm());
    return std::vector<double>{largest_way_m(view, start), speed};
  };
  return scene;
}

Family stack_family() {
  Family family;
  family.name = "stack";
  family.scene = "n boxes of 1 m on each other, 2 s; 1:1000: the top is 1000 times as heavy";
  family.measures = {{"way of a box, of its width", "the largest", 1e-3, 1e-6,
                      "what rests is held to 1e-8 of its load, which moves it so far in 2 s"},
                     {"speed at the end, m/s", "", 1e-3, 1e-7, "what rest takes for none"}};
  family.sizes = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 16, 20, 25, 32, 40, 50};
  family.full_sizes = {63, 64, 65, 80, 100};
  for (const double ratio : {1.0, 10.0, 1000.0, 0.001})
    family.series.push_back({ratio == 1.0  ? "equal"
                             : ratio < 1.0 ? "1000:1"
                                           : "1:" + std::to_string(int(ratio)),
                             [ratio](int n) { return stack(ratio, n); }});
  return family;
}

constexpr double kPileWidth_m = 0.2;

// In a bin as wide as it is filled high, from a lattice, turned at random.
FamilyScene pile(bool of_boxes, int n) {
  FamilyScene scene = scene_under_gravity();
  constexpr double kApart_m = 1.15 * kPileWidth_m;
  // No whole number of bodies: no n is special.
  const double half_m = 0.5 * kApart_m * std::cbrt(n);
  const int side = static_cast<int>(std::cbrt(n + 0.5));
  const double column_m = 2.0 * half_m / side;
  add_floor(scene, {});
  for (const Vec3& normal : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)}) {
    physics::StaticBody wall;
    wall.shape = add_shape(scene, physics::HalfSpace{normal, -half_m});
    scene.scene.statics.push_back(wall);
  }
  const physics::Shape solid =
      of_boxes ? physics::Shape(physics::Box{Vec3::Constant(0.5 * kPileWidth_m)})
               : physics::Shape(physics::Sphere{0.5 * kPileWidth_m});
  const std::uint32_t shape = add_shape(scene, solid);
  std::mt19937_64 random(1);
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
  for (int i = 0; i < n; ++i) {
    const int layer = i / (side * side);
    const Vec3 cell(i % side + 0.5, i / side % side + 0.5, layer + 0.5);
    const Vec3 place = cell.cwiseProduct(Vec3(column_m, column_m, kApart_m)) -
                       Vec3(half_m, half_m, 0.0) + 0.005 * Vec3(unit(), unit(), unit());
    add_body(scene, shape, place, 1.0).orientation =
        physics::Quat(1.0, 0.05 * unit(), 0.05 * unit(), 0.05 * unit()).normalized();
  }
  scene.steps = 90;
  scene.judge = [steps = scene.steps](const FamilyView& view) {
    double deepest_m = 0.0;
    if (view.step > steps - 30)
      for (const physics::IslandReport& island : view.report.islands)
        deepest_m = std::max(deepest_m, island.max_penetration_m);
    return std::vector<double>{deepest_m / kPileWidth_m};
  };
  return scene;
}

Family pile_family() {
  Family family;
  family.name = "pile";
  family.scene =
      "n balls or boxes of .2 m fall from a lattice into a bin as wide as it is full, "
      "1.5 s; the last .5 s count";
  family.measures = {{"overlap, of a width", "the deepest", 2e-2, 2e-3,
                      "overlap up to 5e-4 is left alone, and the deepest of random points is "
                      "told apart by chance below four times that"}};
  family.sizes = {8,  9,  10,  12,  16,  20,  27,  32,  40,  50,  63,  64,
                  65, 80, 100, 128, 160, 200, 255, 256, 257, 320, 400, 512};
  family.full_sizes = {640,  800,  1000, 1001, 1280,  1600,  2000,  2560, 3200,
                       4000, 5000, 6400, 8000, 10000, 12800, 16000, 20000};
  family.series = {{"balls", [](int n) { return pile(false, n); }},
                   {"boxes", [](int n) { return pile(true, n); }}};
  return family;
}

}  // namespace

std::vector<Family> contact_families() {
  return {sliding_row_family(), stack_family(), pile_family()};
}

}  // namespace soda::analysis
