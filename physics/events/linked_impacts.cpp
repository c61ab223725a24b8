#include "physics/events/linked_impacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/continuous/time_of_impact.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_places.hpp"
#include "physics/refinement/step_doubling.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::physics {
namespace {

constexpr double kInPlace = 1e-5;  // of the width: places of parts are found to that

bool bounces(const SceneDescription& scene, const ContactManifold& m) {
  return !is_joint(m) && m.count > 0 &&
         std::max(material_of(scene, m.a).restitution, material_of(scene, m.b).restitution) > 0.0;
}

// A point at which two bodies touch. Impulses are those on b.
struct TouchingPoint {
  std::uint32_t a = 0, b = 0;      // local indices; of a static the number of bodies
  std::array<Vec3, 3> directions;  // the normal first
  Vec3 position_m, arm_a, arm_b;
  double friction = 0.0, restitution = 0.0;
};

Vec3 relative_velocity(const TouchingPoint& p, std::span<const SolverBody> bodies) {
  const SolverBody &a = bodies[p.a], &b = bodies[p.b];
  const Vec3 at_a = a.linear + a.angular.cross(p.arm_a), at_b = b.linear + b.angular.cross(p.arm_b);
  const Vec3 v = at_b - at_a;
  return {v.dot(p.directions[0]), v.dot(p.directions[1]), v.dot(p.directions[2])};
}

void apply(const TouchingPoint& p, const Vec3& along, std::span<SolverBody> bodies) {
  const Vec3 impulse =
      p.directions[0] * along[0] + p.directions[1] * along[1] + p.directions[2] * along[2];
  SolverBody &a = bodies[p.a], &b = bodies[p.b];
  a.linear -= impulse * a.inverse_mass;
  a.angular -= a.inverse_inertia * p.arm_a.cross(impulse);
  b.linear += impulse * b.inverse_mass;
  b.angular += b.inverse_inertia * p.arm_b.cross(impulse);
}

std::vector<TouchingPoint> points_in_touch(const IslandStep& island,
                                           std::span<const ContactManifold> manifolds,
                                           std::span<const BodyState> states) {
  const SceneDescription& scene = island.scene;
  std::vector<TouchingPoint> points;
  for (const ContactManifold& m : manifolds) {
    if (!bounces(scene, m)) continue;
    const double touching_m = kInPlace * width_of(scene, island.geometry, m.a, m.b);
    const Material &of_a = material_of(scene, m.a), &of_b = material_of(scene, m.b);
    const Tangents tangents = tangents_of(m.normal);
    for (std::uint32_t i = 0; i < m.count; ++i) {
      if (m.points[i].separation_m > touching_m) continue;
      TouchingPoint p;
      p.a = static_cast<std::uint32_t>(place_of(island.ids, m.a));
      p.b = static_cast<std::uint32_t>(is_static(m.b) ? states.size() : place_of(island.ids, m.b));
      p.directions = {m.normal, tangents.first, tangents.second};
      p.position_m = m.points[i].position_m;
      p.arm_a = p.position_m - states[p.a].position_m;
      p.arm_b = is_static(m.b) ? Vec3(Vec3::Zero()) : Vec3(p.position_m - states[p.b].position_m);
      p.friction = std::sqrt(of_a.friction * of_b.friction);
      p.restitution = std::max(of_a.restitution, of_b.restitution);
      points.push_back(p);
    }
  }
  return points;
}

// What a unit of impulse along each direction of a point does to all bodies while joints hold.
struct BounceResponse {
  std::array<std::vector<SolverBody>, 3> bodies;
  Mat3 of_point;  // column k: the velocity there by a unit along k
};

BounceResponse response_of(const TouchingPoint& p, std::span<const SolverBody> bodies,
                           JointSystem joints) {
  BounceResponse response;
  for (int k = 0; k < 3; ++k) {
    std::vector<SolverBody>& moved = response.bodies[static_cast<std::size_t>(k)];
    moved.assign(bodies.begin(), bodies.end());
    for (SolverBody& body : moved) body.linear = body.angular = Vec3::Zero();
    for (JointRow& row : joints.rows) row.impulse_newton_s = 0.0;
    apply(p, Vec3::Unit(k), moved);
    solve_joint_velocities(joints, moved);
    response.of_point.col(k) = relative_velocity(p, moved);
  }
  return response;
}

// A point that is hit, and what it is to have.
struct StruckPoint {
  const TouchingPoint* point = nullptr;
  const BounceResponse* response = nullptr;
  Vec3 before = Vec3::Zero(), impulse = Vec3::Zero();
};

struct BounceLaw {
  bool friction = true;
  double most_restitution = 1.0;
};

// All at once, by Gauss and Seidel: normal velocities turn round, friction stops what its cone lets
// it.
void solve_hits(const BounceLaw& law, std::vector<StruckPoint>& hits,
                std::vector<SolverBody>& bodies) {
  constexpr int kMostIterations = 200;
  constexpr double kEnough = 1e-13;  // of the fastest
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    double most = 0.0, fastest = 0.0;
    for (StruckPoint& hit : hits) {
      const TouchingPoint& p = *hit.point;
      const Mat3& response = hit.response->of_point;
      const double restitution = std::min(p.restitution, law.most_restitution);
      const Vec3 now = relative_velocity(p, bodies);
      Vec3 next = hit.impulse;
      next[0] = std::max(0.0, next[0] + (-restitution * hit.before[0] - now[0]) / response(0, 0));
      if (law.friction && p.friction > 0.0) {
        for (int k = 1; k < 3; ++k)
          if (response(k, k) > 0.0) next[k] -= now[k] / response(k, k);
        const double across = std::sqrt(next[1] * next[1] + next[2] * next[2]),
                     cone = p.friction * next[0];
        if (across > cone) next.tail<2>() *= cone / across;
      }
      const Vec3 change = next - hit.impulse;
      hit.impulse = next;
      for (std::size_t k = 0; k < 3; ++k) {
        if (change[static_cast<Eigen::Index>(k)] == 0.0) continue;
        for (std::size_t b = 0; b < bodies.size(); ++b) {
          bodies[b].linear +=
              hit.response->bodies[k][b].linear * change[static_cast<Eigen::Index>(k)];
          bodies[b].angular +=
              hit.response->bodies[k][b].angular * change[static_cast<Eigen::Index>(k)];
        }
      }
      most = std::max(most, std::abs(change[0]) * response(0, 0));
      fastest = std::max(fastest, -hit.before[0]);
    }
    if (most <= kEnough * fastest) return;
  }
}

// By which the hits change the energy.
double work_joule(std::span<const StruckPoint> hits, std::span<const SolverBody> bodies) {
  double sum = 0.0;
  for (const StruckPoint& hit : hits)
    sum += 0.5 * hit.impulse.dot(hit.before + relative_velocity(*hit.point, bodies));
  return sum;
}

// Friction, and unlike restitutions, can give energy where several are hit.
void resolve_hits(std::vector<StruckPoint>& hits, std::vector<SolverBody>& bodies) {
  double least = 1.0;
  for (const StruckPoint& hit : hits) least = std::min(least, hit.point->restitution);
  const std::vector<SolverBody> before = bodies;
  for (const BounceLaw& law : {BounceLaw{}, BounceLaw{false}, BounceLaw{false, least}}) {
    bodies = before;
    for (StruckPoint& hit : hits) hit.impulse = Vec3::Zero();
    solve_hits(law, hits, bodies);
    if (work_joule(hits, bodies) <= 0.0) return;
  }
}

void report_momentum(const IslandStep& island, std::span<const BodyState> before,
                     std::span<const BodyState> after, IslandReport& report) {
  const IslandMomentum was = momentum_of(island.scene, island.ids, before),
                       is = momentum_of(island.scene, island.ids, after);
  const Vec3 given = is.linear_newton_s - was.linear_newton_s;
  report.static_impulse_newton_s += given;
  report.static_angular_impulse_newton_m_s +=
      is.centre_m.cross(given) + (is.angular_newton_m_s - was.angular_newton_m_s);
}

// Neither touches and comes nearer nor pressed.
bool is_to_be_located(const IslandStep& island, const ContactManifold& m,
                      std::span<const BodyState> states) {
  if (!bounces(island.scene, m) || is_mesh(island.scene, m.b)) return false;
  const double touching_m = kInPlace * width_of(island.scene, island.geometry, m.a, m.b);
  const BodyState& a = states[place_of(island.ids, m.a)];
  for (std::uint32_t i = 0; i < m.count; ++i) {
    const ContactPoint& point = m.points[i];
    if (pressed(a, m, point.feature)) return false;
    if (point.separation_m > touching_m) continue;
    const Vec3 of_b = is_static(m.b)
                          ? Vec3(Vec3::Zero())
                          : velocity_at(states[place_of(island.ids, m.b)], point.position_m);
    if ((velocity_at(a, point.position_m) - of_b).dot(m.normal) > 0.0) return false;
  }
  return true;
}

bool is_among(std::span<const Touching> pairs, const ContactManifold& m) {
  return std::ranges::any_of(pairs,
                             [&m](const Touching& pair) { return pair.a == m.a && pair.b == m.b; });
}

// Nothing that joints hold in place along the normal.
bool can_be_hit(const BounceResponse& response) {
  constexpr double kRounding = 1e-12;
  return response.of_point.allFinite() &&
         response.of_point(0, 0) > kRounding * response.of_point.trace();
}

// Unless they hold more energy: joints that contradict each other have no exact answer.
bool take_velocities(const IslandStep& island, const JointSystem& joints,
                     std::span<const SolverBody> bodies, std::span<BodyState> states,
                     IslandReport& report) {
  constexpr double kRounding = 1e-12;
  std::vector<BodyState> after(states.begin(), states.end());
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (bodies[i].inverse_mass == 0.0) continue;
    after[i].linear_velocity_m_s = bodies[i].linear;
    after[i].angular_velocity_rad_s = bodies[i].angular;
  }
  const double has = kinetic_joule(island.scene, island.ids, after),
               had = kinetic_joule(island.scene, island.ids, states);
  if (!(has <= (1.0 + kRounding) * had)) return false;
  add_loads(joints, report);
  report_momentum(island, states, after, report);
  std::ranges::move(after, states.begin());
  return true;
}

}  // namespace

bool bounce_in_time(const IslandStep& island, std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (std::ranges::none_of(manifolds,
                           [&](const ContactManifold& m) { return bounces(island.scene, m); }))
    return false;
  JointSystem joints = find_joints(scene, ids, manifolds);
  return !choose_jointed_solve(island, false, states, joints).swept;
}

BouncesInTime find_bounces_in_time(const IslandStep& island,
                                   std::span<const ContactManifold> manifolds,
                                   std::span<const Touching> held,
                                   std::span<const BodyState> states) {
  BouncesInTime bounces;
  for (const ContactManifold& m : manifolds)
    if (!is_joint(m) && !is_among(held, m) && is_to_be_located(island, m, states))
      bounces.pairs.push_back({m.a, m.b});
  for (const ContactManifold& m : manifolds)
    if (is_joint(m) || !is_among(bounces.pairs, m)) bounces.others.push_back(m);
  return bounces;
}

bool have_missed_one(const IslandStep& island, std::span<const Touching> pairs,
                     std::span<const BodyState> before, std::span<const BodyState> after) {
  constexpr double kVisible = 1e-3;  // of the width
  return std::ranges::any_of(pairs, [&](const Touching& pair) {
    const auto distance_m = [&](std::span<const BodyState> at) {
      const BodyState* const b = is_static(pair.b) ? nullptr : &at[place_of(island.ids, pair.b)];
      return separation_of({island.scene, island.geometry, 0.0, pair.a,
                            at[place_of(island.ids, pair.a)], pair.b, b})
          .distance_m;
    };
    const double visible_m = kVisible * width_of(island.scene, island.geometry, pair.a, pair.b);
    return distance_m(after) < std::min(0.0, distance_m(before)) - visible_m;
  });
}

void add_bounces(const IslandReport& bounces, IslandReport& report) {
  report.static_impulse_newton_s += bounces.static_impulse_newton_s;
  report.static_angular_impulse_newton_m_s += bounces.static_angular_impulse_newton_m_s;
  for (const JointLoad& load : bounces.joint_loads) add_load(load, report);
}

bool resolve_linked_impacts(const IslandStep& island, std::span<const ContactManifold> manifolds,
                            std::span<BodyState> states, IslandReport& report,
                            StageCounters& counters) {
  const auto& [scene, geometry, dt_s, ids, given] = island;
  const std::vector<TouchingPoint> points = points_in_touch(island, manifolds, states);
  if (points.empty()) return false;
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  const double slow_m_s = scene.solver.restitution_threshold_m_s;
  const auto comes_fast = [&](const TouchingPoint& p) {
    return -relative_velocity(p, bodies)[0] > slow_m_s;
  };
  if (std::ranges::none_of(points, comes_fast)) return false;
  const std::vector<SolverBody> start = bodies;
  JointSystem joints = find_joints(scene, ids, manifolds);
  build_joint_rows(scene, dt_s, states, false, joints);
  stop_joint_velocities(bodies, joints);
  std::vector<std::optional<BounceResponse>> responses(points.size());
  std::vector<Vec3> impulses(points.size(), Vec3::Zero());
  const std::size_t most_rounds = 60 + 10 * points.size();
  std::size_t rounds = 0;
  for (; rounds < most_rounds; ++rounds) {
    std::vector<StruckPoint> hits;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!comes_fast(points[i])) continue;
      if (!responses[i]) responses[i] = response_of(points[i], bodies, joints);
      if (!can_be_hit(*responses[i])) continue;
      hits.push_back({&points[i], &*responses[i], relative_velocity(points[i], bodies)});
      places.push_back(i);
    }
    if (hits.empty()) break;
    resolve_hits(hits, bodies);
    for (std::size_t k = 0; k < hits.size(); ++k) impulses[places[k]] += hits[k].impulse;
    ++counters.impacts;
  }
  if (rounds == 0) return false;
  // Once more together: joints tell their impulses.
  bodies = start;
  for (JointRow& row : joints.rows) row.impulse_newton_s = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) apply(points[i], impulses[i], bodies);
  solve_joint_velocities(joints, bodies);
  return take_velocities(island, joints, bodies, states, report);
}

}  // namespace soda::physics
