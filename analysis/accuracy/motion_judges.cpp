#include "analysis/accuracy/motion_judges.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/torque_free.hpp"

namespace soda::analysis {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

class MotionJudge : public Judge {
 public:
  explicit MotionJudge(std::vector<MotionTrack> tracks) : tracks_(std::move(tracks)) {}
  void see(double time_s, std::span<const BodyState> states) override {
    for (MotionTrack& track : tracks_) track.see(time_s, states);
  }
  std::vector<Measured> errors() const override { return MotionTrack::worst(tracks_); }

 private:
  std::vector<MotionTrack> tracks_;
};

Vec3 angular_momentum(const physics::BodyParams& params, const BodyState& state) {
  const Vec3 local = state.orientation.conjugate() * state.angular_velocity_rad_s;
  return state.orientation * Vec3(params.inertia_local_kg_m2 * local);
}

class TorqueFreeJudge final : public MotionJudge {
 public:
  TorqueFreeJudge(const StartingBody& body, BodyId id)
      : MotionJudge({MotionTrack(id, torque_free(body))}), body_(body), id_(id) {}

  void see(double time_s, std::span<const BodyState> states) override {
    MotionJudge::see(time_s, states);
    const BodyState& now = states[physics::index_of(id_)];
    const Vec3 l0 = angular_momentum(body_.params, body_.state);
    const Vec3 l = angular_momentum(body_.params, now);
    momentum_rel_ = worse(momentum_rel_, (l - l0).norm() / l0.norm());
    const double e0 = l0.dot(body_.state.angular_velocity_rad_s);
    const double e = l.dot(now.angular_velocity_rad_s);
    energy_rel_ = worse(energy_rel_, std::abs(e - e0) / e0);
  }
  std::vector<Measured> errors() const override {
    std::vector<Measured> all = MotionJudge::errors();
    all.push_back({"energy_rel", energy_rel_});
    all.push_back({"angular_momentum_rel", momentum_rel_});
    return all;
  }

 private:
  const StartingBody body_;
  const BodyId id_;
  double energy_rel_ = 0.0, momentum_rel_ = 0.0;
};

class SlidingJudge final : public Judge {
 public:
  SlidingJudge(BodyId id, const StartingBody& body, const Slope& slope, const SlidingLaw& law)
      : id_(id),
        start_(body.state),
        slope_(slope),
        law_(law),
        track_(id, sliding(body, slope, law)) {}

  void see(double time_s, std::span<const BodyState> states) override {
    track_.see(time_s, states);
    const BodyState& now = states[physics::index_of(id_)];
    const Vec3 way = now.position_m - start_.position_m;
    side_m_ = worse(side_m_, std::abs(way.dot(slope_.side)));
    lift_m_ = worse(lift_m_, std::abs(way.dot(slope_.normal)));
    speed_m_s_ = now.linear_velocity_m_s.norm();
    // While it moves, its stop lies where its present speed will be used up.
    const double along = now.linear_velocity_m_s.dot(slope_.down);
    if (law_.stops && std::abs(along) > 1e-3 * std::abs(law_.speed_m_s))
      stop_time_s_ = time_s - along / law_.acceleration_m_s2;
    at_rest_ = law_.stops && time_s > law_.stop_time_s;
  }
  std::vector<Measured> errors() const override {
    std::vector<Measured> all = MotionTrack::worst({&track_, 1});
    std::erase_if(all, [](const Measured& m) {
      return m.measure != "position_m" && m.measure != "velocity_m_s";
    });
    all.push_back({"side_m", side_m_});
    all.push_back({"lift_m", lift_m_});
    if (at_rest_) {
      if (law_.stops && law_.stop_time_s > 0.0)
        all.push_back({"stop_time_s", std::abs(stop_time_s_ - law_.stop_time_s)});
      all.push_back({"rest_speed_m_s", speed_m_s_});
    }
    return all;
  }

 private:
  const BodyId id_;
  const BodyState start_;
  const Slope slope_;
  const SlidingLaw law_;
  MotionTrack track_;
  double side_m_ = 0.0, lift_m_ = 0.0, speed_m_s_ = 0.0, stop_time_s_ = 0.0;
  bool at_rest_ = false;
};

class BouncingJudge final : public Judge {
 public:
  BouncingJudge(BodyId id, const StartingBody& body, const BouncingLaw& law, double dt_s,
                double duration_s)
      : id_(id),
        radius_m_(body.radius_m),
        duration_s_(duration_s),
        law_(law),
        track_(id, bouncing(body, law)) {
    // Shorter flights than two steps need not show between samples.
    double top = law.first_impact_s + 0.5 * law.flight_s(1);
    for (int bounce = 1; law.flight_s(bounce) >= 2.0 * dt_s && top + dt_s <= duration_s; ++bounce) {
      expected_m_.push_back(law.apex_m(bounce));
      top += 0.5 * (law.flight_s(bounce) + law.flight_s(bounce + 1));
    }
  }

  void see(double time_s, std::span<const BodyState> states) override {
    track_.see(time_s, states);
    const BodyState& now = states[physics::index_of(id_)];
    const double v = now.linear_velocity_m_s.z();
    if (last_speed_m_s_ > 0.0 && v <= 0.0 && time_s > law_.first_impact_s)
      seen_m_.push_back(now.position_m.z() - radius_m_ + 0.5 * v * v / law_.gravity_m_s2);
    last_speed_m_s_ = v;
    speed_m_s_ = now.linear_velocity_m_s.norm();
  }
  std::vector<Measured> errors() const override {
    std::vector<Measured> all;
    for (const Measured& m : MotionTrack::worst({&track_, 1}))
      if (m.measure == "position_m") all.push_back(m);
    double worst = 0.0;
    for (std::size_t i = 0; i < expected_m_.size(); ++i) {
      const double seen = i < seen_m_.size() ? seen_m_[i] : 0.0;  // a bounce that was lost
      worst = worse(worst, std::abs(seen - expected_m_[i]));
    }
    if (!expected_m_.empty()) all.push_back({"apex_m", worst});
    if (duration_s_ > law_.rest_time_s()) all.push_back({"rest_speed_m_s", speed_m_s_});
    return all;
  }

 private:
  const BodyId id_;
  const double radius_m_, duration_s_;
  const BouncingLaw law_;
  MotionTrack track_;
  std::vector<double> expected_m_, seen_m_;
  double last_speed_m_s_ = 0.0, speed_m_s_ = 0.0;
};

}  // namespace

BodyId id_of_label(const scenarios::Scenario& scenario, std::int64_t label) {
  const auto& bodies = scenario.scene.bodies;
  const auto at = std::lower_bound(
      bodies.begin(), bodies.end(), label,
      [](const physics::BodyParams& body, std::int64_t wanted) { return body.label < wanted; });
  return BodyId{static_cast<std::uint32_t>(at - bodies.begin())};
}

StartingBody starting_body(const scenarios::Scenario& scenario, BodyId id) {
  const std::size_t index = physics::index_of(id);
  StartingBody body{scenario.scene.bodies[index], scenario.initial[index], 0.0};
  if (const auto* sphere = std::get_if<physics::Sphere>(&scenario.scene.shapes[body.params.shape]))
    body.radius_m = sphere->radius_m;
  return body;
}

double angle_between(const physics::Quat& a, const physics::Quat& b) {
  const physics::Quat difference = a.conjugate() * b;
  return 2.0 * std::atan2(difference.vec().norm(), std::abs(difference.w()));
}

void MotionTrack::see(double time_s, std::span<const BodyState> states) {
  const BodyState& now = states[physics::index_of(body_)];
  const Motion exact = exact_(time_s);
  end_position_m_ = (now.position_m - exact.position_m).norm();
  position_m_ = worse(position_m_, end_position_m_);
  end_velocity_m_s_ = (now.linear_velocity_m_s - exact.linear_velocity_m_s).norm();
  velocity_m_s_ = worse(velocity_m_s_, end_velocity_m_s_);
  if (!exact.orientation || !exact.angular_velocity_rad_s) return;
  turns_ = true;
  attitude_rad_ = worse(attitude_rad_, angle_between(now.orientation, *exact.orientation));
  end_spin_rad_s_ = (now.angular_velocity_rad_s - *exact.angular_velocity_rad_s).norm();
  spin_rad_s_ = worse(spin_rad_s_, end_spin_rad_s_);
}

std::vector<Measured> MotionTrack::worst(std::span<const MotionTrack> tracks) {
  double position = 0.0, end_position = 0.0, velocity = 0.0, end = 0.0, attitude = 0.0, spin = 0.0,
         end_spin = 0.0;
  bool turns = false;
  for (const MotionTrack& track : tracks) {
    position = worse(position, track.position_m_);
    end_position = worse(end_position, track.end_position_m_);
    velocity = worse(velocity, track.velocity_m_s_);
    end = worse(end, track.end_velocity_m_s_);
    attitude = worse(attitude, track.attitude_rad_);
    spin = worse(spin, track.spin_rad_s_);
    end_spin = worse(end_spin, track.end_spin_rad_s_);
    turns = turns || track.turns_;
  }
  std::vector<Measured> all{{"position_m", position},
                            {"end_position_m", end_position},
                            {"velocity_m_s", velocity},
                            {"end_velocity_m_s", end}};
  if (turns) {
    all.push_back({"attitude_rad", attitude});
    all.push_back({"spin_rad_s", spin});
    all.push_back({"end_spin_rad_s", end_spin});
  }
  return all;
}

std::unique_ptr<Judge> judge_motions(std::vector<MotionTrack> tracks) {
  return std::make_unique<MotionJudge>(std::move(tracks));
}

std::unique_ptr<Judge> judge_torque_free(const StartingBody& body, BodyId id) {
  return std::make_unique<TorqueFreeJudge>(body, id);
}

std::unique_ptr<Judge> judge_sliding(const scenarios::Scenario& scenario,
                                     const scenarios::Sliding& answer) {
  const BodyId id = id_of_label(scenario, answer.body);
  const StartingBody body = starting_body(scenario, id);
  const Slope slope = slope_of(answer.slope_deg, answer.azimuth_deg);
  const double speed = body.state.linear_velocity_m_s.dot(slope.down);
  const SlidingLaw law =
      sliding_law(speed, scenario.scene.gravity_m_s2.norm(), answer.slope_deg, answer.friction);
  return std::make_unique<SlidingJudge>(id, body, slope, law);
}

std::unique_ptr<Judge> judge_bouncing(const scenarios::Scenario& scenario,
                                      const scenarios::Bouncing& answer, double dt_s,
                                      double duration_s) {
  const BodyId id = id_of_label(scenario, answer.body);
  const StartingBody body = starting_body(scenario, id);
  const BouncingLaw law =
      bouncing_law(body, scenario.scene.gravity_m_s2.norm(), answer.restitution);
  return std::make_unique<BouncingJudge>(id, body, law, dt_s, duration_s);
}

}  // namespace soda::analysis
