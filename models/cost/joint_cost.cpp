#include "models/cost/joint_cost.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "models/cost/work_cost.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::models {
namespace {

std::string rounded(double value) {
  std::ostringstream out;
  out << std::setprecision(2) << value;
  if (value >= 100.0) {
    out.str("");
    out << std::fixed << std::setprecision(0) << value;
  }
  return out.str();
}

std::string time_text(std::int64_t time_ns) {
  const double ms = 1e-6 * static_cast<double>(time_ns);
  return ms < 1000.0 ? rounded(ms) + " ms" : rounded(1e-3 * ms) + " s";
}

}  // namespace

std::vector<JointCost> joint_costs(const physics::SceneDescription& scene) {
  std::vector<JointCost> costs;
  std::int64_t rest_ns = body_cost_ns() * static_cast<std::int64_t>(scene.bodies.size());
  for (physics::JointIsland& island : physics::joint_islands(scene)) {
    rest_ns += joint_rows_cost_ns(island.rows);
    const bool swept = physics::are_joints_swept(scene, island);
    const std::int64_t factors_ns = swept ? 0 : joint_factors_cost_ns(island.multiplications);
    costs.push_back({std::move(island), swept, factors_ns, 0.0});
  }
  for (JointCost& cost : costs)
    cost.of_the_rest = static_cast<double>(cost.factors_ns) / static_cast<double>(rest_ns);
  std::stable_sort(costs.begin(), costs.end(), [](const JointCost& x, const JointCost& y) {
    return x.factors_ns > y.factors_ns;
  });
  return costs;
}

std::vector<JointCost> costly_islands(const physics::SceneDescription& scene) {
  std::vector<JointCost> costs = joint_costs(scene);
  std::erase_if(costs, [](const JointCost& cost) { return !cost.is_costly(); });
  return costs;
}

std::string words_for(const physics::SceneDescription& scene, const JointCost& cost) {
  const physics::JointIsland& island = cost.island;
  const std::uint32_t first = scene.bodies[physics::index_of(island.bodies.front())].label;
  const std::string held = "joints hold " + std::to_string(island.bodies.size()) +
                           " bodies (the lowest id is " + std::to_string(first) +
                           ") in one island of " + std::to_string(island.rows) + " rows: ";
  const std::string factor =
      "a factorisation takes " + std::to_string(island.multiplications) + " multiplications";
  if (cost.swept) return held + "swept, to first order, for " + factor;
  return held + factor + ", those of a step about " + time_text(cost.factors_ns) + ", " +
         rounded(cost.of_the_rest) + " times as much as the rest of the step without contacts";
}

}  // namespace soda::models
