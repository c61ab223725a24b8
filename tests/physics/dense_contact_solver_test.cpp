// Few contact points, solved from the points.
#include "physics/solvers/dense_contact_solver.hpp"

#include <gtest/gtest.h>

#include <random>

#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/island_motion.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

double between(double low, double high, std::mt19937_64& engine) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}

// A thin rod whose edge, two points, strikes a wall at x = 0.
ContactProblem random_strike(std::mt19937_64& engine) {
  World world;
  world.add_static(world.add_shape(HalfSpace{Vec3::UnitX(), 0.0}));
  BodyState& rod = world.add_body(world.add_shape(Box{Vec3(0.2, 0.02, 0.05)}), Vec3(0.1, 0, 0));
  rod.linear_velocity_m_s = Vec3(-10.0, between(-10, 10, engine), between(-3, 3, engine));
  rod.angular_velocity_rad_s = Vec3(between(-1, 1, engine), 0.0, between(-20, 20, engine));
  world.scene.bodies[0].material = {.friction = 0.3, .restitution = 0.0};
  world.scene.statics[0].material = {.friction = 0.3, .restitution = 0.0};
  ContactManifold m;
  m.a = BodyId{0};
  m.b = static_id(0);
  m.normal = -Vec3::UnitX();
  m.count = 2;
  const double high = between(-0.15, 0.15, engine);
  for (int i = 0; i < 2; ++i)
    m.points[i] = {Vec3(0.0, high, i == 0 ? -0.05 : 0.05), 0.0, static_cast<std::uint32_t>(i)};
  const std::vector<ContactManifold> manifolds{m};
  const IndexedSpan<BodyState> before{std::span<const BodyState>(world.states)};
  ContactProblem problem;
  const SolveStep impact{world.scene, 0.0, world.ids, before};
  load_bodies(impact, problem.bodies, world.counters);
  build_rows(impact, std::span<const ContactManifold>(manifolds), problem, world.counters);
  return problem;
}

TEST(DenseContacts, ComeToWhatIterationsOverBodiesComeToInFarFewer) {
  constexpr int kMany = 20000;
  std::mt19937_64 engine(7);
  int taken = 0, ended = 0;
  for (int i = 0; i < 200; ++i) {
    ContactProblem swept = random_strike(engine), solved = swept;
    double change = 0.0;
    for (int k = 0; k < kMany; ++k) change = iterate_velocities(k % 2 == 0, swept);
    // Between sliding and sticking they may go round for ever.
    if (change > 1e-10) continue;
    ++ended;
    taken += solve_dense_contacts(0, kMany, 1e-10, solved);
    const double speed = 10.0;
    EXPECT_LE((swept.bodies[0].linear - solved.bodies[0].linear).norm(), 1e-8 * speed) << i;
    EXPECT_LE((swept.bodies[0].angular - solved.bodies[0].angular).norm(), 1e-6 * speed) << i;
  }
  EXPECT_GT(ended, 190);
  EXPECT_LT(taken, ended * 60);
}

}  // namespace
}  // namespace soda::physics
