#include "physics/refinement/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/explicit_springs.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/refinement/sub_intervals.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/solvers/island_blocks.hpp"

namespace soda::physics {
namespace {

// A change is closed in upon until its error, which halves with the part that holds it, is an
// eighth of any tolerance. Large islands take less solves, for each of theirs takes longer.
// Unasked, only a single body gets more than its trials.
Limits limits_of(const SceneDescription& scene, bool single, std::size_t pairs) {
  constexpr std::size_t kMostSolves = 2000, kLeastSolves = 64, kPairsSolved = 128'000;
  if (!(scene.tolerance > 0.0)) return single ? Limits{32, 12} : Limits{0, 0};
  const std::size_t solves =
      std::clamp(kPairsSolved / std::max<std::size_t>(pairs, 1), kLeastSolves, kMostSolves);
  return {static_cast<int>(solves), 26};
}

// All that is still to be done, as one part.
void join_sub_intervals(std::vector<SubInterval>& parts) {
  if (parts.size() < 2) return;
  SubInterval whole{0.0, parts.front().depth};
  for (const SubInterval& part : parts) whole.time_s += part.time_s;
  parts = {whole};
}

// A drive's law is that of a whole step (drive.hpp), in flight and in contact: trials would find
// another one.
bool is_driven(const SceneDescription& scene, BodyId id) {
  return scene.bodies[index_of(id)].drive != kNoDrive;
}

// Bodies that no drive pushes, and no joint but springs holds.
std::size_t unheld_bodies(const SceneDescription& scene) {
  if (scene.joints.empty() && scene.drives.empty()) return scene.bodies.size();
  std::vector<bool> held(scene.bodies.size(), false);
  for (const Joint& joint : scene.joints) {
    if (joint.kind == JointKind::kSpring || can_break(joint)) continue;
    held[index_of(joint.a)] = true;
    if (!is_static(joint.b)) held[index_of(joint.b)] = true;
  }
  for (std::size_t i = 0; i < held.size(); ++i)
    held[i] = held[i] || scene.bodies[i].drive != kNoDrive;
  return static_cast<std::size_t>(std::ranges::count(held, false));
}

// Whether trials have a limit that a plain step is not near already: contacts without joints but
// springs. (Springs alone are of a higher order, or so stiff that their limit is not smooth.)
bool is_of_first_order(const SceneDescription& scene, std::span<const BodyId> ids,
                       std::span<const ContactManifold> manifolds,
                       std::span<const BodyState> states) {
  if (scene.joints.empty()) return true;
  if (!are_all_springs(scene, ids, manifolds, states)) return false;
  if (std::ranges::none_of(manifolds, is_joint)) return true;
  return std::ranges::any_of(manifolds, [](const ContactManifold& m) { return m.count > 0; });
}

// The impulses of a part are kept as those of a whole step under the same load. What a hit took
// from velocities is no load: a part of a hundredth of the step would leave it a hundredfold. So
// where velocities change faster than loads change them, bodies keep the loads that they had.
void keep_loads(const IslandStep& island, double time_s, std::span<const BodyState> from,
                std::span<BodyState> states) {
  const std::span<const BodyId> ids = island.ids;
  constexpr double kMost = 2.0;  // as of what can be smooth (sub_intervals.cpp)
  const double most_m_s = kMost * strongest_field_m_s2(island.scene, ids) * time_s;
  const auto is_hit = [&](std::size_t i) {
    const double radius_m = shape_of(island.scene, island.geometry, ids[i]).bounding_radius_m;
    const Vec3 linear = states[i].linear_velocity_m_s - from[i].linear_velocity_m_s;
    const Vec3 angular = states[i].angular_velocity_rad_s - from[i].angular_velocity_rad_s;
    return !(linear.norm() + radius_m * angular.norm() <= most_m_s);
  };
  bool any = false;
  for (std::size_t i = 0; i < ids.size() && !any; ++i) any = is_hit(i);
  if (!any) return;
  for (std::size_t i = 0; i < ids.size(); ++i) states[i].impulses = from[i].impulses;
}

}  // namespace

Need refinement_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (scene.tolerance > 0.0)
    return contacts || joint_rows_needed(scene) ? Need{true, "islands are advanced to a tolerance"}
                                                : contacts;
  if (!contacts) return contacts;
  if (!scene.solver.refined) return {false, "switched off by the solver's quality"};
  const std::size_t unheld = unheld_bodies(scene);
  if (unheld == 0) return {false, "every body is driven or held by a joint"};
  return need_of(can_meet(unheld, scene.statics.size()), "bodies can slide or roll",
                 "one body alone is neither driven nor held by a joint");
}

bool is_affordable(const SceneDescription& scene, std::span<const ContactManifold> manifolds) {
  if (scene.tolerance > 0.0) return true;
  return !is_large(manifolds);
}

bool gains_by_refinement(const IslandStep& island, std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (any_kinematic(scene, ids)) return false;
  if (!(scene.tolerance > 0.0)) {
    if (!scene.solver.refined) return false;
    if (!is_of_first_order(scene, ids, manifolds, states)) return false;
    const auto driven = [&scene = scene](BodyId id) { return is_driven(scene, id); };
    if (std::ranges::any_of(ids, driven)) return false;
  }
  for (const ContactManifold& m : manifolds) {
    const std::uint32_t shape = scene.bodies[index_of(m.a)].shape;
    const double most_m = kSlop * geometry.impl().shapes[shape].shape.min_extent_m;
    if (least_separation_m(m) < -most_m) return false;
  }
  return true;
}

IslandReport advance_refined(const IslandStep& step, std::span<BodyState> states,
                             const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step;
  RefinedIsland island{step,
                       effects.scratch,
                       effects.counters,
                       sizes_of(scene, geometry, ids),
                       ErrorBudget(scene),
                       scene.tolerance > 0.0 ? Exactness::kCompared : Exactness::kOngoing,
                       find_explicit_springs(step, states)};
  island.limits = limits_of(scene, is_single_body(island), manifolds.size());
  std::vector<BodyState> now(states.begin(), states.end());
  IslandReport report;
  bool first = true;
  for (std::vector<SubInterval> parts{{dt_s, 0}}; !parts.empty();) {
    const SubInterval part = parts.back();
    parts.pop_back();
    RefinedSubInterval done = advance_sub_interval(
        island, part, now, part.depth == 0 ? manifolds : std::span<const ContactManifold>{});
    if (!done.result) {
      const double first_s = done.cut.share * part.time_s;
      parts.push_back({part.time_s - first_s, part.depth + 1});
      parts.push_back({first_s, part.depth + done.cut.halvings, done.cut.bend});
      continue;
    }
    SubIntervalResult& result = *done.result;
    if (result.trial.failed) return advance_unrefined(step, states, effects);
    if (part.depth == island.limits.deepest && !is_asked(island)) join_sub_intervals(parts);
    island.budget.spend(result.error, part.time_s, ids);
    island.past = {std::exchange(now, std::move(result.trial.states)), part.time_s};
    if (part.time_s < scene.dt_s) keep_loads(step, part.time_s, island.past.from, now);
    if (first)
      report = result.trial.report;
    else
      add_part(result.trial.report, report);
    first = false;
  }
  report.static_impulse_newton_s -= push_impulses_newton_s(scene, dt_s, ids, states);
  island.budget.tell(report);
  effects.counters.refined_steps += static_cast<std::uint64_t>(island.solves) - 1;
  std::move(now.begin(), now.end(), states.begin());
  return report;
}

IslandReport advance_unrefined(const IslandStep& island, std::span<BodyState> states,
                               const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const bool asked = scene.tolerance > 0.0;
  const std::vector<BodyState> from(states.begin(),
                                    asked || dt_s < scene.dt_s ? states.end() : states.begin());
  const double share = dt_s / scene.dt_s;
  scale_impulses(share, states);
  IslandReport report =
      advance_once(island, asked ? Exactness::kAccurate : Exactness::kOngoing, states, effects);
  scale_impulses(1.0 / share, states);
  if (dt_s < scene.dt_s) keep_loads(island, dt_s, from, states);
  if (!asked) return report;
  ErrorBudget budget(scene);
  const BodySizes sizes = sizes_of(scene, geometry, ids);
  budget.spend(larger(change_of(sizes, from, states), displacement_of(sizes, from, states, dt_s)),
               dt_s, ids);
  budget.tell(report);
  return report;
}

}  // namespace soda::physics
