// What rows of bodies cost and are off by, by their number: no number is special. Prints a table:
// `physics_event_rows [largest number]`.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tests/physics/scenes.hpp"

namespace {

using namespace soda::physics;
using test::kGravity;
using test::World;

constexpr double kGap_m = 0.0015;

double now_ms() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Cost {
  double worst_ms = 0.0, all_ms = 0.0;
};

Cost run_timed(World& world, int steps) {
  const Geometry geometry(world.scene);
  Cost cost;
  for (int i = 0; i < steps; ++i) {
    const double before = now_ms();
    world.run(1, geometry);
    const double took = now_ms() - before;
    cost.all_ms += took;
    cost.worst_ms = std::max(cost.worst_ms, took);
  }
  return cost;
}

// A ball comes at 1 m/s to a row of n - 1.
World ball_row(int n, double gap_m, double restitution, bool on_floor, double dt_s) {
  const Material material{.friction = 0.0, .restitution = restitution};
  World world;
  if (on_floor) world = test::under_gravity();
  world.scene.dt_s = dt_s;
  if (on_floor) world.add_floor(material);
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(-0.2075, 0, 0.1), 1000.0, material).linear_velocity_m_s = Vec3(1, 0, 0);
  for (int i = 0; i + 1 < n; ++i)
    world.add_body(ball, Vec3((0.2 + gap_m) * i, 0, 0.1), 1000.0, material);
  return world;
}

// Of the speeds once all that can be hit has been: 1 for elastic ones at the end of the row.
void print_balls(int n, double gap_m, double restitution, bool on_floor) {
  constexpr double kStep_s = 1.0 / 60;
  World world = ball_row(n, gap_m, restitution, on_floor, kStep_s);
  const double passed_s = 0.0075 + gap_m * n;
  const Cost cost = run_timed(world, 2 + static_cast<int>(std::ceil(passed_s / kStep_s)));
  double momentum = 0.0, energy = 0.0, others = 0.0;
  for (std::size_t i = 0; i < world.states.size(); ++i) {
    const double v = world.states[i].linear_velocity_m_s.x();
    momentum += v;
    energy += v * v;
    if (i + 1 < world.states.size()) others = std::max(others, std::abs(v));
  }
  std::printf(
      "%-6s %-8s e %.1f n %4d  last %.9f others %.2e momentum-1 %9.2e energy %.6f  ms per "
      "body %.4f worst step %.4f impacts %llu\n",
      on_floor ? "floor" : "flight", gap_m > 0.0 ? "spaced" : "touching", restitution, n,
      world.states.back().linear_velocity_m_s.x(), others, momentum - 1.0, energy, cost.all_ms / n,
      cost.worst_ms / n, static_cast<unsigned long long>(world.counters.impacts));
}

// Boxes side by side, one way; how far off they stop.
void print_boxes(int n, double friction, double speed_m_s, double dt_s, double pushed_newton) {
  const Material material{.friction = friction};
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  world.add_floor(material);
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < n; ++i)
    world.add_body(box, Vec3(0, i, 0.5), 1000.0, material).linear_velocity_m_s =
        Vec3(speed_m_s, 0, 0);
  for (BodyParams& body : world.scene.bodies)
    body.own_field_m_s2 = Vec3(pushed_newton / body.mass_kg, 0, 0);
  const double slowing = friction * kGravity;
  const int steps = 2 + static_cast<int>(speed_m_s / slowing / dt_s);
  const Cost cost = run_timed(world, steps);
  double off = 0.0, left = 0.0;
  for (const BodyState& state : world.states) {
    const double distance = 0.5 * speed_m_s * speed_m_s / slowing;
    off = std::max(off, std::abs(state.position_m.x() - distance));
    left = std::max(left, state.linear_velocity_m_s.norm());
  }
  std::printf(
      "boxes  mu %.1f v %.1f dt 1/%.0f push %.0e n %4d  off %.2e m  left %.1e m/s  ms per "
      "body and step %.4f worst step %.4f\n",
      friction, speed_m_s, 1.0 / dt_s, pushed_newton, n, off, left, cost.all_ms / n / steps,
      cost.worst_ms / n);
}

// Plates on each other, which slide as one; how far off they stop.
void print_plates(int n, double dt_s) {
  constexpr double kSpeed = 2.0, kFriction = 0.2, kThick_m = 0.02;
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  world.add_floor({.friction = 0.05});
  const double friction = std::sqrt(0.05 * 0.8);
  const std::uint32_t plate = world.add_shape(Box{Vec3(0.5, 0.5, 0.5 * kThick_m)});
  for (int i = 0; i < n; ++i)
    world.add_body(plate, Vec3(0, 0, (0.5 + i) * kThick_m), 1000.0, {.friction = 0.8})
        .linear_velocity_m_s = Vec3(kSpeed, 0, 0);
  const double slowing = friction * kGravity;
  const int steps = 2 + static_cast<int>(kSpeed / slowing / dt_s);
  const Cost cost = run_timed(world, steps);
  double off = 0.0;
  for (const BodyState& state : world.states)
    off = std::max(off, std::abs(state.position_m.x() - 0.5 * kSpeed * kSpeed / slowing));
  std::printf(
      "plates mu %.1f dt 1/%.0f n %4d  off %.2e m  ms per body and step %.4f worst step "
      "%.4f refined %llu\n",
      kFriction, 1.0 / dt_s, n, off, cost.all_ms / n / steps, cost.worst_ms / n,
      static_cast<unsigned long long>(world.counters.refined_steps));
}

}  // namespace

int main(int argc, char** argv) {
  const int most = argc > 1 ? std::atoi(argv[1]) : 200;
  const char* only = argc > 2 ? argv[2] : "";
  constexpr int kNumbers[] = {1, 2, 3, 4, 7, 8, 9, 10, 16, 32, 63, 64, 65, 66, 100, 128, 200, 400};
  for (const bool on_floor : {false, true})
    for (const double gap : {0.0, kGap_m})
      for (const double restitution : {1.0, 0.5, 0.0}) {
        if (*only == 's' || *only == 'p' || (*only == 'f' && on_floor) ||
            (*only == 'g' && !on_floor))
          continue;
        for (const int n : kNumbers)
          if (n > 1 && n <= most) print_balls(n, gap, restitution, on_floor);
      }
  if (*only == 'f' || *only == 'g') return 0;
  for (const double dt : {1.0 / 60, 1.0 / 240})
    for (const int n : kNumbers)
      if (n <= std::min(most, 100)) print_plates(n, dt);
  if (*only == 'p') return 0;
  for (const double dt : {1.0 / 60, 1.0 / 240})
    for (const double friction : {0.3, 0.8})
      for (const double push : {0.0, 1e-12}) {
        for (const int n : kNumbers)
          if (n <= std::min(most, 100)) print_boxes(n, friction, 3.0, dt, push);
      }
}
