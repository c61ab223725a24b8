#include "analysis/accuracy/joint_judges.hpp"

#include <cmath>

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Vec3;

class JointsJudge : public Judge {
 public:
  explicit JointsJudge(const scenarios::Scenario& scenario) : scenario_(scenario) {}
  void see(double, std::span<const BodyState> states) override {
    for (const physics::Joint& joint : scenario_.scene.joints)
      gap_m_ = worse(gap_m_, joint_gap_m(joint, states));
  }
  std::vector<Measured> errors() const override { return {{"gap_m", gap_m_}}; }

 protected:
  const scenarios::Scenario& scenario_;

 private:
  double gap_m_ = 0.0;
};

class HangingChainJudge final : public JointsJudge {
 public:
  HangingChainJudge(const scenarios::Scenario& scenario, double dt_s, double duration_s)
      : JointsJudge(scenario), dt_s_(dt_s), from_s_(0.9 * duration_s) {}

  void see(double time_s, std::span<const BodyState> states) override {
    JointsJudge::see(time_s, states);
    const std::vector<physics::BodyParams>& bodies = scenario_.scene.bodies;
    std::vector<Vec3> below(states.size());
    Vec3 momentum = Vec3::Zero();
    double mass = 0.0;
    for (std::size_t i = states.size(); i-- > 0;) {
      momentum += states[i].linear_velocity_m_s * bodies[i].mass_kg;
      mass += bodies[i].mass_kg;
      below[i] = momentum;
      if (time_s < from_s_ || before_.empty()) continue;
      const double missing = (momentum - before_[i]).norm() / dt_s_;
      force_rel_ = worse(force_rel_, missing / (mass * scenario_.scene.gravity_m_s2.norm()));
    }
    before_ = std::move(below);
  }
  std::vector<Measured> errors() const override {
    std::vector<Measured> all = JointsJudge::errors();
    all.push_back({"force_rel", force_rel_});
    return all;
  }

 private:
  const double dt_s_, from_s_;
  std::vector<Vec3> before_;  // momentum of each body and those below, a step earlier
  double force_rel_ = 0.0;
};

}  // namespace

double joint_gap_m(const physics::Joint& joint, std::span<const BodyState> states) {
  const auto place = [&states](physics::BodyId id, const Vec3& anchor) {
    if (physics::is_static(id)) return anchor;
    const BodyState& state = states[physics::index_of(id)];
    return Vec3(state.position_m + state.orientation * anchor);
  };
  const Vec3 between = place(joint.b, joint.anchor_b_m) - place(joint.a, joint.anchor_a_m);
  switch (joint.kind) {
    case physics::JointKind::kSpring:
      return 0.0;
    case physics::JointKind::kDistance:
      return std::abs(between.norm() - joint.length_m);
    case physics::JointKind::kSlider: {
      const Vec3 axis = states[physics::index_of(joint.a)].orientation *
                        Vec3(joint.frame_a * Vec3(Vec3::UnitZ()));
      return (between - axis * axis.dot(between)).norm();
    }
    default:
      return between.norm();
  }
}

std::unique_ptr<Judge> judge_joints(const scenarios::Scenario& scenario) {
  return std::make_unique<JointsJudge>(scenario);
}

std::unique_ptr<Judge> judge_hanging_chain(const scenarios::Scenario& scenario, double dt_s,
                                           double duration_s) {
  return std::make_unique<HangingChainJudge>(scenario, dt_s, duration_s);
}

}  // namespace soda::analysis
