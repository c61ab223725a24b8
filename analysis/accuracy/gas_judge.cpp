#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/accuracy/scene_judges.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Vec3;

// Equal spheres without friction: all energy is that of their centres.
class GasJudge final : public Judge {
 public:
  GasJudge(const scenarios::Scenario& scenario, const Vec3& size_m, double dt_s)
      : scenario_(scenario), dt_s_(dt_s) {
    const physics::BodyParams& body = scenario.scene.bodies.front();
    mass_kg_ = body.mass_kg;
    if (const auto* sphere = std::get_if<physics::Sphere>(&scenario.scene.shapes[body.shape]))
      radius_m_ = sphere->radius_m;
    room_m_ = size_m - Vec3::Constant(2.0 * radius_m_);
    double squares = 0.0;
    for (const BodyState& state : scenario.initial)
      squares += state.linear_velocity_m_s.squaredNorm();
    mean_square_ = squares / (3.0 * static_cast<double>(scenario.initial.size()));
    find_walls();
  }

  void see(double time_s, std::span<const BodyState> states) override {
    if (!last_.empty()) {
      for (std::size_t i = 0; i < states.size(); ++i) count_rebounds(last_[i], states[i]);
      time_s_ = time_s;
      // Starting velocities are not Maxwell's; half a second is many collisions of every sphere.
      for (const BodyState& state : states)
        for (int k = 0; k < 3; ++k) components_.push_back(state.linear_velocity_m_s[k]);
      if (components_.size() > kMostSamples)
        components_.erase(components_.begin(),
                          components_.begin() + static_cast<std::ptrdiff_t>(kMostSamples / 2));
    }
    last_.assign(states.begin(), states.end());
  }

  std::vector<Measured> errors() const override {
    const double x = room_m_.x(), y = room_m_.y(), z = room_m_.z();
    const double walls_m2 = 2.0 * (x * y + y * z + z * x);
    const double pressure = impulse_newton_s_ / (time_s_ * walls_m2);
    return {{"pressure_rel", std::abs(pressure / expected_pressure() - 1.0)},
            {"speeds_rel", distance_from_normal()}};
  }

 private:
  static constexpr std::size_t kMostSamples = 2'000'000;

  // The walls stand where the half-spaces of the scene say; the room of the centres between them.
  void find_walls() {
    least_m_ = Vec3::Constant(1e300);
    for (const physics::StaticBody& wall : scenario_.scene.statics) {
      const auto* plane = std::get_if<physics::HalfSpace>(&scenario_.scene.shapes[wall.shape]);
      if (plane == nullptr) continue;
      const Vec3 normal = wall.orientation * plane->normal;
      for (int k = 0; k < 3; ++k)
        if (normal[k] > 0.99) least_m_[k] = wall.position_m[k] + plane->offset_m + radius_m_;
    }
    most_m_ = least_m_ + room_m_;
  }

  // A component that turns round within reach of its wall has given the wall twice its momentum.
  void count_rebounds(const BodyState& before, const BodyState& after) {
    for (int k = 0; k < 3; ++k) {
      const double v0 = before.linear_velocity_m_s[k], v1 = after.linear_velocity_m_s[k];
      if (v0 * v1 >= 0.0) continue;
      const double ahead = before.position_m[k] + v0 * dt_s_;
      const double slack = 1e-3 * radius_m_;
      const bool reaches = v0 < 0.0 ? ahead <= least_m_[k] + slack : ahead >= most_m_[k] - slack;
      if (reaches) impulse_newton_s_ += mass_kg_ * std::abs(v1 - v0);
    }
  }

  // Of hard spheres to the second virial coefficient; the walls leave their centres room_m_.
  double expected_pressure() const {
    const double volume = room_m_.prod();
    const auto count = static_cast<double>(scenario_.initial.size());
    const double covolume = 2.0 / 3.0 * std::numbers::pi * std::pow(2.0 * radius_m_, 3);
    return count * mass_kg_ * mean_square_ / volume * (1.0 + (count - 1.0) * covolume / volume);
  }

  double distance_from_normal() const {
    std::vector<double> sorted(
        components_.begin() + static_cast<std::ptrdiff_t>(components_.size() / 2),
        components_.end());
    std::sort(sorted.begin(), sorted.end());
    double worst = 0.0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      const double share = 0.5 * std::erfc(-sorted[i] / std::sqrt(2.0 * mean_square_));
      const double n = static_cast<double>(sorted.size());
      worst = worse(worst, std::abs(share - (static_cast<double>(i) + 0.5) / n));
    }
    return worst;
  }

  const scenarios::Scenario& scenario_;
  const double dt_s_;
  double mass_kg_ = 0.0, radius_m_ = 0.0, mean_square_ = 0.0, time_s_ = 0.0;
  double impulse_newton_s_ = 0.0;
  Vec3 room_m_ = Vec3::Zero(), least_m_ = Vec3::Zero(), most_m_ = Vec3::Zero();
  std::vector<BodyState> last_;
  std::vector<double> components_;
};

}  // namespace

std::unique_ptr<Judge> judge_gas(const scenarios::Scenario& scenario,
                                 const scenarios::HardSphereGas& answer, double dt_s) {
  return std::make_unique<GasJudge>(scenario, answer.size_m, dt_s);
}

}  // namespace soda::analysis
