#include "physics/solvers/blows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "physics/math/block_cholesky.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/substeps.hpp"

namespace soda::physics {
namespace {

constexpr double kSlow = 0.03;       // of the speed that fields give in a step
constexpr double kStill = 1e-11;     // of the width, in a step
constexpr double kOfHardest = 1e-7;  // of the step's hardest blow: what solving it leaves
// What Newton's method may take: factorisations of a blow, and for each body that its front may
// have to pass (fewer if the warm start is all that is wrong, which the iterations mend as well),
// and of all in a step; multiplications of a step, for each of its pairs in touch; and how many
// factorisations these must be enough for.
constexpr int kOfBlow = 12, kOfBody = 2, kOfOverestimate = 6, kFurther = 8, kOfStep = 128;
constexpr double kOfPair = 7000.0, kAnyway = 2e5, kWorthwhile = 4.0;
constexpr double kOfPairInHaste = 1000.0, kAnywayInHaste = 1e4;

Twist twist_of(const SolverBody& body) { return {body.linear, body.angular}; }

double closing_m_s(const NormalRow& row, const Twist& a, const Twist& b) {
  return row.normal.dot(a.linear - b.linear) + row.arm_a.dot(a.angular) - row.arm_b.dot(b.angular);
}

// The fastest that a point may close in the substep that comes.
double most_closing_m_s(const ContactProblem& problem, const Substeps& substeps, std::size_t i) {
  return std::max(gap_m(problem, i, substeps.displacements), 0.0) / substeps.length_s;
}

// How much faster a point closes than it may, if to stop that takes more than what it bears; else
// nothing.
double excess_closing_m_s(const ContactProblem& problem, const Substeps& substeps, std::size_t i,
                          double closing_m_s) {
  if (!(closing_m_s > 0.0)) return 0.0;
  const NormalRow& row = problem.normals[i];
  const double excess = closing_m_s - most_closing_m_s(problem, substeps, i);
  const double still = kStill * problem.contacts[i].size_m / substeps.length_s;
  return excess > still && row.mass_kg * excess > row.impulse_newton_s ? excess : 0.0;
}

// Rows by body, of those that move.
struct RowsOfBodies {
  std::vector<std::uint32_t> begin, rows;

  RowsOfBodies(const ContactProblem& problem, std::size_t bodies) : begin(bodies + 1, 0) {
    for (const NormalRow& row : problem.normals)
      for (const std::uint32_t body : {row.a, row.b})
        if (body < bodies) ++begin[body + 1];
    for (std::size_t i = 0; i < bodies; ++i) begin[i + 1] += begin[i];
    rows.resize(begin[bodies]);
    std::vector<std::uint32_t> next = begin;
    for (std::uint32_t i = 0; i < problem.normals.size(); ++i)
      for (const std::uint32_t body : {problem.normals[i].a, problem.normals[i].b})
        if (body < bodies) rows[next[body]++] = i;
  }
};

// What touches from body to body, from the rows `seeds` on: bodies and rows, ascending, and the
// rolling rows of these.
struct Cluster {
  std::vector<std::uint32_t> bodies, rows, rollings;
};

// Of a cluster's rows, those that press where a rolling row turns: first, and how many.
std::array<std::uint32_t, 2> pressing_rows(const Cluster& cluster, const RollingRow& rolling) {
  const auto first = std::ranges::lower_bound(cluster.rows, rolling.first_normal);
  const auto end =
      std::lower_bound(first, cluster.rows.end(), rolling.first_normal + rolling.points);
  return {static_cast<std::uint32_t>(first - cluster.rows.begin()),
          static_cast<std::uint32_t>(end - first)};
}

// `reach_m_s`: rows whose gap is farther away than that are not part of it, unless they bear.
Cluster cluster_of(const std::vector<std::uint32_t>& seeds, double reach_m_s,
                   const ContactProblem& problem, const Substeps& substeps) {
  const std::size_t bodies = substeps.at_start.size();
  const RowsOfBodies of(problem, bodies);
  std::vector<char> has_body(bodies, 0), has_row(problem.normals.size(), 0);
  Cluster cluster;
  const auto take = [&](std::uint32_t i) {
    has_row[i] = 1;
    cluster.rows.push_back(i);
    for (const std::uint32_t body : {problem.normals[i].a, problem.normals[i].b}) {
      if (body >= bodies || has_body[body]) continue;
      has_body[body] = 1;
      cluster.bodies.push_back(body);
    }
  };
  for (const std::uint32_t i : seeds)
    if (!has_row[i]) take(i);
  for (std::size_t next = 0; next < cluster.bodies.size(); ++next) {  // NOLINT: take() adds some
    const std::uint32_t body = cluster.bodies[next];
    for (std::uint32_t k = of.begin[body]; k < of.begin[body + 1]; ++k) {
      const std::uint32_t i = of.rows[k];
      if (has_row[i]) continue;
      if (problem.normals[i].impulse_newton_s > 0.0 ||
          most_closing_m_s(problem, substeps, i) <= reach_m_s)
        take(i);
    }
  }
  std::sort(cluster.bodies.begin(), cluster.bodies.end());
  std::sort(cluster.rows.begin(), cluster.rows.end());
  for (std::uint32_t r = 0; r < problem.rollings.size(); ++r)
    if (pressing_rows(cluster, problem.rollings[r])[1] > 0) cluster.rollings.push_back(r);
  return cluster;
}

// The rows and bodies of a cluster as a problem of their own, without impulses.
ContactProblem problem_of(const Cluster& cluster, const ContactProblem& whole,
                          const Substeps& substeps) {
  const std::size_t moving = substeps.at_start.size();
  std::vector<std::uint32_t> place(whole.bodies.size());
  ContactProblem problem;
  for (const std::uint32_t body : cluster.bodies) {
    place[body] = static_cast<std::uint32_t>(problem.bodies.size());
    problem.bodies.push_back(whole.bodies[body]);
  }
  for (std::size_t body = moving; body < whole.bodies.size(); ++body) {
    place[body] = static_cast<std::uint32_t>(problem.bodies.size());
    problem.bodies.push_back(whole.bodies[body]);
  }
  for (const std::uint32_t i : cluster.rows) {
    NormalRow row = whole.normals[i];
    row.a = place[row.a];
    row.b = place[row.b];
    row.target_m_s = -most_closing_m_s(whole, substeps, i);
    RowContact contact = whole.contacts[i];
    if (contact.friction_row >= 0) {
      FrictionRow friction = whole.frictions[contact.friction_row];
      friction.a = place[friction.a];
      friction.b = place[friction.b];
      friction.normal_row = static_cast<std::uint32_t>(problem.normals.size());
      contact.friction_row = static_cast<std::int32_t>(problem.frictions.size());
      problem.frictions.push_back(friction);
    }
    problem.normals.push_back(row);
    problem.contacts.push_back(contact);
  }
  for (const std::uint32_t r : cluster.rollings) {
    RollingRow row = whole.rollings[r];
    const auto [first, points] = pressing_rows(cluster, row);
    row.a = place[row.a];
    row.b = place[row.b];
    row.first_normal = first;
    row.points = points;
    problem.rollings.push_back(row);
  }
  forget_impulses(problem);
  return problem;
}

// Whether nothing closes faster than it may, but for rounding.
bool nothing_closes(double length_s, const ContactProblem& problem) {
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    const double closing =
        closing_m_s(row, twist_of(problem.bodies[row.a]), twist_of(problem.bodies[row.b]));
    if (closing + row.target_m_s > kStill * problem.contacts[i].size_m / length_s) return false;
  }
  return true;
}

int most_of_blow(std::size_t bodies) { return kOfBlow + kOfBody * static_cast<int>(bodies); }

// Faces on each other open and close one after the other: then the factorisations for an
// overestimate do not lead through more bodies than there are of them.
bool is_hopeless_overestimate(const Cluster& cluster) {
  constexpr std::size_t kPointsOfFaces = 2;  // a body, at least
  return cluster.bodies.size() > static_cast<std::size_t>(kOfOverestimate) &&
         cluster.rows.size() >= kPointsOfFaces * cluster.bodies.size();
}

// All contact laws at once, from the bodies' velocities and no impulses on, by `most`
// factorisations. Whether they are met.
bool meet_laws(int most, double length_s, std::size_t moving, ContactProblem& problem,
               BlowWork& work) {
  if (nothing_closes(length_s, problem)) return true;
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (const NormalRow& row : problem.normals)
    if (row.b < moving) edges.push_back({row.a, row.b});
  const double left = work.most_multiplications - static_cast<double>(work.multiplications);
  const std::optional<Elimination> plan =
      plan_elimination(static_cast<std::uint32_t>(moving), edges, left / kWorthwhile);
  if (!plan || is_costly(*plan, problem.normals.size())) return false;
  constexpr double kAccepted = 1e-4;
  const double affordable = std::min<double>(most, left / plan->multiplications);
  const DirectAim aim{
      .wanted = 1e-12,
      .rounding = 1e-9,
      .accepted = kAccepted,
      .factorisations = std::min(static_cast<int>(affordable), kOfStep - work.factorisations),
      .further = kFurther,
      .stalled = 1e-6};
  const auto end = problem.bodies.begin() + static_cast<std::ptrdiff_t>(moving);
  const std::vector<SolverBody> before(problem.bodies.begin(), end);
  const NewtonOutcome outcome = solve_directly(aim, before, *plan, problem);
  work.factorisations += outcome.factorisations;
  work.multiplications +=
      static_cast<std::uint64_t>(outcome.factorisations * plan->multiplications);
  work.gave_up = !outcome.converged || work.factorisations == kOfStep;
  return outcome.converged;
}

// The blow's impulses join the sums.
void add_blow(const Cluster& cluster, const ContactProblem& solved, Substeps& substeps) {
  for (std::size_t k = 0; k < cluster.rows.size(); ++k) {
    double* const sum = &substeps.sum_newton_s[3 * cluster.rows[k]];
    sum[0] += solved.normals[k].impulse_newton_s;
    const std::int32_t friction = solved.contacts[k].friction_row;
    if (friction < 0) continue;
    sum[1] += solved.frictions[friction].impulse_newton_s[0];
    sum[2] += solved.frictions[friction].impulse_newton_s[1];
  }
  for (std::size_t k = 0; k < cluster.rollings.size(); ++k)
    substeps.sum_newton_m_s[cluster.rollings[k]] += solved.rollings[k].impulse_newton_m_s;
}

void set_impulses(const Cluster& cluster, const ContactProblem& solved, ContactProblem& whole) {
  for (std::size_t k = 0; k < cluster.rows.size(); ++k) {
    const std::uint32_t i = cluster.rows[k];
    whole.normals[i].impulse_newton_s = solved.normals[k].impulse_newton_s;
    const std::int32_t friction = solved.contacts[k].friction_row;
    if (friction < 0) continue;
    FrictionRow& row = whole.frictions[whole.contacts[i].friction_row];
    for (int t = 0; t < 2; ++t)
      row.impulse_newton_s[t] = solved.frictions[friction].impulse_newton_s[t];
  }
  for (std::size_t k = 0; k < cluster.rollings.size(); ++k)
    whole.rollings[cluster.rollings[k]].impulse_newton_m_s = solved.rollings[k].impulse_newton_m_s;
}

// A blow that all laws are met after: what it reaches, and that by itself.
struct SharedBlow {
  Cluster cluster;
  ContactProblem part;
};

// From rows `seeds` (overestimated ones) and those that close by the bodies' velocities `twist`;
// nothing where there are none, or where the blow is left to the iterations.
template <class TwistOf>
std::optional<SharedBlow> share_out(const Blows& blows, std::vector<std::uint32_t> seeds,
                                    const TwistOf& twist, const ContactProblem& problem,
                                    Substeps& substeps, BlowWork& work) {
  const std::size_t overestimated = seeds.size();
  double reach_m_s = 0.0;
  for (const std::uint32_t i : blows.may_close) {
    const NormalRow& row = problem.normals[i];
    const double excess =
        excess_closing_m_s(problem, substeps, i, closing_m_s(row, twist(row.a), twist(row.b)));
    if (!(excess > kOfHardest * work.hardest_m_s)) continue;
    seeds.push_back(i);
    reach_m_s = std::max(reach_m_s, 2.0 * excess);
  }
  if (seeds.empty()) return {};
  work.most_multiplications = blows.most_multiplications;
  work.hardest_m_s = std::max(work.hardest_m_s, 0.5 * reach_m_s);
  ++work.left;
  if (work.gave_up) return {};
  SharedBlow blow{cluster_of(seeds, reach_m_s, problem, substeps), {}};
  blow.part = problem_of(blow.cluster, problem, substeps);
  const std::size_t moving = blow.cluster.bodies.size();
  for (std::size_t k = 0; k < moving; ++k) {
    const Twist begin = twist(blow.cluster.bodies[k]);
    blow.part.bodies[k].linear = begin.linear;
    blow.part.bodies[k].angular = begin.angular;
  }
  const bool only_overestimated = seeds.size() == overestimated;
  work.gave_up = only_overestimated && is_hopeless_overestimate(blow.cluster) &&
                 !nothing_closes(substeps.length_s, blow.part);
  if (work.gave_up) return {};
  const int most = only_overestimated ? kOfOverestimate : most_of_blow(moving);
  if (!meet_laws(most, substeps.length_s, moving, blow.part, work)) return {};
  --work.left;
  ++work.shared;
  add_blow(blow.cluster, blow.part, substeps);
  return blow;
}

}  // namespace

Need blows_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (!scene.solver.direct) return {false, "the direct solver is switched off"};
  return need_of(scene.bodies.size() > 2, "three bodies can touch", "no three bodies");
}

namespace {

// Rows of a pair follow one another.
double pairs_in_touch(const ContactProblem& problem) {
  double pairs = 0.0;
  const NormalRow* last = nullptr;
  for (const NormalRow& row : problem.normals) {
    if (last == nullptr || row.a != last->a || row.b != last->b) pairs += 1.0;
    last = &row;
  }
  return pairs;
}

}  // namespace

Blows find_blows(const SolveStep& step, const ContactProblem& problem) {
  const auto& [scene, dt_s, ids, states] = step;
  Blows blows;
  if (!scene.solver.direct) return blows;
  const double pairs = pairs_in_touch(problem);
  blows.most_multiplications =
      scene.solver.refined ? kAnyway + kOfPair * pairs : kAnywayInHaste + kOfPairInHaste * pairs;
  const auto motion = [&, &states = states](std::uint32_t i) {
    if (i < states.size())
      return Twist{states[i].linear_velocity_m_s, states[i].angular_velocity_rad_s};
    return twist_of(problem.bodies[i]);
  };
  const double slow = kSlow * strongest_field_m_s2(scene, ids) * dt_s;
  for (std::uint32_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    const RowContact& contact = problem.contacts[i];
    const bool bears = row.impulse_newton_s > 0.0;
    const double least = (bears ? slow : 0.0) + kStill * contact.size_m / dt_s;
    if (std::abs(closing_m_s(row, motion(row.a), motion(row.b))) > least || !bears)
      blows.may_close.push_back(i);
    const double borne =
        closing_m_s(row, twist_of(problem.bodies[row.a]), twist_of(problem.bodies[row.b]));
    if (bears && borne < -least) blows.overestimated.push_back(i);
  }
  return blows;
}

void start_with_blow(const Blows& blows, std::span<const SolverBody> free, ContactProblem& problem,
                     Substeps& substeps, BlowWork& work) {
  std::vector<PositionCorrection>& start = substeps.at_start;
  const auto at_start = [&](std::uint32_t i) {
    return i < start.size() ? Twist{start[i].linear, start[i].angular}
                            : twist_of(problem.bodies[i]);
  };
  std::optional<SharedBlow> blow =
      share_out(blows, blows.overestimated, at_start, problem, substeps, work);
  if (!blow) return;
  auto& [cluster, part] = *blow;
  const std::size_t moving = cluster.bodies.size();
  const double share = 1.0 / substeps.count;
  for (std::size_t k = 0; k < moving; ++k) {
    const std::uint32_t i = cluster.bodies[k];
    SolverBody& body = part.bodies[k];
    const PositionCorrection after{body.linear, body.angular};
    body.linear += (free[i].linear - start[i].linear) * share;
    body.angular += (free[i].angular - start[i].angular) * share;
    start[i] = after;
  }
  forget_impulses(part);
  meet_laws(most_of_blow(moving), substeps.length_s, moving, part, work);
  set_impulses(cluster, part, problem);
  for (std::size_t k = 0; k < moving; ++k) problem.bodies[cluster.bodies[k]] = part.bodies[k];
}

void share_blow(const Blows& blows, ContactProblem& problem, Substeps& substeps, BlowWork& work) {
  const auto now = [&](std::uint32_t i) { return twist_of(problem.bodies[i]); };
  const std::optional<SharedBlow> blow = share_out(blows, {}, now, problem, substeps, work);
  if (!blow) return;
  for (std::size_t k = 0; k < blow->cluster.bodies.size(); ++k) {
    const SolverBody& after = blow->part.bodies[k];
    SolverBody& body = problem.bodies[blow->cluster.bodies[k]];
    PositionCorrection& start = substeps.at_start[blow->cluster.bodies[k]];
    start.linear += after.linear - body.linear;
    start.angular += after.angular - body.angular;
    body = after;
  }
}

}  // namespace soda::physics
