#include "physics/solvers/dense_contact_solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/contact_solver.hpp"

namespace soda::physics {
namespace {

// Normal and friction of each point, rolling friction of two manifolds.
constexpr std::size_t kMostLines = kMostFewLines;

// One direction at one point: the relative velocity along it, and the impulse.
struct Line {
  std::uint32_t a = 0, b = 0;
  Vec3 direction, moment_a, moment_b;  // arm x direction
  Vec3 response_a, response_b;         // inverse inertia of that
  double impulse = 0.0;

  double velocity(const std::vector<SolverBody>& bodies) const {
    return direction.dot(bodies[b].linear - bodies[a].linear) + moment_b.dot(bodies[b].angular) -
           moment_a.dot(bodies[a].angular);
  }
};

struct DenseContacts {
  // First the normals, then two for each friction, then three for each rolling row.
  std::size_t normals = 0, rollings = 0, lines = 0;  // `rollings`: where these begin
  std::array<Line, kMostLines> line;
  std::array<double, kMostLines> velocity;
  std::array<std::array<double, kMostLines>, kMostLines> response;  // [by][of], symmetric

  void add(std::size_t by, double change) {
    line[by].impulse += change;
    for (std::size_t of = 0; of < lines; ++of) velocity[of] += response[by][of] * change;
  }
};

double response_between(const Line& by, const Line& of, const std::vector<SolverBody>& bodies) {
  double sum = 0.0;
  const double along = by.direction.dot(of.direction);
  if (by.a == of.a) sum += along * bodies[by.a].inverse_mass + of.moment_a.dot(by.response_a);
  if (by.b == of.b && bodies[by.b].inverse_mass > 0.0)
    sum += along * bodies[by.b].inverse_mass + of.moment_b.dot(by.response_b);
  if (by.a == of.b) sum -= along * bodies[by.a].inverse_mass + of.moment_b.dot(by.response_a);
  if (by.b == of.a) sum -= along * bodies[by.b].inverse_mass + of.moment_a.dot(by.response_b);
  return sum;
}

Line line_of(const FrictionRow& row, int tangent, const std::vector<SolverBody>& bodies) {
  Line line{row.a, row.b, row.tangent[tangent], {}, {}, {}, {}, row.impulse_newton_s[tangent]};
  line.moment_a = row.arm_a.cross(line.direction);
  line.moment_b = row.arm_b.cross(line.direction);
  line.response_a = times(bodies[row.a].inverse_inertia, line.moment_a);
  line.response_b = times(bodies[row.b].inverse_inertia, line.moment_b);
  return line;
}

Line line_of(const RollingRow& row, int axis, const std::vector<SolverBody>& bodies) {
  Line line{row.a,          row.b, Vec3::Zero(), row.axis[axis],
            row.axis[axis], {},    {},           row.impulse_newton_m_s[axis]};
  line.response_a = times(bodies[row.a].inverse_inertia, line.moment_a);
  line.response_b = times(bodies[row.b].inverse_inertia, line.moment_b);
  return line;
}

void load(const ContactProblem& p, DenseContacts& few) {
  for (const NormalRow& row : p.normals)
    few.line[few.lines++] = {row.a,     row.b,          row.normal,     row.arm_a,
                             row.arm_b, row.response_a, row.response_b, row.impulse_newton_s};
  few.normals = few.lines;
  for (const FrictionRow& row : p.frictions)
    for (int t = 0; t < 2; ++t) few.line[few.lines++] = line_of(row, t, p.bodies);
  few.rollings = few.lines;
  for (const RollingRow& row : p.rollings)
    for (int axis = 0; axis < 3; ++axis) few.line[few.lines++] = line_of(row, axis, p.bodies);
  for (std::size_t i = 0; i < few.lines; ++i) {
    few.velocity[i] = few.line[i].velocity(p.bodies);
    for (std::size_t j = 0; j <= i; ++j)
      few.response[i][j] = few.response[j][i] =
          response_between(few.line[i], few.line[j], p.bodies);
  }
}

double solve_normal(const NormalRow& row, std::size_t i, DenseContacts& few) {
  const double old = few.line[i].impulse;
  const double change = std::max(0.0, old + row.mass_kg * (row.target_m_s - few.velocity[i])) - old;
  if (change != 0.0) few.add(i, change);
  return std::abs(change);
}

double solve_friction(const FrictionRow& row, std::size_t i, DenseContacts& few) {
  const double limit = row.friction * few.line[row.normal_row].impulse;
  const Tangential old{few.line[i].impulse, few.line[i + 1].impulse};
  if (limit == 0.0 && old == Tangential{}) return 0.0;
  const Tangential now = friction_impulse(row, limit, old, {few.velocity[i], few.velocity[i + 1]});
  double largest = 0.0;
  for (std::size_t t = 0; t < 2; ++t) {
    if (now[t] != old[t]) few.add(i + t, now[t] - old[t]);
    largest = std::max(largest, std::abs(now[t] - old[t]));
  }
  return largest;
}

double pressing(const RollingRow& row, const DenseContacts& few) {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < row.points; ++i) sum += few.line[row.first_normal + i].impulse;
  return sum;
}

double solve_rolling(const RollingRow& row, std::size_t i, DenseContacts& few) {
  const double pressed = pressing(row, few);
  const Tangential old{few.line[i].impulse, few.line[i + 1].impulse};
  const double old_torsional = few.line[i + 2].impulse;
  if (pressed == 0.0 && old == Tangential{} && old_torsional == 0.0) return 0.0;
  const Tangential now =
      impulse_in_disc(row.inverse, row.slide_inertia_kg_m2, row.rolling_m * pressed, old,
                      {few.velocity[i], few.velocity[i + 1]});
  double largest = 0.0;
  for (std::size_t t = 0; t < 2; ++t) {
    if (now[t] != old[t]) few.add(i + t, now[t] - old[t]);
    largest = std::max(largest, std::abs(now[t] - old[t]));
  }
  const double limit = row.torsional_m * pressed;
  const double torsional =
      std::clamp(old_torsional - row.torsional_inertia_kg_m2 * few.velocity[i + 2], -limit, limit);
  if (torsional != old_torsional) few.add(i + 2, torsional - old_torsional);
  return std::max(largest, std::abs(torsional - old_torsional)) / row.gyration_m;
}

using Column = std::array<double, kMostLines>;
using Matrix = std::array<Column, kMostLines>;  // rows

// Solves by elimination, largest pivots first, in place. An unknown that rows do not tell, because
// points share a load in more than one way, stays 0.
void solve(std::size_t size, Matrix& rows, Column& right) {
  constexpr double kDependent = 1e-9;  // of the row's largest entry at first
  Column scale{};
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j < size; ++j) scale[i] = std::max(scale[i], std::abs(rows[i][j]));
  std::array<std::size_t, kMostLines> unknown_of{};  // that a row is solved for
  std::size_t rank = 0;
  for (std::size_t k = 0; k < size && rank < size; ++k) {
    std::size_t best = rank;
    for (std::size_t i = rank + 1; i < size; ++i)
      if (std::abs(rows[i][k]) * scale[best] > std::abs(rows[best][k]) * scale[i]) best = i;
    if (!(std::abs(rows[best][k]) > kDependent * scale[best])) continue;
    std::swap(rows[rank], rows[best]);
    std::swap(right[rank], right[best]);
    std::swap(scale[rank], scale[best]);
    for (std::size_t i = rank + 1; i < size; ++i) {
      const double share = rows[i][k] / rows[rank][k];
      if (share == 0.0) continue;
      for (std::size_t j = k; j < size; ++j) rows[i][j] -= share * rows[rank][j];
      right[i] -= share * right[rank];
    }
    unknown_of[rank++] = k;
  }
  Column found{};
  for (std::size_t r = rank; r-- > 0;) {
    const std::size_t k = unknown_of[r];
    double rest = right[r];
    for (std::size_t j = k + 1; j < size; ++j) rest -= rows[r][j] * found[j];
    found[k] = rest / rows[r][k];
  }
  right = found;
}

// A disc of impulses along two lines: up to `coefficient` times the sum of some normal impulses.
struct Disc {
  double coefficient = 0.0;
  std::size_t first_normal = 0, normals = 0;
  Tangential stop{};  // what would stop it
};

// What the changes of impulses have to meet for both lines of a disc, as linear equations.
void add_disc(const Disc& disc, std::size_t i, const DenseContacts& few, Matrix& rows,
              Column& right) {
  double pressed = 0.0;
  for (std::size_t n = 0; n < disc.normals; ++n) pressed += few.line[disc.first_normal + n].impulse;
  const double limit = disc.coefficient * pressed;
  const Tangential p{few.line[i].impulse, few.line[i + 1].impulse};
  const Tangential v{few.velocity[i], few.velocity[i + 1]};
  const double speed = std::sqrt(v[0] * v[0] + v[1] * v[1]);
  const Tangential& stop = disc.stop;
  const bool slides = stop[0] * stop[0] + stop[1] * stop[1] > limit * limit && speed > 0.0;
  for (std::size_t t = 0; t < 2; ++t) {
    Column& row = rows[i + t];
    if (!(limit > 0.0)) {
      row[i + t] = 1.0;
    } else if (!slides) {
      row = few.response[i + t];
      right[i + t] = -v[t];
    } else {
      // impulse + coefficient * (normal impulses) * v / |v| = 0
      const double along[2] = {v[0] / speed, v[1] / speed};
      for (std::size_t j = 0; j < few.lines; ++j) {
        const double v0 = few.response[i][j], v1 = few.response[i + 1][j];
        const double faster = along[0] * v0 + along[1] * v1;
        row[j] = (limit / speed) * ((t == 0 ? v0 : v1) - along[t] * faster);
      }
      row[i + t] += 1.0;
      for (std::size_t n = 0; n < disc.normals; ++n)
        row[disc.first_normal + n] += disc.coefficient * along[t];
      right[i + t] = -p[t] - limit * along[t];
    }
  }
}

void add_friction(const FrictionRow& friction, std::size_t i, const DenseContacts& few,
                  Matrix& rows, Column& right) {
  const Tangential p{few.line[i].impulse, few.line[i + 1].impulse};
  const Tangential v{few.velocity[i], few.velocity[i + 1]};
  add_disc({friction.friction, friction.normal_row, 1, stopping_impulse(friction, p, v)}, i, few,
           rows, right);
}

void add_rolling(const RollingRow& rolling, std::size_t i, const DenseContacts& few, Matrix& rows,
                 Column& right) {
  const Tangential p{few.line[i].impulse, few.line[i + 1].impulse};
  const Tangential v{few.velocity[i], few.velocity[i + 1]};
  add_disc({rolling.rolling_m, rolling.first_normal, rolling.points,
            stopping_impulse(rolling.inverse, p, v)},
           i, few, rows, right);
  // About the normal: an interval.
  const std::size_t k = i + 2;
  const double limit = rolling.torsional_m * pressing(rolling, few);
  const double stop = few.line[k].impulse - rolling.torsional_inertia_kg_m2 * few.velocity[k];
  if (!(limit > 0.0)) {
    rows[k][k] = 1.0;
  } else if (std::abs(stop) <= limit) {
    rows[k] = few.response[k];
    right[k] = -few.velocity[k];
  } else {
    const double sign = stop > 0.0 ? 1.0 : -1.0;
    rows[k][k] = 1.0;
    for (std::uint32_t n = 0; n < rolling.points; ++n)
      rows[k][rolling.first_normal + n] -= sign * rolling.torsional_m;
    right[k] = sign * limit - few.line[k].impulse;
  }
}

// A step of Newton's method on the laws of contact, each point as it is now: open, sticking or
// sliding. Iterations from there decide what is right.
void newton_step(const ContactProblem& problem, DenseContacts& few) {
  Matrix rows;
  Column right;
  for (std::size_t i = 0; i < few.lines; ++i) {
    std::fill_n(rows[i].begin(), few.lines, 0.0);
    right[i] = 0.0;
  }
  for (std::size_t i = 0; i < few.normals; ++i) {
    if (few.line[i].impulse > 0.0) {
      rows[i] = few.response[i];
      right[i] = problem.normals[i].target_m_s - few.velocity[i];
    } else {
      rows[i][i] = 1.0;
    }
  }
  for (std::size_t k = 0; k < problem.frictions.size(); ++k)
    add_friction(problem.frictions[k], few.normals + 2 * k, few, rows, right);
  for (std::size_t k = 0; k < problem.rollings.size(); ++k)
    add_rolling(problem.rollings[k], few.rollings + 3 * k, few, rows, right);
  solve(few.lines, rows, right);
  for (std::size_t i = 0; i < few.lines; ++i)
    few.add(i, i < few.normals ? std::max(right[i], -few.line[i].impulse) : right[i]);
}

void apply(const Line& line, double change, std::vector<SolverBody>& bodies) {
  SolverBody &a = bodies[line.a], &b = bodies[line.b];
  a.linear -= line.direction * (a.inverse_mass * change);
  a.angular -= line.response_a * change;
  b.linear += line.direction * (b.inverse_mass * change);
  b.angular += line.response_b * change;
}

double& impulse_of(std::size_t i, const DenseContacts& few, ContactProblem& p) {
  if (i < few.normals) return p.normals[i].impulse_newton_s;
  if (i < few.rollings)
    return p.frictions[(i - few.normals) / 2].impulse_newton_s[(i - few.normals) % 2];
  return p.rollings[(i - few.rollings) / 3].impulse_newton_m_s[(i - few.rollings) % 3];
}

void store(const DenseContacts& few, ContactProblem& p) {
  for (std::size_t i = 0; i < few.lines; ++i) {
    double& impulse = impulse_of(i, few, p);
    apply(few.line[i], few.line[i].impulse - impulse, p.bodies);
    impulse = few.line[i].impulse;
  }
}

// Returns the largest change of an impulse.
double iterate(bool forward, const ContactProblem& problem, DenseContacts& few) {
  double change = 0.0;
  for (std::size_t k = 0; k < problem.rollings.size(); ++k)
    change = std::max(change, solve_rolling(problem.rollings[k], few.rollings + 3 * k, few));
  for (std::size_t k = 0; k < problem.frictions.size(); ++k)
    change = std::max(change, solve_friction(problem.frictions[k], few.normals + 2 * k, few));
  for (std::size_t k = 0; k < few.normals; ++k) {
    const std::size_t i = forward ? k : few.normals - 1 - k;
    change = std::max(change, solve_normal(problem.normals[i], i, few));
  }
  return change;
}

// What iterations change.
struct Progress {
  std::array<double, kMostLines> impulse, velocity;
};
Progress progress_of(const DenseContacts& few) {
  Progress now;
  for (std::size_t i = 0; i < few.lines; ++i) {
    now.impulse[i] = few.line[i].impulse;
    now.velocity[i] = few.velocity[i];
  }
  return now;
}
void go_back_to(const Progress& before, DenseContacts& few) {
  for (std::size_t i = 0; i < few.lines; ++i) {
    few.line[i].impulse = before.impulse[i];
    few.velocity[i] = before.velocity[i];
  }
}

double largest_normal_impulse(const DenseContacts& few) {
  double largest = 0.0;
  for (std::size_t i = 0; i < few.normals; ++i) largest = std::max(largest, few.line[i].impulse);
  return largest;
}

}  // namespace

int solve_dense_contacts(int done, int iterations, double negligible, ContactProblem& problem) {
  constexpr int kMostNewtonSteps = 12, kAfterBadNewtonStep = 6, kLonger = 4;
  constexpr double kMuchLess = 1e-3;
  DenseContacts few;
  load(problem, few);
  int iteration = done, newton_steps = 0, next_newton_step = done, pause = kAfterBadNewtonStep;
  while (iteration < iterations) {
    const double change = iterate(iteration++ % 2 == 0, problem, few);
    // What one iteration changes is less than what is left; with steps of Newton's method more is
    // cheap.
    const double small = newton_steps < kMostNewtonSteps ? kMuchLess * negligible : negligible;
    if (change <= small * largest_normal_impulse(few)) break;
    if (newton_steps == kMostNewtonSteps || iteration < next_newton_step || iteration >= iterations)
      continue;
    const Progress before = progress_of(few);
    newton_step(problem, few);
    const double after = iterate(iteration++ % 2 == 0, problem, few);
    if (after <= small * largest_normal_impulse(few)) break;
    ++newton_steps;
    if (after < change) continue;
    go_back_to(before, few);
    next_newton_step = iteration + pause;
    pause *= kLonger;
  }
  store(few, problem);
  return iteration;
}

}  // namespace soda::physics
