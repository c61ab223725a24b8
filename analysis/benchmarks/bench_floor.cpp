// bench_floor FILE [STEPS]: the time of a physics step against its floor, the bare fcl::collide
// calls on the same candidate pairs at the same poses, measured in the same run. For scenes of
// boxes and spheres with boxes, spheres and halfspaces around them.
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "analysis/measures/error_measures.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"
#include "physics/measures/measures.hpp"
#include "physics/step/step.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

using namespace soda;

using FclShape = std::shared_ptr<fcl::CollisionGeometryd>;

FclShape fcl_shape(const physics::Shape& shape) {
  if (const auto* box = std::get_if<physics::Box>(&shape)) {
    return std::make_shared<fcl::Boxd>(2.0 * box->half_extents_m);
  }
  if (const auto* sphere = std::get_if<physics::Sphere>(&shape)) {
    return std::make_shared<fcl::Sphered>(sphere->radius_m);
  }
  if (const auto* halfspace = std::get_if<physics::HalfSpace>(&shape)) {
    return std::make_shared<fcl::Halfspaced>(halfspace->normal, halfspace->offset_m);
  }
  throw std::runtime_error("the floor is known for boxes, spheres and halfspaces only");
}

fcl::Transform3d pose(const physics::Vec3& position, const physics::Quat& orientation) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = orientation.toRotationMatrix();
  transform.translation() = position;
  return transform;
}

struct Floor {
  double collide_s = 0.0;
  std::size_t pairs = 0, colliding = 0;
};

struct PosedShape {
  const fcl::CollisionGeometryd* shape;
  fcl::Transform3d pose;
};

void collide(const PosedShape& a, const PosedShape& b, Floor& floor) {
  constexpr std::size_t kMaxContacts = 8;
  const fcl::CollisionRequestd request(kMaxContacts, true);
  fcl::CollisionResultd result;
  fcl::collide(a.shape, a.pose, b.shape, b.pose, request, result);
  ++floor.pairs;
  floor.colliding += result.isCollision() ? 1 : 0;
}

// The candidate pairs of the last step (still in the scratch) at the poses before it.
Floor measure_floor(const std::vector<PosedShape>& bodies, const std::vector<PosedShape>& statics,
                    const physics::StepScratch& scratch) {
  Floor floor;
  const double start_s = analysis::thread_cpu_s();
  for (const physics::IndexPair& pair : scratch.pairs) {
    collide(bodies[pair.first], bodies[pair.second], floor);
  }
  for (const physics::IndexPair& pair : scratch.static_pairs) {
    collide(bodies[pair.first], statics[pair.second], floor);
  }
  floor.collide_s = analysis::thread_cpu_s() - start_s;
  return floor;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct StepTimes {
  std::vector<double> step_s, collide_s, ratio;
  std::size_t pairs = 0, colliding = 0;
};

StepTimes measure_steps(const scenarios::Scenario& scenario, std::int64_t steps,
                        std::vector<physics::BodyState>& states) {
  const physics::SceneDescription& scene = scenario.scene;
  std::vector<FclShape> shapes;
  for (const physics::Shape& shape : scene.shapes) shapes.push_back(fcl_shape(shape));
  std::vector<PosedShape> bodies, statics;
  for (const physics::BodyParams& body : scene.bodies) {
    bodies.push_back({shapes[body.shape].get(), fcl::Transform3d::Identity()});
  }
  for (const physics::StaticBody& body : scene.statics) {
    statics.push_back({shapes[body.shape].get(), pose(body.position_m, body.orientation)});
  }
  const physics::Geometry geometry(scene);
  const std::vector<physics::BodyId> ids = analysis::all_ids(states.size());
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  StepTimes times;
  for (std::int64_t step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < states.size(); ++i) {
      bodies[i].pose = pose(states[i].position_m, states[i].orientation);
    }
    const double start_s = analysis::thread_cpu_s();
    physics::step(scene, geometry, ids, states, {scratch, report, counters});
    const double step_s = analysis::thread_cpu_s() - start_s;
    const Floor floor = measure_floor(bodies, statics, scratch);
    times.step_s.push_back(step_s);
    times.collide_s.push_back(floor.collide_s);
    times.ratio.push_back(step_s / floor.collide_s);
    times.pairs += floor.pairs;
    times.colliding += floor.colliding;
  }
  return times;
}

int run(const std::string& file, const char* steps_text) {
  const scenarios::Scenario scenario = scenarios::read_scenario_file(file);
  const std::int64_t steps =
      steps_text != nullptr ? std::strtoll(steps_text, nullptr, 10) : scenario.run.steps;
  if (steps < 1) throw std::runtime_error("needs at least one step");
  std::vector<physics::BodyState> states = scenario.initial;
  const StepTimes times = measure_steps(scenario, steps, states);
  const auto count = static_cast<std::size_t>(steps);
  std::cout << scenario.name << ": " << states.size() << " bodies, " << steps << " steps, digest "
            << analysis::format_digest(physics::digest(analysis::all_ids(states.size()), states))
            << "\ncandidate pairs a step  " << times.pairs / count << ", of which FCL finds "
            << times.colliding / count << " colliding\nstep                    "
            << analysis::format_number(1e6 * median(times.step_s))
            << " us (median CPU time)\nbare fcl::collide       "
            << analysis::format_number(1e6 * median(times.collide_s))
            << " us\nratio                   " << analysis::format_number(median(times.ratio), 3)
            << " (median of the steps' ratios)\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: bench_floor FILE [STEPS]\n";
    return 2;
  }
  try {
    return run(argv[1], argc == 3 ? argv[2] : nullptr);
  } catch (const std::exception& error) {
    std::cerr << "bench_floor: " << error.what() << "\n";
    return 2;
  }
}
