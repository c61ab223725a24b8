#include "analysis/accuracy/scene_judges.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/accuracy/motion_judges.hpp"
#include "analysis/measures/error_measures.hpp"
#include "physics/shapes/mass_properties.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Mechanics;
using physics::Vec3;

// Energy over a run, against its scale: the largest kinetic energy or change of potential energy
// that occurred, at least what lifts every body by its own size.
class EnergyTrack {
 public:
  explicit EnergyTrack(const physics::SceneDescription& scene)
      : scene_(scene), ids_(all_ids(scene.bodies.size())), scale_(lifting_energy_joule(scene)) {}

  Mechanics see(std::span<const BodyState> states) {
    Mechanics now = physics::measure(scene_, ids_, states);
    if (!started_) start_ = now;
    started_ = true;
    const double potential = now.potential_energy_joule - start_.potential_energy_joule;
    const double change = now.kinetic_energy_joule - start_.kinetic_energy_joule + potential;
    scale_ = worse(scale_, now.kinetic_energy_joule);
    scale_ = worse(scale_, std::abs(potential));
    drift_ = worse(drift_, std::abs(change));
    gain_ = worse(gain_, change);
    return now;
  }
  double drift_rel() const { return over_scale(drift_); }
  double gain_rel() const { return over_scale(gain_); }

 private:
  double over_scale(double joule) const { return scale_ > 0.0 ? joule / scale_ : joule; }

  const physics::SceneDescription& scene_;
  const std::vector<physics::BodyId> ids_;
  Mechanics start_;
  bool started_ = false;
  double scale_ = 0.0, drift_ = 0.0, gain_ = 0.0;
};

double diameter_m(const physics::SceneDescription& scene, std::uint32_t shape) {
  const double volume = physics::mass_properties(scene.shapes[shape], scene.shapes).volume_m3;
  return std::cbrt(6.0 * volume / std::numbers::pi);
}

double deepest(std::span<const double> depths_m) {
  double worst = 0.0;
  for (const double depth : depths_m) worst = worse(worst, depth);
  return worst;
}

class RestJudge final : public Judge {
 public:
  explicit RestJudge(const scenarios::Scenario& scenario)
      : scenario_(scenario), overlaps_(scenario) {
    for (const physics::BodyParams& body : scenario.scene.bodies)
      sizes_m_.push_back(diameter_m(scenario.scene, body.shape));
  }
  void see(double, std::span<const BodyState> states) override {
    for (std::size_t i = 0; i < states.size(); ++i) {
      const BodyState& start = scenario_.initial[i];
      const double way = (states[i].position_m - start.position_m).norm();
      position_m_ = worse(position_m_, way);
      displacement_rel_ = worse(displacement_rel_, way / sizes_m_[i]);
      attitude_rad_ = worse(attitude_rad_, angle_between(states[i].orientation, start.orientation));
      speed_m_s_ = worse(speed_m_s_, states[i].linear_velocity_m_s.norm());
    }
    depths_m_.clear();
    overlaps_.find(states, depths_m_);
    penetration_m_ = worse(penetration_m_, deepest(depths_m_));
  }
  std::vector<Measured> errors() const override {
    return {{"position_m", position_m_},
            {"attitude_rad", attitude_rad_},
            {"displacement_rel", displacement_rel_},
            {"penetration_m", penetration_m_},
            {"speed_m_s", speed_m_s_}};
  }

 private:
  const scenarios::Scenario& scenario_;
  Overlaps overlaps_;
  std::vector<double> sizes_m_, depths_m_;
  double position_m_ = 0.0, attitude_rad_ = 0.0, displacement_rel_ = 0.0, penetration_m_ = 0.0,
         speed_m_s_ = 0.0;
};

class ConservedJudge final : public Judge {
 public:
  explicit ConservedJudge(const scenarios::Scenario& scenario)
      : scenario_(scenario), energy_(scenario.scene) {}

  void see(double, std::span<const BodyState> states) override {
    const Mechanics now = energy_.see(states);
    const Vec3 spin = spin_about_centre(now, states);
    if (!started_) {
      start_ = now;
      start_spin_ = spin;
      spin_scale_ = spin_parts(states);
      started_ = true;
    }
    momentum_ =
        worse(momentum_, (now.linear_momentum_newton_s - start_.linear_momentum_newton_s).norm());
    spin_ = worse(spin_, (spin - start_spin_).norm());
  }
  std::vector<Measured> errors() const override {
    const auto over = [](double value, double scale) {
      return scale > 0.0 ? value / scale : value;
    };
    return {{"energy_rel", energy_.drift_rel()},
            {"energy_gain_rel", energy_.gain_rel()},
            {"momentum_rel", over(momentum_, start_.momentum_scale_newton_s)},
            {"angular_momentum_rel", over(spin_, spin_scale_)}};
  }

 private:
  Vec3 centre_of(std::span<const BodyState> states) const {
    Vec3 weighted = Vec3::Zero();
    double mass = 0.0;
    for (std::size_t i = 0; i < states.size(); ++i) {
      weighted += states[i].position_m * scenario_.scene.bodies[i].mass_kg;
      mass += scenario_.scene.bodies[i].mass_kg;
    }
    return weighted / mass;
  }
  Vec3 spin_about_centre(const Mechanics& now, std::span<const BodyState> states) const {
    return now.angular_momentum_newton_m_s - centre_of(states).cross(now.linear_momentum_newton_s);
  }
  // Sum of the magnitudes of what each body has, orbit and spin.
  double spin_parts(std::span<const BodyState> states) const {
    const Vec3 centre = centre_of(states);
    double sum = 0.0;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const physics::BodyParams& body = scenario_.scene.bodies[i];
      const Vec3 local = states[i].orientation.conjugate() * states[i].angular_velocity_rad_s;
      sum += Vec3(states[i].position_m - centre).cross(states[i].linear_velocity_m_s).norm() *
                 body.mass_kg +
             Vec3(body.inertia_local_kg_m2 * local).norm();
    }
    return sum;
  }

  const scenarios::Scenario& scenario_;
  EnergyTrack energy_;
  Mechanics start_;
  Vec3 start_spin_ = Vec3::Zero();
  bool started_ = false;
  double momentum_ = 0.0, spin_ = 0.0, spin_scale_ = 0.0;
};

class SideJudge final : public Judge {
 public:
  SideJudge(const scenarios::Scenario& scenario, const scenarios::OneSide& answer)
      : energy_(scenario.scene), normal_(answer.normal.normalized()), offset_m_(answer.offset_m) {}
  void see(double, std::span<const BodyState> states) override {
    energy_.see(states);
    passed_ = 0.0;
    // Written so that what is no number counts as passed.
    for (const BodyState& state : states)
      passed_ += state.position_m.dot(normal_) < offset_m_ ? 0.0 : 1.0;
  }
  std::vector<Measured> errors() const override {
    return {{"passed", passed_}, {"energy_gain_rel", energy_.gain_rel()}};
  }

 private:
  EnergyTrack energy_;
  const Vec3 normal_;
  const double offset_m_;
  double passed_ = 0.0;
};

class PileJudge final : public Judge {
 public:
  PileJudge(const scenarios::Scenario& scenario, bool at_end)
      : energy_(scenario.scene), overlaps_(scenario), at_end_(at_end) {}
  void see(double, std::span<const BodyState> states) override {
    energy_.see(states);
    for (const BodyState& state : states)
      speed_m_s_ = worse(speed_m_s_, state.linear_velocity_m_s.norm());
    if (at_end_) depths_m_.clear();
    overlaps_.find(states, depths_m_);
  }
  std::vector<Measured> errors() const override {
    std::vector<double> sorted = depths_m_;
    const auto rank = sorted.size() - sorted.size() / 100;
    if (!sorted.empty())
      std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(rank - 1),
                       sorted.end());
    return {{"energy_gain_rel", energy_.gain_rel()},
            {"penetration_m", deepest(depths_m_)},
            {"penetration_p99_m", sorted.empty() ? 0.0 : sorted[rank - 1]},
            {"speed_m_s", speed_m_s_}};
  }

 private:
  EnergyTrack energy_;
  Overlaps overlaps_;
  const bool at_end_;
  std::vector<double> depths_m_;
  double speed_m_s_ = 0.0;
};

// Contact impulses are in the states; the pair's other body is named by the lower one.
class StackForcesJudge final : public Judge {
 public:
  StackForcesJudge(const scenarios::Scenario& scenario, double dt_s, double duration_s)
      : dt_s_(dt_s), from_s_(0.9 * duration_s) {
    const std::vector<physics::BodyParams>& bodies = scenario.scene.bodies;
    double above = 0.0;
    carried_newton_.resize(bodies.size());
    for (std::size_t i = bodies.size(); i-- > 0;) {
      above += bodies[i].mass_kg * scenario.scene.gravity_m_s2.norm();
      carried_newton_[i] = above;
    }
  }
  void see(double time_s, std::span<const BodyState> states) override {
    if (time_s < from_s_) return;
    // Body i rests on body i - 1, the lowest on a static: each carries itself and what is above.
    std::vector<double> impulse(states.size(), 0.0);
    for (std::size_t i = 0; i < states.size(); ++i)
      for (const physics::ContactImpulse& contact : states[i].impulses) {
        const bool is_floor = physics::is_static(contact.other);
        const std::size_t upper = is_floor ? i : physics::index_of(contact.other);
        impulse[upper] += contact.normal_newton_s;
        seen_ = true;
      }
    for (std::size_t i = 0; i < impulse.size(); ++i)
      force_rel_ = worse(force_rel_, std::abs(impulse[i] / dt_s_ / carried_newton_[i] - 1.0));
  }
  std::vector<Measured> errors() const override {
    if (!seen_) return {};
    return {{"force_rel", force_rel_}};
  }

 private:
  const double dt_s_, from_s_;
  std::vector<double> carried_newton_;
  double force_rel_ = 0.0;
  bool seen_ = false;
};

class EndJudge final : public Judge {
 public:
  EndJudge(const scenarios::Scenario& scenario, std::vector<scenarios::StoredRun::End> ends,
           bool velocities)
      : scenario_(scenario), ends_(std::move(ends)), velocities_(velocities) {}
  void see(double, std::span<const BodyState> states) override {
    last_.assign(states.begin(), states.end());
  }
  std::vector<Measured> errors() const override {
    double position = 0.0, attitude = 0.0, velocity = 0.0;
    for (const scenarios::StoredRun::End& end : ends_) {
      const std::size_t i = physics::index_of(id_of_label(scenario_, end.body));
      position = worse(position, (last_[i].position_m - end.position_m).norm());
      attitude = worse(attitude, angle_between(last_[i].orientation, end.orientation));
      // After a reversal the velocities come back with the other sign.
      velocity =
          worse(velocity,
                (last_[i].linear_velocity_m_s + scenario_.initial[i].linear_velocity_m_s).norm());
    }
    std::vector<Measured> all{{"position_m", position}, {"attitude_rad", attitude}};
    if (velocities_) all.push_back({"velocity_m_s", velocity});
    return all;
  }

 private:
  const scenarios::Scenario& scenario_;
  const std::vector<scenarios::StoredRun::End> ends_;
  const bool velocities_;
  std::vector<BodyState> last_;
};

}  // namespace

Overlaps::Overlaps(const scenarios::Scenario& scenario)
    : scene_(scenario.scene), geometry_(scenario.scene), ids_(all_ids(scenario.initial.size())) {}

void Overlaps::find(std::span<const BodyState> states, std::vector<double>& depths_m) {
  physics::compute_boxes(scene_, geometry_, ids_, states, scratch_.boxes, counters_);
  physics::find_contacts(scene_, geometry_, ids_, states, scratch_, counters_);
  for (const physics::ContactManifold& manifold : scratch_.manifolds)
    for (std::uint32_t i = 0; i < manifold.count; ++i)
      if (!(manifold.points[i].separation_m >= 0.0))
        depths_m.push_back(-manifold.points[i].separation_m);
}

std::unique_ptr<Judge> judge_rest(const scenarios::Scenario& scenario) {
  return std::make_unique<RestJudge>(scenario);
}

std::unique_ptr<Judge> judge_conserved(const scenarios::Scenario& scenario) {
  return std::make_unique<ConservedJudge>(scenario);
}

std::unique_ptr<Judge> judge_side(const scenarios::Scenario& scenario,
                                  const scenarios::OneSide& answer) {
  return std::make_unique<SideJudge>(scenario, answer);
}

std::unique_ptr<Judge> judge_pile(const scenarios::Scenario& scenario, bool at_end) {
  return std::make_unique<PileJudge>(scenario, at_end);
}

std::unique_ptr<Judge> judge_stack_forces(const scenarios::Scenario& scenario, double dt_s,
                                          double duration_s) {
  return std::make_unique<StackForcesJudge>(scenario, dt_s, duration_s);
}

std::unique_ptr<Judge> judge_end(const scenarios::Scenario& scenario,
                                 const std::vector<scenarios::StoredRun::End>& ends) {
  return std::make_unique<EndJudge>(scenario, ends, false);
}

std::unique_ptr<Judge> judge_return(const scenarios::Scenario& scenario) {
  std::vector<scenarios::StoredRun::End> ends;
  for (std::size_t i = 0; i < scenario.initial.size(); ++i)
    ends.push_back({scenario.scene.bodies[i].label, scenario.initial[i].position_m,
                    scenario.initial[i].orientation});
  return std::make_unique<EndJudge>(scenario, std::move(ends), true);
}

}  // namespace soda::analysis
