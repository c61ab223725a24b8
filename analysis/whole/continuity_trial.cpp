#include "analysis/whole/continuity_trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "analysis/process/isolated_process.hpp"
#include "analysis/runs/plain_loop.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/whole/whole_trial.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Vec3;

constexpr std::int64_t kMostSteps = 30;
constexpr std::uint64_t kMostWork = 40'000'000;
constexpr double kRounding = 1e-10, kGrowth = 1000.0, kChaos = 1e-6;

// Of one run: states by body label, step by step.
struct Way {
  double dt_s = 0.0, least_mass_kg = std::numeric_limits<double>::max();
  std::vector<std::vector<std::uint32_t>> labels;
  std::vector<std::vector<BodyState>> states;
};

Way run(const WholeScene& scene, const std::string& folder) {
  scenarios::Scenario scenario =
      scenarios::read_scenario_file(write_scene(scene, folder, "continuity"));
  scenario.run.steps = std::min(scenario.run.steps, kMostSteps);
  Way way;
  way.dt_s = scenario.scene.dt_s;
  for (const physics::BodyParams& body : scenario.scene.bodies)
    way.least_mass_kg = std::min(way.least_mass_kg, body.mass_kg);
  PlainLimits limits{true, kMostWork};
  limits.watch = [&](std::span<const physics::BodyId> ids, std::span<const BodyState> states) {
    std::vector<std::uint32_t> labels;
    for (const physics::BodyId id : ids)
      labels.push_back(scenario.scene.bodies[physics::index_of(id)].label);
    way.labels.push_back(std::move(labels));
    way.states.emplace_back(states.begin(), states.end());
  };
  const PlainLoop loop(scenario, scenario.run.inputs.script, limits);
  return way;
}

struct Deviation {
  double size = 0.0;
  std::uint32_t body = 0;
  bool same_bits = true;
};

// Of the bodies of `plain`, all of which `other` has.
Deviation deviation(const Way& plain, const Way& other, std::size_t step, double dt_s) {
  Deviation worst;
  const std::vector<std::uint32_t>& labels = other.labels[step];
  for (std::size_t i = 0; i < plain.labels[step].size(); ++i) {
    const std::uint32_t label = plain.labels[step][i];
    const auto found = std::ranges::lower_bound(labels, label);
    if (found == labels.end() || *found != label) return {1e300, label, false};
    const BodyState& a = plain.states[step][i];
    const BodyState& b = other.states[step][static_cast<std::size_t>(found - labels.begin())];
    const double far_m = (a.position_m - b.position_m).norm();
    const double faster_m = dt_s * (a.linear_velocity_m_s - b.linear_velocity_m_s).norm();
    const double scale_m = 1.0 + a.position_m.norm();
    const double size = std::max(far_m, faster_m) / scale_m;
    worst.same_bits = worst.same_bits && far_m == 0.0 && faster_m == 0.0;
    if (size > worst.size || std::isnan(size)) {
      worst.size = std::isnan(size) ? 1e300 : size;
      worst.body = label;
    }
  }
  return worst;
}

ContinuityOutcome compare(const ContinuityPair& pair, std::uint64_t seed,
                          const std::string& folder) {
  const Way plain = run(pair.plain, folder), changed = run(pair.changed, folder);
  std::vector<Way> shakes;
  for (std::uint64_t k = 0; k < 3; ++k)
    shakes.push_back(run(shaken(pair.plain, 3 * seed + k), folder));
  const double dt_s = plain.dt_s;
  ContinuityOutcome outcome;
  std::size_t steps = std::min(plain.states.size(), changed.states.size());
  for (const Way& shake : shakes) steps = std::min(steps, shake.states.size());
  double chaos = 0.0;
  bool same_bits = true;
  for (std::size_t k = 0; k < steps; ++k) {
    for (const Way& shake : shakes) chaos = std::max(chaos, deviation(plain, shake, k, dt_s).size);
    if (chaos > kChaos) break;
    const Deviation found = deviation(plain, changed, k, dt_s);
    same_bits = same_bits && found.same_bits;
    const double t_s = dt_s * static_cast<double>(k + 1);
    const double allowed = kRounding + kGrowth * chaos +
                           10.0 * pair.force_newton / plain.least_mass_kg * t_s * (t_s + dt_s);
    outcome.steps = static_cast<std::int64_t>(k) + 1;
    outcome.worst = std::max(outcome.worst, found.size / allowed);
    if (found.size <= allowed) continue;
    outcome.ending = ContinuityEnding::kFailed;
    outcome.what = "step " + std::to_string(k + 1) + ", body " + std::to_string(found.body) +
                   " is off by " + format_number(found.size) +
                   "; allowed: " + format_number(allowed) + "; shaken scenes are off by " +
                   format_number(chaos);
    return outcome;
  }
  if (outcome.steps > 0)
    outcome.ending = same_bits ? ContinuityEnding::kSameBits : ContinuityEnding::kRounding;
  return outcome;
}

}  // namespace

ContinuityOutcome try_continuity(std::uint64_t seed, ContinuityKind kind,
                                 const std::string& folder) {
  const std::optional<ContinuityPair> pair = change(draw_continuity_scene(seed, kind), seed, kind);
  if (!pair) return {};
  const ChildOutcome child = run_in_child([&](ChildResults& results) {
    const ContinuityOutcome found = compare(*pair, seed, folder);
    results.write(found.ending);
    results.write(found.steps);
    results.write(found.worst);
    for (const char c : found.what) results.write(c);
  });
  ContinuityOutcome outcome;
  constexpr std::size_t kHead = sizeof outcome.ending + sizeof outcome.steps + sizeof outcome.worst;
  if (child.failed || child.bytes.size() < kHead) {
    outcome.ending = ContinuityEnding::kFailed;
    outcome.what = child.what;
    return outcome;
  }
  const char* place = child.bytes.data();
  std::memcpy(&outcome.ending, place, sizeof outcome.ending);
  std::memcpy(&outcome.steps, place += sizeof outcome.ending, sizeof outcome.steps);
  std::memcpy(&outcome.worst, place += sizeof outcome.steps, sizeof outcome.worst);
  outcome.what.assign(child.bytes, kHead, std::string::npos);
  return outcome;
}

}  // namespace soda::analysis
