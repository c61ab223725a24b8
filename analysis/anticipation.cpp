#include "analysis/anticipation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/error_measures.hpp"
#include "physics/mass_properties.hpp"
#include "physics/step.hpp"

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
    physics::step(scene_, geometry_, ids_, states_, scratch_, report_, counters_);
    const double end_s = thread_cpu_s();
    for (physics::BodyState& state : states_) put_back(state);
    return end_s - start_s;
  }

  double mean_step_s(int steps) {
    double sum_s = 0.0;
    for (int i = 0; i < steps; ++i) sum_s += step_s();
    return sum_s / steps;
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

// The number of bodies whose step costs most nearly (1 + overload) of `base_step_s`. Cost grows
// with every body, about as the number of pairs.
std::uint32_t bodies_for(double overload, double base_step_s) {
  if (overload == 0.0) return kBaseBodies;
  const double wanted_s = (1.0 + overload) * base_step_s;
  constexpr int kProbeSteps = 30;
  std::uint32_t below = kBaseBodies;
  double below_s = base_step_s;
  auto above = static_cast<std::uint32_t>(std::ceil(kBaseBodies * std::sqrt(1.0 + overload))) + 1;
  double above_s = CoincidentCubes(above).mean_step_s(kProbeSteps);
  while (above_s < wanted_s) {
    below = above;
    below_s = above_s;
    above += (above + 9) / 10;
    above_s = CoincidentCubes(above).mean_step_s(kProbeSteps);
  }
  while (above - below > 1) {
    const std::uint32_t middle = below + (above - below) / 2;
    const double middle_s = CoincidentCubes(middle).mean_step_s(kProbeSteps);
    (middle_s < wanted_s ? below : above) = middle;
    (middle_s < wanted_s ? below_s : above_s) = middle_s;
  }
  return wanted_s - below_s < above_s - wanted_s ? below : above;
}

AnticipationPoint measure_point(std::int64_t buffer, double overload, std::uint32_t bodies,
                                std::int64_t max_steps, const AnticipationReport& report) {
  CoincidentCubes base(kBaseBodies);
  CoincidentCubes peak(bodies);
  double peak_sum_s = 0.0;
  std::int64_t peak_steps = 0;
  const StarvationResult starved = drain(
      buffer, report.frame_s, kWarmUpFrames, max_steps, [&] { return base.step_s(); },
      [&] {
        const double cost_s = peak.step_s();
        peak_sum_s += cost_s;
        ++peak_steps;
        return cost_s;
      });
  AnticipationPoint point;
  point.buffer = buffer;
  point.overload = overload;
  point.bodies = bodies;
  const double mean_s =
      peak_steps > 0 ? peak_sum_s / static_cast<double>(peak_steps) : report.base_step_s;
  point.measured_overload = mean_s / report.base_step_s - 1.0;
  point.ratio = mean_s / report.frame_s;
  point.filled = starved.filled_at_peak;
  point.steps_until_late = starved.frames;
  point.late = starved.late;
  point.closed_form_steps =
      anticipation_steps(static_cast<double>(starved.filled_at_peak), point.ratio);
  return point;
}

}  // namespace

// After N frames the ring has given N entries and received N / r: empty when B + N / r = N.
double anticipation_steps(double entries, double ratio) {
  if (ratio <= 1.0) return std::numeric_limits<double>::infinity();
  return entries * ratio / (ratio - 1.0);
}

AnticipationReport measure_anticipation(const AnticipationOptions& options) {
  AnticipationReport report;
  report.base_bodies = kBaseBodies;
  report.utilisation = options.utilisation;
  report.base_step_s = CoincidentCubes(kBaseBodies).mean_step_s(kCalibrationSteps);
  report.frame_s = report.base_step_s / options.utilisation;
  std::vector<std::uint32_t> bodies;
  for (const double overload : options.overloads) {
    bodies.push_back(bodies_for(overload, report.base_step_s));
  }
  for (const std::int64_t buffer : options.buffers) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      report.points.push_back(
          measure_point(buffer, options.overloads[i], bodies[i], options.max_steps, report));
    }
  }
  return report;
}

}  // namespace soda::analysis
