// What a step costs and what it leaves: figures of docs/decisions.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/scenes.hpp"

namespace {

using namespace soda::physics;
using test::World;

// Processor time of this process, so that others on the machine disturb less.
class Stopwatch {
 public:
  double lap_ms() {
    const double now = now_ms();
    const double ms = now - last_;
    last_ = now;
    return ms;
  }

 private:
  static double now_ms() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  }
  double last_ = now_ms();
};

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// Runs the three stages by hand, so that each can be timed.
void measure_steps(const char* name, World world, int warm_up, int steps) {
  const Geometry geometry(world.scene);
  world.run(warm_up, geometry);
  world.counters = {};
  std::vector<double> boxes, pairs, contacts, advance;
  double deepest = 0.0, residual = 0.0;
  for (int i = 0; i < steps; ++i) {
    Stopwatch watch;
    compute_boxes(world.scene, geometry, world.ids, world.states, world.scratch.boxes,
                  world.counters);
    boxes.push_back(watch.lap_ms());
    StageCounters unused;
    find_pairs(world.scene.broadphase, world.scratch.boxes, world.scratch.pairs, unused);
    pairs.push_back(watch.lap_ms());
    find_contacts(world.scene, geometry, world.ids, world.states, world.scratch, world.counters);
    contacts.push_back(watch.lap_ms());
    world.report = {};
    advance_bodies(world.scene, geometry, world.ids, world.states,
                   {world.scratch, world.report, world.counters});
    advance.push_back(watch.lap_ms());
    for (const IslandReport& r : world.report.islands) {
      deepest = std::max(deepest, r.max_penetration_m);
      residual = std::max(residual, r.constraint_residual_m_s);
    }
  }
  const double n = steps;
  std::printf("%-16s boxes %.3f  pairs %.3f  pairs+contacts %.3f  advance %.3f ms/step\n", name,
              median(boxes), median(pairs), median(contacts), median(advance));
  std::printf(
      "%-16s pairs %.0f  manifolds %.0f  points %.0f  sweeps %.1f  islands %.1f a step, "
      "penetration %.2g m, residual %.2g m/s, digest %016lx\n",
      "", world.counters.candidate_pairs / n, world.counters.manifolds / n,
      world.counters.contact_points / n, world.counters.solver_iterations / n,
      world.counters.islands_solved / n, deepest, residual, world.digest_of_states());
}

void measure_rotation(const char* name, const Shape& shape, double angular_speed_rad_s) {
  constexpr int kSteps = 300000;
  World world;
  BodyState& state = world.add_body(world.add_shape(shape), Vec3::Zero());
  state.angular_velocity_rad_s = angular_speed_rad_s * Vec3(0.002, 1, 0.002);
  Stopwatch watch;
  for (int i = 0; i < kSteps; ++i) rotate_freely(world.scene.bodies[0], 1.0 / 60, state);
  std::printf("free rotation, %-32s %.0f ns\n", name, 1e6 * watch.lap_ms() / kSteps);
}

World sparse() {
  World world;
  const std::uint32_t box = world.add_shape(Box{});
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int i = 0; i < 10000; ++i) {
    const double x = 200 * unit(), y = 200 * unit(), z = 200 * unit();
    BodyState& s = world.add_body(box, Vec3(x, y, z));
    s.linear_velocity_m_s = Vec3(x - y, y - z, z - x) / 200;
    s.angular_velocity_rad_s = Vec3(y - z, z - x, x - y) / 200;
  }
  return world;
}

World bin() {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t wall_x = world.add_shape(Box{Vec3(0.5, 20, 50)});
  const std::uint32_t wall_y = world.add_shape(Box{Vec3(20, 0.5, 50)});
  world.add_static(wall_x, Vec3(-6, 0, 50));
  world.add_static(wall_x, Vec3(6, 0, 50));
  world.add_static(wall_y, Vec3(0, -6, 50));
  world.add_static(wall_y, Vec3(0, 6, 50));
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 1000; ++i) {
    const int x = i % 10, y = i / 10 % 10, z = i / 100;
    world.add_body(box, Vec3(-4.7 + x * 1.05 + 0.03 * ((z * 7 + y) % 3),
                             -4.7 + y * 1.05 + 0.02 * ((z * 5 + x) % 4), 1 + z * 1.3));
  }
  return world;
}

World pyramid() {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int row = 0; row < 20; ++row) {
    for (int i = 0; i < 20 - row; ++i)
      world.add_body(box, Vec3(i * 1.02 + row * 0.51, 0, 0.5 + row));
  }
  return world;
}

}  // namespace

int main() {
  measure_rotation("one moment, 5 rad/s", Sphere{}, 5.0);
  measure_rotation("two moments, 5 rad/s", Cylinder{0.5, 0.2}, 5.0);
  measure_rotation("three moments, 5 rad/s", Box{Vec3(0.5, 0.25, 0.1)}, 5.0);
  measure_rotation("three moments, 1e-6 rad/s", Box{Vec3(0.5, 0.25, 0.1)}, 1e-6);
  measure_steps("sparse 10,000", sparse(), 10, 100);
  measure_steps("bin 1000 falling", bin(), 0, 60);
  measure_steps("bin 1000 settled", bin(), 250, 50);
  measure_steps("pyramid 210", pyramid(), 100, 100);
}
