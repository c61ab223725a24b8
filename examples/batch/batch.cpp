// Many simulations without a picture: towers of bricks that a ball is thrown at, over all
// processors. What comes out of a scene does not depend on who simulates it, or beside what.
//
// batch [TOWERS [THREADS]]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <soda/simulation.hpp>
#include <thread>
#include <vector>

namespace {

constexpr std::uint32_t kBall = 0, kBricks = 8;

soda::Scene make_tower(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto between = [&random](double least, double most) {
    return least + (most - least) * static_cast<double>(random()) / 4294967296.0;
  };
  soda::SceneParts tower;
  tower.name = "tower " + std::to_string(seed);
  tower.materials = {{.name = "brick", .friction = between(0.2, 0.8)}};
  tower.statics = {{.name = "ground", .shape = soda::HalfSpace{}, .material = "brick"}};
  tower.bodies.push_back({.id = kBall,
                          .shape = soda::Sphere{0.25},
                          .material = "brick",
                          .density_kg_m3 = 3000.0,
                          .position_m = {-6.0, 0.0, 1.0},
                          .velocity_m_s = {between(4.0, 14.0), 0.0, between(0.0, 4.0)}});
  for (std::uint32_t i = 0; i < kBricks; ++i)
    tower.bodies.push_back({.id = 1 + i,
                            .shape = soda::Box{{0.6, 0.6, 0.4}},
                            .material = "brick",
                            .density_kg_m3 = 800.0,
                            .position_m = {between(-0.05, 0.05), 0.0, 0.2 + 0.4 * i}});
  return soda::Scene::build(tower);
}

struct Outcome {
  int fallen = 0;  // bricks below the height at which they were
  std::uint64_t digest = 0;
};

Outcome simulate(std::uint32_t seed) {
  soda::Simulation simulation(make_tower(seed));
  const std::vector<soda::BodyState> before = simulation.states();
  simulation.step(240);
  Outcome outcome{0, simulation.digest()};
  for (std::uint32_t brick = 1; brick <= kBricks; ++brick)
    if (simulation.state(brick).position_m.z < before[brick].position_m.z - 0.1) ++outcome.fallen;
  return outcome;
}

std::vector<Outcome> simulate_all(std::uint32_t towers, unsigned threads) {
  std::vector<Outcome> outcomes(towers);
  std::atomic<std::uint32_t> next{0};
  const auto work = [&] {
    for (std::uint32_t i; (i = next++) < towers;) outcomes[i] = simulate(i);
  };
  std::vector<std::jthread> workers;
  for (unsigned i = 0; i < threads; ++i) workers.emplace_back(work);
  workers.clear();
  return outcomes;
}

}  // namespace

int main(int argc, char** argv) {
  const auto towers = static_cast<std::uint32_t>(argc > 1 ? std::atoi(argv[1]) : 64);
  const unsigned threads = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2]))
                                    : std::max(1u, std::thread::hardware_concurrency());
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Outcome> outcomes = simulate_all(towers, threads);
  const double time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::vector<int> by_fallen(kBricks + 1);
  for (const Outcome& outcome : outcomes) ++by_fallen[static_cast<std::size_t>(outcome.fallen)];
  std::printf("%u towers of %u bricks over %u threads: %.2f s, %.0f steps a second\n", towers,
              kBricks, threads, time_s, 240.0 * towers / time_s);
  for (std::size_t fallen = 0; fallen < by_fallen.size(); ++fallen)
    std::printf("  %zu fallen: %d towers\n", fallen, by_fallen[fallen]);
  // Alone again, each fourth of them.
  int different = 0;
  for (std::uint32_t i = 0; i < towers; i += 4)
    different += simulate(i).digest != outcomes[i].digest ? 1 : 0;
  std::printf("simulated alone, %d different\n", different);
  return different == 0 ? 0 : 1;
}
