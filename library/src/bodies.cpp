// What a simulation tells of its bodies, and how they are put elsewhere.
#include <algorithm>
#include <cmath>
#include <set>

#include "library/src/simulation_impl.hpp"

namespace soda {
namespace {

bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// As good as unit stays as it is, so that what is read and written back is the same bits.
physics::Quat unit(const Quat& q) {
  constexpr double kRounding = 1e-12, kNearUnit = 1e-3;
  const double norm = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (!(std::abs(norm - 1.0) <= kNearUnit))
    throw UsageError("an orientation of length " + std::to_string(norm) + "; allowed: 1");
  if (std::abs(norm - 1.0) <= kRounding) return inner(q);
  return {q.w / norm, q.x / norm, q.y / norm, q.z / norm};
}

}  // namespace

std::span<const std::uint32_t> Simulation::body_ids() const { return impl_->labels; }

bool Simulation::has(std::uint32_t body) const {
  return std::ranges::binary_search(impl_->labels, body);
}

BodyState Simulation::state(std::uint32_t body) const {
  return outer(impl_->now.states[impl_->place_of(body)]);
}

std::vector<BodyState> Simulation::states() const {
  std::vector<BodyState> all;
  states(all);
  return all;
}

void Simulation::states(std::vector<BodyState>& out) const {
  out.clear();
  out.reserve(impl_->now.states.size());
  for (const physics::BodyState& state : impl_->now.states) out.push_back(outer(state));
}

void Simulation::set_state(std::uint32_t body, const BodyState& state) {
  Moment& now = impl_->now;
  const std::size_t place = impl_->place_of(body);
  if (!is_finite(state.position_m) || !is_finite(state.velocity_m_s) ||
      !is_finite(state.angular_velocity_rad_s))
    throw UsageError("a state of body " + std::to_string(body) + " that is not finite");
  physics::BodyState& own = now.states[place];
  const bool stays =
      outer(own).position_m == state.position_m && outer(own).orientation == state.orientation;
  const physics::Quat orientation = unit(state.orientation);
  own.position_m = inner(state.position_m);
  own.orientation = orientation;
  own.linear_velocity_m_s = inner(state.velocity_m_s);
  own.angular_velocity_rad_s = inner(state.angular_velocity_rad_s);
  if (stays) return;
  own.impulses.clear();
  const physics::BodyId id = now.ids[place];
  for (physics::BodyState& other : now.states)
    std::erase_if(other.impulses,
                  [id](const physics::ContactImpulse& impulse) { return impulse.other == id; });
}

std::vector<std::uint32_t> Simulation::broken_joints() const {
  std::set<std::uint32_t> broken;
  for (const physics::BodyState& state : impl_->now.states)
    broken.insert(state.broken_joints.begin(), state.broken_joints.end());
  return {broken.begin(), broken.end()};
}

}  // namespace soda
