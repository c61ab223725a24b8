#include "physics/integrators/joint_closing.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "physics/constraints/limits_and_motors.hpp"
#include "physics/integrators/giving_way.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/joint_work.hpp"

namespace soda::physics {
namespace {

// The largest error tells when to stop, the root of the sum of all squares what is nearer: damped
// corrections move errors from joint to joint.
struct JointErrors {
  double largest = 0.0, norm = 0.0;
};
JointErrors errors_of(const JointSystem& joints) {
  return {largest_error(joints), norm_of_errors(joints)};
}

// Corrections are damped in degrees: 0 is Gauss and Newton's, with the true masses; from 1 on all
// masses are equal, and from 2 on the diagonal grows (Levenberg and Marquardt).
constexpr int kEqualMasses = 1, kStrongest = 8;
double regularisation_of(int damping) {
  constexpr double kWeakest = 1e-6, kGrows = 10.0;
  double share = 0.0;
  for (int i = kEqualMasses; i < damping; ++i) share = share > 0.0 ? kGrows * share : kWeakest;
  return share;
}

// Multiplications: of building a row and of what it moves; of all corrections of a step. A part of
// a step has its share of these, but no less than that of one of ten.
constexpr double kWorkOfRow = 100.0, kMostWorkOfRow = 2e4, kMostWorkOfFew = 2e7;
constexpr double kLeastOfStep = 0.1;

// How the bodies come nearer.
struct Correction {
  std::vector<BodyState> states;  // none: it leads nowhere
  JointErrors errors;
  double work_joule = 0.0;
  int damping = 0;
};

class Closing {
 public:
  Closing(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
          JointSystem& joints, std::span<BodyState> states)
      : scene_(scene), dt_s_(dt_s), ids_(ids), joints_(joints), states_(states) {
    build(states_);
    errors_ = errors_of(joints_);
  }

  double close(double most_joule) {
    constexpr int kMostCorrections = 200;  // some long chains take half of them
    // What is taut in several directions, as a flat net, takes many trials for each correction.
    const double most_work = std::max(kMostWorkOfFew, kMostWorkOfRow * rows()) *
                             std::max(kLeastOfStep, dt_s_ / scene_.dt_s);
    const double most_of_all = std::max(most_joule, falling_joule());
    double work_joule = 0.0, looked = errors_.norm;
    for (int i = 0; i < kMostCorrections && errors_.largest > enough_ && work_ <= most_work; ++i) {
      if (is_enough_after(i, looked)) break;
      if (i > 0) build(states_);
      Correction found = best_correction();
      if (found.states.empty()) break;  // a place that cannot be reached, or rounding
      if (found.damping > 0 && work_joule + found.work_joule > most_joule) break;
      if (work_joule + found.work_joule > most_of_all) {
        const double share = std::max(0.0, (most_of_all - work_joule) / found.work_joule);
        come_nearer(share, found.states);
        return work_joule + share * found.work_joule;
      }
      errors_ = found.errors;
      damping_ = found.damping > 0 ? std::max(kEqualMasses, found.damping - 1) : 0;
      work_joule += found.work_joule;
      std::move(found.states.begin(), found.states.end(), states_.begin());
    }
    return work_joule;
  }

 private:
  void build(std::span<const BodyState> states) {
    build_joint_rows(scene_, dt_s_, states, false, joints_);
  }

  double rows() const { return static_cast<double>(joints_.rows.size()); }

  // Of a fall of one step.
  double falling_joule() const {
    double sum = 0.0;
    for (const BodyId id : ids_) {
      const double fall_m_s = field_of(scene_, id).norm() * dt_s_;
      sum += 0.5 * scene_.bodies[index_of(id)].mass_kg * fall_m_s * fall_m_s;
    }
    return sum;
  }

  // That share of the way to these places.
  void come_nearer(double share, std::span<const BodyState> there) {
    for (std::size_t b = 0; b < ids_.size(); ++b) {
      const Vec3 rotation = small_rotation(states_[b].orientation, there[b].orientation);
      states_[b].position_m += (there[b].position_m - states_[b].position_m) * share;
      rotate_by(scene_.bodies[index_of(ids_[b])], rotation * share, states_[b]);
    }
  }

  // Taut chains that cannot be drawn straight come nearer by ever less, far below anything to see.
  // What is locked, as a net that has been pressed into a knot, comes no nearer anyway.
  bool is_enough_after(int corrections, double& looked) const {
    constexpr int kLook = 8;
    constexpr double kVisible = 1e9;                      // roundings
    constexpr double kComes = 0.5, kComesVisibly = 0.95;  // of the error at the look before
    if (corrections % kLook != kLook - 1) return false;
    const double before = std::exchange(looked, errors_.norm);
    const bool visible = errors_.largest > kVisible * enough_;
    return errors_.norm > (visible ? kComesVisibly : kComes) * before;
  }

  // What takes all errors away to first order. Needs the rows of states_.
  void find_moves(int damping) {
    std::vector<SolverBody> bodies = bodies_at(scene_, ids_, states_);
    for (std::size_t b = 0; b < ids_.size() && damping >= kEqualMasses; ++b) {
      const double mass_kg = scene_.bodies[index_of(ids_[b])].mass_kg;
      bodies[b].inverse_mass *= mass_kg;
      bodies[b].inverse_inertia *= mass_kg;
    }
    hold_passed_limits(enough_, joints_);
    factor_joint_rows(bodies, joints_, regularisation_of(damping));
    work_ += joints_.elimination->multiplications;
    solve_joint_errors(joints_, bodies, moves_);
  }

  // The rows' errors are those of the new places then.
  Correction moved_by(double share) {
    Correction moved;
    moved.states.assign(states_.begin(), states_.end());
    for (std::size_t b = 0; b < ids_.size(); ++b) {
      const BodyParams& params = scene_.bodies[index_of(ids_[b])];
      const Vec3 displacement = share * moves_[b].linear;
      moved.states[b].position_m += displacement;
      rotate_by(params, share * moves_[b].angular, moved.states[b]);
      moved.work_joule -= params.mass_kg * field_of(scene_, params).dot(displacement);
    }
    build_joint_errors(scene_, moved.states, joints_);
    work_ += kWorkOfRow * rows();
    moved.errors = errors_of(joints_);
    return moved;
  }

  // Of ever shorter parts of moves_ the first that comes as much nearer as it is long.
  Correction along_moves(int halvings) {
    constexpr double kCloser = 0.1;  // of what it promises
    double share = 1.0;
    for (int i = 0; i <= halvings; ++i, share *= 0.5) {
      Correction found = moved_by(share);
      const double left = 1.0 - kCloser * share;
      const bool closer = halvings == 0 ? found.errors.largest < left * errors_.largest
                                        : found.errors.norm < left * errors_.norm;
      if (closer && found.errors.largest <= errors_.largest) return found;
    }
    return {};
  }

  // Of ever more damped ones the first that is good, or the best before one that is worse.
  Correction best_correction() {
    constexpr int kHalvings = 6;
    constexpr double kGood = 0.5;
    constexpr double kRoundings = 1e6;  // below that, it is as good as closed
    const bool nearly = errors_.largest <= kRoundings * enough_;
    Correction best;
    best.errors = errors_;
    for (int damping = damping_; damping <= (nearly ? damping_ : kStrongest); ++damping) {
      if (damping > damping_) build_joint_errors(scene_, states_, joints_);
      find_moves(damping);
      Correction found = along_moves(nearly || damping == 0 ? 0 : kHalvings);
      const bool better =
          !found.states.empty() && (damping == 0 || found.errors.norm < best.errors.norm);
      if (!better && !best.states.empty()) break;
      if (!better) continue;
      best = std::move(found);
      best.damping = damping;
      if (damping == 0 || best.errors.norm < kGood * errors_.norm) break;
    }
    return best;
  }

  const SceneDescription& scene_;
  double dt_s_;
  std::span<const BodyId> ids_;
  JointSystem& joints_;  // its rows are those of states_ in a correction
  std::span<BodyState> states_;
  double enough_ = rounding_of(states_, joints_.reach_m);
  JointErrors errors_;
  int damping_ = 0;
  double work_ = 0.0;  // multiplications
  std::vector<JointMove> moves_;
};

}  // namespace

double close_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                    double most_joule, JointSystem& joints, std::span<BodyState> states) {
  return Closing(scene, dt_s, ids, joints, states).close(most_joule);
}

bool are_closed(const SceneDescription& scene, double dt_s, std::span<const BodyState> states,
                JointSystem& joints) {
  build_joint_rows(scene, dt_s, states, false, joints);
  return largest_error(joints) <= 100.0 * rounding_of(states, joints.reach_m);
}

void close_left_open(const IslandStep& island, const ContactProblem* problem, JointSystem& joints,
                     std::span<BodyState> states, IslandReport& report) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const std::vector<BodyState> open(states.begin(), states.end());
  EnergyExcess lifted;
  lifted.moving_joule = kinetic_joule(scene, ids, states);
  lifted.gain_joule = close_joints(scene, dt_s, ids, lifted.moving_joule, joints, states);
  if (problem != nullptr)
    lifted.gain_joule += give_way(island, {0.0, open, open}, joints, *problem, states).work_joule;
  const bool isolated = is_isolated(ids.size(), joints, nullptr);
  report.push_out_work_joule += lifted.gain_joule > 0.0
                                    ? take_excess(scene, ids, lifted, isolated, states, report)
                                    : lifted.gain_joule;
}

}  // namespace soda::physics
