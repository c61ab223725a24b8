#include "physics/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "physics/contact_solver.hpp"
#include "physics/forces.hpp"
#include "physics/geometry_impl.hpp"
#include "physics/island_blocks.hpp"
#include "physics/rigid_motion.hpp"

namespace soda::physics {
namespace {

constexpr double kOwnTolerance = 1e-7;  // of a single body; of its width, for each part of a step
constexpr int kOwnMostSolves = 150, kMostSolves = 3000;
constexpr int kDeepest = 12;  // halvings

struct Limits {
  double tolerance = kOwnTolerance;
  int most_solves = kOwnMostSolves;
};

Limits limits_of(const SceneDescription& scene) {
  if (!(scene.solver.tolerance > 0.0)) return {};
  return {scene.solver.tolerance, kMostSolves};
}

// A number of equal steps over the same time, from the same states.
struct Trial {
  std::vector<BodyState> states;
  IslandReport report;
  bool failed = false;
  std::vector<Vec3> velocities, spins;  // after each step, of all bodies
};

struct Island {
  const SceneDescription& scene;
  const Geometry& geometry;
  std::span<const BodyId> ids;
  std::span<const ContactManifold> pairs;
  std::vector<double> radii_m, widths_m;
  StageCounters& counters;
  int solves = 0;
};

// Stored impulses are those of a whole step, whatever the length of the last part.
void scale_impulses(double factor, std::vector<BodyState>& states) {
  if (factor == 1.0) return;
  for (BodyState& state : states) {
    for (ContactImpulse& impulse : state.impulses) {
      impulse.normal_newton_s *= factor;
      impulse.friction_newton_s *= factor;
    }
  }
}

// `known`: the contacts at `from` over the length of a step, if they have been found already.
Trial try_steps(Island& island, std::span<const BodyState> from, double time_s, int steps,
                std::span<const ContactManifold> known = {}) {
  Trial trial{{from.begin(), from.end()}, {}, false, {}, {}};
  const double dt_s = time_s / steps, share = dt_s / island.scene.dt_s;
  std::vector<AdvanceFault> faults;
  for (int i = 0; i < steps; ++i) {
    scale_impulses(share, trial.states);
    std::vector<ContactManifold> found;
    if (known.empty())
      found = found_again(island.scene, island.geometry, dt_s, island.ids, island.pairs,
                          trial.states, island.counters);
    const IslandReport part =
        advance_once(island.scene, dt_s, island.ids, known.empty() ? found : known, trial.states,
                     island.counters, faults);
    scale_impulses(1.0 / share, trial.states);
    if (i == 0)
      trial.report = part;
    else
      add_part(part, trial.report);
    for (const BodyState& state : trial.states) {
      trial.velocities.push_back(state.linear_velocity_m_s);
      trial.spins.push_back(state.angular_velocity_rad_s);
    }
    ++island.solves;
  }
  trial.failed = !faults.empty();
  return trial;
}

// Of one body, as a length: what a point of it can be off now, or after another step.
double length_of(const Island& island, std::size_t body, const Vec3& place, const Vec3& turn,
                 const Vec3& velocity, const Vec3& spin) {
  const double dt_s = island.scene.dt_s, radius = island.radii_m[body];
  return (place.norm() + radius * turn.norm() + dt_s * (velocity.norm() + radius * spin.norm())) /
         island.widths_m[body];
}

// Twice the vector part of the rotation from `from` to `to`, for small ones.
Vec3 turn_between(const Quat& from, const Quat& to) {
  const Quat difference = to * from.conjugate();
  return 2.0 * (difference.w() < 0.0 ? Vec3(-difference.vec()) : difference.vec());
}

// Largest difference of the states from motion at constant velocities.
double unevenness(const Island& island, std::span<const BodyState> from, const Trial& one) {
  double most = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const BodyState& next = one.states[i];
    most = std::max(most, length_of(island, i, Vec3::Zero(), Vec3::Zero(),
                                    next.linear_velocity_m_s - from[i].linear_velocity_m_s,
                                    next.angular_velocity_rad_s - from[i].angular_velocity_rad_s));
  }
  return most;
}

// A third of the difference of the extrapolations 2 T2 - T1 and 2 T4 - T2.
double error_of(const Island& island, const Trial& one, const Trial& two, const Trial& four) {
  double most = 0.0;
  for (std::size_t i = 0; i < one.states.size(); ++i) {
    const BodyState &a = one.states[i], &b = two.states[i], &c = four.states[i];
    const auto differ = [](const Vec3& x, const Vec3& y, const Vec3& z) -> Vec3 {
      return (2.0 * (z - y) - (y - x)) * (1.0 / 3.0);
    };
    const Vec3 turn = (2.0 * turn_between(b.orientation, c.orientation) -
                       turn_between(a.orientation, b.orientation)) *
                      (1.0 / 3.0);
    most = std::max(
        most, length_of(island, i, differ(a.position_m, b.position_m, c.position_m), turn,
                        differ(a.linear_velocity_m_s, b.linear_velocity_m_s, c.linear_velocity_m_s),
                        differ(a.angular_velocity_rad_s, b.angular_velocity_rad_s,
                               c.angular_velocity_rad_s)));
  }
  return most;
}

// What the velocities of four steps deviate from a smooth course: their fourth difference. It shows
// a change (from sliding to sticking, say) within the first or last step, which all extrapolations
// see alike.
double roughness(const Island& island, std::span<const BodyState> from, const Trial& four) {
  const std::size_t n = from.size();
  double most = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto difference = [&](const Vec3& first, const std::vector<Vec3>& path) -> Vec3 {
      return first + path[3 * n + i] + 6.0 * path[n + i] - 4.0 * (path[i] + path[2 * n + i]);
    };
    most = std::max(most, length_of(island, i, Vec3::Zero(), Vec3::Zero(),
                                    difference(from[i].linear_velocity_m_s, four.velocities),
                                    difference(from[i].angular_velocity_rad_s, four.spins)));
  }
  return most;
}

// 8/3 T4 - 2 T2 + 1/3 T1: free of the first and second power of the step.
Vec3 limit_of(const Vec3& one, const Vec3& two, const Vec3& four) {
  return four + ((four - two) * 5.0 + (one - two)) * (1.0 / 3.0);
}

Trial extrapolated(const Trial& one, const Trial& two, Trial four) {
  for (std::size_t i = 0; i < four.states.size(); ++i) {
    const BodyState &a = one.states[i], &b = two.states[i];
    BodyState& c = four.states[i];
    c.position_m = limit_of(a.position_m, b.position_m, c.position_m);
    c.linear_velocity_m_s =
        limit_of(a.linear_velocity_m_s, b.linear_velocity_m_s, c.linear_velocity_m_s);
    c.angular_velocity_rad_s =
        limit_of(a.angular_velocity_rad_s, b.angular_velocity_rad_s, c.angular_velocity_rad_s);
    const Vec3 turn = (5.0 * turn_between(b.orientation, c.orientation) +
                       turn_between(b.orientation, a.orientation)) *
                      (1.0 / 3.0);
    c.orientation = turned(turn, c.orientation);
  }
  const auto extrapolate = [&](Vec3 IslandReport::*sum) {
    four.report.*sum = limit_of(one.report.*sum, two.report.*sum, four.report.*sum);
  };
  extrapolate(&IslandReport::static_impulse_newton_s);
  extrapolate(&IslandReport::static_angular_impulse_newton_m_s);
  const auto work = [](const Trial& trial) {
    return Vec3(trial.report.push_out_work_joule, 0.0, 0.0);
  };
  four.report.push_out_work_joule = limit_of(work(one), work(two), work(four)).x();
  return four;
}

bool has_moving_surface(const Island& island) {
  for (const ContactManifold& m : island.pairs) {
    if (!is_static(m.b)) continue;
    if (island.scene.statics[static_index_of(m.b)].surface_velocity_m_s != Vec3::Zero())
      return true;
  }
  return false;
}

// Steps give no energy, but what is extrapolated from them may have a trace more: velocities shrink
// by as much, which keeps their directions. Then statics gave that much less. False if it is more
// than a trace.
bool without_gain(const Island& island, std::span<const BodyState> from, Trial& trial) {
  constexpr double kTrace = 1e-3;
  if (has_moving_surface(island)) return true;
  const double moving = kinetic_joule(island.scene, island.ids, trial.states);
  const double gain =
      gain_joule(island.scene, island.ids, from, trial.states) - trial.report.push_out_work_joule;
  if (!(gain > 0.0)) return true;
  if (!(gain <= kTrace * moving)) return false;
  const double share = std::sqrt(1.0 - gain / moving);
  for (std::size_t i = 0; i < from.size(); ++i) {
    BodyState& state = trial.states[i];
    trial.report.static_impulse_newton_s +=
        state.linear_velocity_m_s *
        ((share - 1.0) * island.scene.bodies[index_of(island.ids[i])].mass_kg);
    state.linear_velocity_m_s *= share;
    state.angular_velocity_rad_s *= share;
  }
  return true;
}

struct Part {
  double time_s = 0.0;
  int depth = 0;
};

// The whole part if it can be had within the tolerance; else nothing, and it is to be halved.
std::optional<Trial> advance_part(Island& island, const Limits& limits, const Part& part,
                                  std::span<const BodyState> from,
                                  std::span<const ContactManifold> known) {
  Trial one = try_steps(island, from, part.time_s, 1, known);
  if (one.failed || unevenness(island, from, one) <= limits.tolerance) return one;
  if (part.depth == kDeepest || island.solves >= limits.most_solves) return one;
  const Trial two = try_steps(island, from, part.time_s, 2);
  Trial four = try_steps(island, from, part.time_s, 4);
  if (two.failed || four.failed) return one;
  const double quarter = 0.25 * part.time_s / island.scene.dt_s;
  if (error_of(island, one, two, four) > limits.tolerance ||
      quarter * roughness(island, from, four) > limits.tolerance)
    return std::nullopt;
  Trial limit = extrapolated(one, two, four);
  return without_gain(island, from, limit) ? std::move(limit) : std::move(four);
}

}  // namespace

std::vector<ContactManifold> found_again(const SceneDescription& scene, const Geometry& geometry,
                                         double dt_s, std::span<const BodyId> ids,
                                         std::span<const ContactManifold> manifolds,
                                         std::span<const BodyState> states,
                                         StageCounters& counters) {
  std::vector<ContactManifold> found;
  const auto place = [&ids](BodyId id) {
    return static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  };
  const ContactManifold* before = nullptr;
  for (const ContactManifold& m : manifolds) {
    const bool again = before != nullptr && before->a == m.a && before->b == m.b;
    before = &m;
    if (again || m.b == kWorldBody) continue;
    collide(scene, geometry, dt_s, m.a, states[place(m.a)], m.b,
            is_static(m.b) ? nullptr : &states[place(m.b)], found, counters);
  }
  append_world_joints(scene, ids, found);
  return found;
}

bool is_refined(const SceneDescription& scene, const Geometry& geometry,
                std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  if (ids.size() > 1 && !(scene.solver.tolerance > 0.0)) return false;
  if (is_giant(manifolds)) return false;
  for (const BodyId id : ids) {
    const BodyParams& params = scene.bodies[index_of(id)];
    if (is_pushed(params) || params.joints > 0) return false;
  }
  for (const ContactManifold& m : manifolds) {
    const std::uint32_t shape = scene.bodies[index_of(m.a)].shape;
    const double most_m = kSlop * geometry.impl().shapes[shape].shape.min_extent_m;
    for (std::uint32_t i = 0; i < m.count; ++i)
      if (m.points[i].separation_m < -most_m) return false;
  }
  return true;
}

IslandReport advance_refined(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, StageCounters& counters,
                             std::vector<AdvanceFault>& faults) {
  Island island{scene, geometry, ids, manifolds, {}, {}, counters};
  for (const BodyId id : ids) {
    const CompiledShape& shape = geometry.impl().shapes[scene.bodies[index_of(id)].shape].shape;
    island.radii_m.push_back(shape.bounding_radius_m);
    island.widths_m.push_back(shape.min_extent_m);
  }
  const Limits limits = limits_of(scene);
  std::vector<BodyState> now(states.begin(), states.end());
  IslandReport report;
  bool first = true;
  for (std::vector<Part> parts{{dt_s, 0}}; !parts.empty();) {
    const Part part = parts.back();
    parts.pop_back();
    std::optional<Trial> trial =
        advance_part(island, limits, part, now,
                     part.time_s == dt_s ? manifolds : std::span<const ContactManifold>{});
    if (!trial) {
      parts.insert(parts.end(), 2, {0.5 * part.time_s, part.depth + 1});
      continue;
    }
    if (trial->failed) return advance_once(scene, dt_s, ids, manifolds, states, counters, faults);
    now = std::move(trial->states);
    if (first)
      report = trial->report;
    else
      add_part(trial->report, report);
    first = false;
  }
  counters.refined_steps += static_cast<std::uint64_t>(island.solves) - 1;
  std::move(now.begin(), now.end(), states.begin());
  return report;
}

}  // namespace soda::physics
