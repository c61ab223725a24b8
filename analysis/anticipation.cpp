#include "analysis/anticipation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "analysis/error_measures.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "physics/step/step.hpp"

namespace soda::analysis {
namespace {

constexpr std::uint32_t kBaseBodies = 40;   // the paper's
constexpr std::int64_t kWarmUpFrames = 60;  // one second
constexpr int kCalibrationSteps = 100;

// One world of coincident unit cubes that are put back after every step.
class CoincidentCubes {
 public:
  explicit CoincidentCubes(std::uint32_t bodies)
      : scene_(make_scene(bodies)), geometry_(scene_), ids_(all_ids(bodies)), states_(bodies) {
    for (int i = 0; i < 5; ++i) step_s();  // caches and allocations
  }

  // CPU time of one step.
  double step_s() {
    const double start_s = thread_cpu_s();
    physics::step(scene_, geometry_, ids_, states_, {scratch_, report_, counters_});
    const double end_s = thread_cpu_s();
    for (physics::BodyState& state : states_) put_back(state);
    return end_s - start_s;
  }

 private:
  static void put_back(physics::BodyState& state) {
    state.position_m = physics::Vec3::Zero();
    state.orientation = physics::Quat::Identity();
    state.linear_velocity_m_s = physics::Vec3::Zero();
    state.angular_velocity_rad_s = physics::Vec3::Zero();
    state.impulses.clear();
  }

  static physics::SceneDescription make_scene(std::uint32_t bodies) {
    physics::SceneDescription scene;
    scene.gravity_m_s2 = physics::Vec3(0.0, 0.0, -9.81);
    scene.broadphase = physics::Broadphase::kAllPairs;
    scene.shapes.push_back(physics::Box{});
    physics::BodyParams cube;
    cube.inertia_local_kg_m2 =
        cube.mass_kg * physics::mass_properties(scene.shapes[0]).inertia_per_density_m5;
    cube.inverse_inertia_local = cube.inertia_local_kg_m2.inverse();
    for (std::uint32_t i = 0; i < bodies; ++i) {
      cube.label = i;
      scene.bodies.push_back(cube);
    }
    return scene;
  }

  physics::SceneDescription scene_;
  physics::Geometry geometry_;
  std::vector<physics::BodyId> ids_;
  std::vector<physics::BodyState> states_;
  physics::StepScratch scratch_;
  physics::StepReport report_;
  physics::StageCounters counters_;
};

// Times steps in units of a base step timed alongside: clock changes and other programs on the
// machine slow both down and cancel. A median, as the base steps are disturbed too.
class BaseClock {
 public:
  BaseClock() : cubes_(kBaseBodies) {
    for (double& recent_s : recent_s_) recent_s = cubes_.step_s();
  }

  double unit_s() const {
    std::array<double, kWindow> sorted = recent_s_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[kWindow / 2];
  }

  // Cost of one step of `cubes`, in base steps.
  double cost(CoincidentCubes& cubes) {
    constexpr std::size_t kStepsPerBaseStep = 3;
    if (++timed_ % kStepsPerBaseStep == 0) {
      recent_s_[timed_ / kStepsPerBaseStep % kWindow] = cubes_.step_s();
    }
    return cubes.step_s() / unit_s();
  }

  double mean_cost(CoincidentCubes& cubes, int steps) {
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) sum += cost(cubes);
    return sum / steps;
  }

 private:
  static constexpr std::size_t kWindow = 9;
  CoincidentCubes cubes_;
  std::array<double, kWindow> recent_s_{};
  std::size_t timed_ = 0;
};

// Cost of a step with so many bodies over that of a base step: the median over pairs of steps that
// follow each other.
double probe(std::uint32_t bodies) {
  constexpr std::size_t kPairs = 31;
  CoincidentCubes base(kBaseBodies);
  CoincidentCubes cubes(bodies);
  std::array<double, kPairs> ratios{};
  for (double& ratio : ratios) {
    const double base_s = base.step_s();
    ratio = cubes.step_s() / base_s;
  }
  std::sort(ratios.begin(), ratios.end());
  return ratios[kPairs / 2];
}

// The number of bodies whose step costs most nearly 1 + overload base steps. Cost grows with every
// body, about as the number of pairs.
std::uint32_t bodies_for(double overload) {
  if (overload == 0.0) return kBaseBodies;
  const double wanted = 1.0 + overload;
  std::uint32_t below = kBaseBodies;
  double below_cost = 1.0;
  auto above = static_cast<std::uint32_t>(std::ceil(kBaseBodies * std::sqrt(wanted))) + 1;
  double above_cost = probe(above);
  while (above_cost < wanted) {
    below = above;
    below_cost = above_cost;
    above += (above + 9) / 10;
    above_cost = probe(above);
  }
  while (above - below > 1) {
    const std::uint32_t middle = below + (above - below) / 2;
    const double middle_cost = probe(middle);
    (middle_cost < wanted ? below : above) = middle;
    (middle_cost < wanted ? below_cost : above_cost) = middle_cost;
  }
  return wanted - below_cost < above_cost - wanted ? below : above;
}

// Time runs in base steps here.
AnticipationPoint measure_point(std::int64_t buffer, double overload, std::uint32_t bodies,
                                std::int64_t max_steps, double base_cost, double frame,
                                BaseClock& clock) {
  CoincidentCubes base(kBaseBodies);
  CoincidentCubes peak(bodies);
  double peak_sum = 0.0;
  std::int64_t peak_steps = 0;
  const StarvationResult starved = drain(
      buffer, frame, kWarmUpFrames, max_steps, [&] { return clock.cost(base); },
      [&] {
        const double cost = clock.cost(peak);
        peak_sum += cost;
        ++peak_steps;
        return cost;
      });
  AnticipationPoint point;
  point.buffer = buffer;
  point.overload = overload;
  point.bodies = bodies;
  point.filled = starved.filled_at_peak;
  point.steps_until_late = starved.frames;
  point.late = starved.late;
  // Without a step of the peak (starved in the warm-up) these are not known.
  const double mean = peak_sum / static_cast<double>(peak_steps);
  point.measured_overload = mean / base_cost - 1.0;
  point.ratio = mean / frame;
  point.closed_form_steps =
      anticipation_steps(static_cast<double>(starved.filled_at_peak), point.ratio);
  return point;
}

}  // namespace

AnticipationReport measure_anticipation(const AnticipationOptions& options) {
  BaseClock clock;
  CoincidentCubes base(kBaseBodies);
  const double base_cost = clock.mean_cost(base, kCalibrationSteps);
  const double frame = base_cost / options.utilisation;
  AnticipationReport report;
  report.base_bodies = kBaseBodies;
  report.utilisation = options.utilisation;
  report.base_step_s = base_cost * clock.unit_s();
  report.frame_s = report.base_step_s / options.utilisation;
  std::vector<std::uint32_t> bodies;
  for (const double overload : options.overloads) {
    bodies.push_back(bodies_for(overload));
  }
  for (const std::int64_t buffer : options.buffers) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      report.points.push_back(measure_point(buffer, options.overloads[i], bodies[i],
                                            options.max_steps, base_cost, frame, clock));
    }
  }
  return report;
}

}  // namespace soda::analysis
