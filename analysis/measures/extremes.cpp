#include "analysis/measures/extremes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "analysis/text/text_table.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "physics/step/step.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

constexpr double kSizes_m[] = {1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3};
constexpr double kSteps_s[] = {1.0 / 10.0, 1.0 / 60.0, 1.0 / 240.0, 1e-3, 1e-4};
constexpr double kOffsets_m[] = {0.0, 1e3, 1e5, 1e7};
constexpr double kMasses_kg[] = {1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9};

physics::SceneDescription scene_of(const ExtremeSetting& setting) {
  physics::SceneDescription scene;
  scene.gravity_m_s2 = Vec3(0.0, 0.0, -9.81);
  scene.dt_s = setting.dt_s;
  scene.shapes.push_back(physics::Box{Vec3::Constant(0.5 * setting.size_m)});
  scene.shapes.push_back(physics::HalfSpace{});
  const physics::MassProperties mass = physics::mass_properties(scene.shapes[0]);
  physics::BodyParams body;
  body.mass_kg = setting.mass_kg;
  body.inertia_local_kg_m2 = setting.mass_kg / mass.volume_m3 * mass.inertia_per_density_m5;
  body.inverse_inertia_local = body.inertia_local_kg_m2.inverse();
  scene.bodies.push_back(body);
  physics::StaticBody floor;
  floor.shape = 1;
  floor.position_m = Vec3::Constant(setting.offset_m);
  scene.statics.push_back(floor);
  return scene;
}

std::array<Vec3, 8> corners_of(double size_m, const physics::BodyState& state) {
  std::array<Vec3, 8> corners;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 sign(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    corners[i] = state.position_m + state.orientation * Vec3(size_m * sign);
  }
  return corners;
}

// What is no number is farther than anything.
double way_m(const std::array<Vec3, 8>& start, const std::array<Vec3, 8>& now) {
  double way = 0.0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const double one = (now[i] - start[i]).norm();
    if (!(one <= way)) way = one;
  }
  return way;
}

ExtremeRun run_extreme(const ExtremeSetting& setting) {
  constexpr double kDuration_s = 2.0;
  constexpr std::int64_t kLeastSteps = 100;
  const physics::SceneDescription scene = scene_of(setting);
  const physics::Geometry geometry(scene);
  const std::vector<physics::BodyId> ids{physics::BodyId{0}};
  std::vector<physics::BodyState> states(1);
  states[0].position_m = Vec3::Constant(setting.offset_m) + Vec3(0.0, 0.0, 0.5 * setting.size_m);
  const std::array<Vec3, 8> start = corners_of(setting.size_m, states[0]);
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  ExtremeRun run{setting,
                 std::max<std::int64_t>(kLeastSteps, std::llround(kDuration_s / setting.dt_s)),
                 0.0,
                 {}};
  for (std::int64_t step = 1; step <= run.steps; ++step) {
    physics::step(scene, geometry, ids, states, {scratch, report, counters});
    if (!report.faults.empty()) {
      run.fault = "step " + std::to_string(step) + ": " + report.faults[0].what;
      break;
    }
    const double rel = way_m(start, corners_of(setting.size_m, states[0])) / setting.size_m;
    if (!(rel <= run.displacement_rel)) run.displacement_rel = rel;
  }
  return run;
}

bool is_beyond(const ExtremeRun& run, double displacement_rel) {
  return !run.fault.empty() || !(run.displacement_rel <= displacement_rel);
}

std::string setting_text(const ExtremeSetting& s) {
  return format_number(s.size_m) + " m, steps of " + format_number(s.dt_s) + " s, at " +
         format_number(s.offset_m) + " m, " + format_number(s.mass_kg) + " kg";
}

}  // namespace

std::size_t ExtremesReport::beyond(double displacement_rel) const {
  return static_cast<std::size_t>(std::count_if(
      runs.begin(), runs.end(),
      [displacement_rel](const ExtremeRun& run) { return is_beyond(run, displacement_rel); }));
}

std::vector<ExtremeSetting> extreme_settings() {
  std::vector<ExtremeSetting> settings;
  for (const double size : kSizes_m)
    for (const double offset : kOffsets_m)
      for (const double dt : kSteps_s)
        for (const double mass : kMasses_kg) settings.push_back({size, dt, offset, mass});
  return settings;
}

ExtremesReport measure_extremes(std::span<const ExtremeSetting> settings) {
  ExtremesReport report;
  for (const ExtremeSetting& setting : settings) report.runs.push_back(run_extreme(setting));
  return report;
}

std::string extremes_text(const ExtremesReport& report) {
  std::vector<Column> columns{{"size m", Align::kRight}, {"offset m", Align::kRight}};
  std::map<double, std::size_t, std::greater<>> steps;
  for (const ExtremeRun& run : report.runs) steps.emplace(run.setting.dt_s, 0);
  for (auto& [dt, column] : steps) {
    column = columns.size();
    columns.push_back({"dt " + format_number(dt, 3) + " s", Align::kRight});
  }
  std::map<std::pair<double, double>, std::vector<double>> worst;
  std::string missed;
  for (const ExtremeRun& run : report.runs) {
    auto& line = worst[{run.setting.size_m, run.setting.offset_m}];
    line.resize(columns.size());
    double& cell = line[steps[run.setting.dt_s]];
    if (!(run.displacement_rel <= cell)) cell = run.displacement_rel;
    if (is_beyond(run, kExtremesMust))
      missed += "  missed: " + setting_text(run.setting) + ": " +
                (run.fault.empty() ? format_number(run.displacement_rel) : run.fault) + "\n";
  }
  std::vector<std::vector<std::string>> rows;
  for (const auto& [place, cells] : worst) {
    std::vector<std::string> row{format_number(place.first), format_number(place.second)};
    for (std::size_t i = 2; i < cells.size(); ++i) row.push_back(format_number(cells[i], 2));
    rows.push_back(std::move(row));
  }
  const auto count = [&](double bound) {
    return std::to_string(report.beyond(bound)) + " beyond " + format_number(bound);
  };
  return "a box at rest: largest displacement of a corner over its size, worst of all masses\n\n" +
         format_table(columns, rows) + "\n" + missed + std::to_string(report.runs.size()) +
         " runs, " + count(kExtremesMust) + " (must), " + count(kExtremesStretch) + " (stretch)\n";
}

}  // namespace soda::analysis
