#include "physics/integrators/jointed_substeps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/springs.hpp"
#include "physics/constraints/ways.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/joint_blocks.hpp"
#include "physics/solvers/joint_work.hpp"
#include "physics/solvers/substeps.hpp"

namespace soda::physics {
namespace {

// The share of all start impulses that makes the energy of motion least.
double best_share_of_start(std::span<const SolverBody> free, const ContactProblem& problem) {
  double square = 0.0, product = 0.0;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const SolverBody& body = problem.bodies[i];
    const Mat3 inertia = inverse_of_symmetric(body.inverse_inertia);
    const Vec3 momentum = (body.linear - free[i].linear) * (1.0 / body.inverse_mass);
    const Vec3 spin(inertia * (body.angular - free[i].angular));
    square += momentum.dot(body.linear - free[i].linear) + spin.dot(body.angular - free[i].angular);
    product += momentum.dot(free[i].linear) + spin.dot(free[i].angular);
  }
  return square > 0.0 ? -product / square : 1.0;
}

// Those of another load, or along other lines, would throw what is light.
void drop_bad_start(std::span<const SolverBody> free, JointSystem& joints,
                    ContactProblem& problem) {
  constexpr double kLeastShare = 0.1;
  if (best_share_of_start(free, problem) >= kLeastShare) return;
  std::ranges::copy(free, problem.bodies.begin());
  for (NormalRow& row : problem.normals) row.impulse_newton_s = 0.0;
  for (FrictionRow& row : problem.frictions)
    row.impulse_newton_s[0] = row.impulse_newton_s[1] = 0.0;
  for (JointRow& row : joints.rows) row.impulse_newton_s = 0.0;
}

// A step under way.
class JointedSubsteps {
 public:
  JointedSubsteps(const JointedStep& step, JointSystem& joints, ContactProblem& problem)
      : step_(step), joints_(joints), problem_(problem) {
    for (const BodyState& state : step.states) motion_.states.push_back(motion_of(state));
    motion_.flown_m.assign(step.ids.size(), Vec3::Zero());
    closing_m_s_ = 2.0 * fastest_push_out_m_s(step.scene, step.ids);
  }

  JointedMotion run();

 private:
  void start(std::uint32_t count);
  void build_rows_again();
  void drift();
  void add_impulses();
  void rebound();

  const JointedStep& step_;
  JointSystem& joints_;
  ContactProblem& problem_;
  Substeps substeps_;
  JointBlocks blocks_;
  JointedMotion motion_;
  std::vector<double> carried_newton_s_;
  double closing_m_s_ = 0.0;
};

// From the impulses of the step before, of which each substep has its share.
void JointedSubsteps::start(std::uint32_t count) {
  const double length_s = step_.dt_s / count;
  build_joint_rows(step_.scene, length_s, motion_.states, true, joints_);
  motion_.joint_newton_s.assign(joints_.rows.size(), 0.0);
  if (step_.scene.solver.warm_starting) load_joint_impulses(step_.scene, step_.states, joints_);
  for (const JointRow& row : joints_.rows)
    apply_joint_impulse(row, row.impulse_newton_s, problem_.bodies);
  drop_bad_start(step_.free, joints_, problem_);
  for (JointRow& row : joints_.rows) row.impulse_newton_s /= count;
  begin_substeps(step_.dt_s, count, step_.states, problem_, substeps_);
}

void JointedSubsteps::build_rows_again() {
  carried_newton_s_.clear();
  for (const JointRow& row : joints_.rows) carried_newton_s_.push_back(row.impulse_newton_s);
  build_joint_rows(step_.scene, substeps_.length_s, motion_.states, true, joints_);
  for (std::size_t r = 0; r < carried_newton_s_.size(); ++r)
    joints_.rows[r].impulse_newton_s = carried_newton_s_[r];
}

void JointedSubsteps::drift() {
  for (std::size_t i = 0; i < step_.ids.size(); ++i) {
    BodyState& state = motion_.states[i];
    SolverBody& body = problem_.bodies[i];
    state.position_m += body.linear * substeps_.length_s;
    state.angular_velocity_rad_s = body.angular;
    rotate_freely(step_.scene.bodies[index_of(step_.ids[i])], substeps_.length_s, state);
    body.angular = state.angular_velocity_rad_s;
  }
}

void JointedSubsteps::add_impulses() {
  for (std::size_t r = 0; r < joints_.rows.size(); ++r) {
    const JointRow& row = joints_.rows[r];
    const double impulse = row.impulse_newton_s;
    motion_.joint_newton_s[r] += impulse;
    if (row.kind == JointRowKind::kMotor)
      motion_.motor_work_joule += impulse * velocity_of(row, problem_.bodies);
    if (row.b != step_.ids.size()) continue;
    motion_.world_newton_s -= row.linear * impulse;
    motion_.world_newton_m_s -=
        row.turn_a * impulse + motion_.states[row.a].position_m.cross(row.linear * impulse);
  }
}

// Bodies have moved: it changes how they leave the step only. Without rebounds where these throw
// what is light.
void JointedSubsteps::rebound() {
  if (problem_.restitution_rows == 0) return;
  const ContactProblem plastic = problem_;
  const JointSystem plastic_joints = joints_;
  if (!aim_rebounds(problem_)) return;
  for (RowContact& contact : problem_.contacts) contact.bounces = false;
  const std::uint32_t sweeps = motion_.sweeps;
  for (std::uint32_t i = 0; i < sweeps; ++i) {
    relax_joints(substeps_.length_s, i % 2 == 0, blocks_, joints_, problem_.bodies);
    sweep_velocities(i % 2 == 0, problem_);
  }
  motion_.sweeps += sweeps;
  if (!limit_throws(step_, 0.0, problem_.bodies)) return;
  problem_ = plastic;
  joints_ = plastic_joints;
}

JointedMotion JointedSubsteps::run() {
  const std::uint32_t count = substeps_of(step_.scene.solver);
  start(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i > 0) {
      go_on(problem_, substeps_);
      build_rows_again();
    }
    build_joint_blocks(problem_.bodies, joints_, blocks_);
    press_joints(substeps_.length_s, closing_m_s_, blocks_, joints_, problem_.bodies);
    press(problem_, substeps_);
    limit_throws(step_, closing_m_s_, problem_.bodies);
    move_on(problem_, substeps_);
    drift();
    relax_joints(substeps_.length_s, false, blocks_, joints_, problem_.bodies);
    relax(problem_, substeps_);
    limit_throws(step_, closing_m_s_, problem_.bodies);
    add_impulses();
    for (std::size_t k = 0; k < motion_.flown_m.size(); ++k)
      motion_.flown_m[k] +=
          (problem_.bodies[k].linear + substeps_.at_start[k].linear) * (0.5 * substeps_.length_s);
  }
  motion_.sweeps = 2 * count;
  end_substeps(problem_, substeps_);
  rebound();
  return std::move(motion_);
}

}  // namespace

JointedMotion solve_jointed_in_substeps(const JointedStep& step, JointSystem& joints,
                                        ContactProblem& problem) {
  return JointedSubsteps(step, joints, problem).run();
}

namespace {

double elastic_at(const SceneDescription& scene, const JointSystem& joints,
                  std::span<const BodyState> states) {
  return has_springs(scene, joints) ? elastic_joule(spring_rows(scene, states, joints)) : 0.0;
}

// Sweeps that diverged.
bool are_absurd(std::span<const SolverBody> bodies) {
  const auto within = [](const Vec3& v, double most) { return v.squaredNorm() <= most * most; };
  return !std::ranges::all_of(bodies, [&](const SolverBody& body) {
    return within(body.linear, kLargestSpeed_m_s) && within(body.angular, kLargestSpin_rad_s);
  });
}

void stand_still(ContactProblem& problem) {
  for (SolverBody& body : problem.bodies) body.linear = body.angular = Vec3::Zero();
  for (NormalRow& row : problem.normals) row.impulse_newton_s = 0.0;
  for (FrictionRow& row : problem.frictions)
    row.impulse_newton_s[0] = row.impulse_newton_s[1] = 0.0;
}

}  // namespace

void take_jointed_motion(const JointedStep& step, const JointedMotion& motion, bool affordable,
                         JointSystem& joints, ContactProblem& problem, std::span<BodyState> states,
                         IslandReport& report, std::vector<AdvanceFault>& faults) {
  const auto& [scene, dt_s, ids, before, free] = step;
  if (are_absurd(problem.bodies)) stand_still(problem);
  std::vector<BodyState> next;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    BodyState& state = next.emplace_back(motion.states[i]);
    state.linear_velocity_m_s = problem.bodies[i].linear;
    state.angular_velocity_rad_s = problem.bodies[i].angular;
    if (*fault_of(state)) state = motion_of(before[i]);
  }
  if (affordable) close_joints(scene, dt_s, ids, joints, next);
  std::vector<BodyState> flown = next;
  for (std::size_t i = 0; i < ids.size(); ++i)
    flown[i].position_m = before[i].position_m + motion.flown_m[i];
  report.motor_work_joule = motion.motor_work_joule;
  const double work = motion.motor_work_joule +
                      external_work_joule(scene, dt_s, before, free, problem) +
                      elastic_at(scene, joints, before) - elastic_at(scene, joints, next);
  const EnergyExcess excess = energy_excess(scene, dt_s, ids, before, flown, work);
  IslandReport moved = report;
  if (excess.gain_joule > 0.0)
    moved.push_out_work_joule +=
        take_excess(scene, ids, excess, is_afloat(ids.size(), joints, &problem), next, moved);
  for (std::size_t i = 0; i < ids.size(); ++i)
    moved.push_out_work_joule -= scene.bodies[index_of(ids[i])].mass_kg *
                                 scene.gravity_m_s2.dot(next[i].position_m - flown[i].position_m);
  const bool springs_gain = excess.gain_joule > excess.moving_joule && has_springs(scene, joints);
  if (springs_gain || !(moved.push_out_work_joule <= most_push_out_joule(step, next)))
    return move_jointed(step, joints, problem, {}, states, report, faults);
  report = moved;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const char* const fault = fault_of(next[i]);
    if (*fault) {
      faults.push_back({ids[i], fault});
      continue;
    }
    next[i].impulses = std::move(states[i].impulses);
    states[i] = std::move(next[i]);
  }
}

}  // namespace soda::physics
