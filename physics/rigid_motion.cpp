#include "physics/rigid_motion.hpp"

#include <cmath>

namespace soda::physics {

Quat rotation_by(const Vec3& angle_rad) {
  // q = (cos h, sin h * axis) with h half the angle. h is halved until the polynomials are good to
  // rounding, and the quaternion squared as often.
  constexpr double kPolynomialLimit = 0.25;
  constexpr int kMaxHalvings = 40;
  Vec3 half = 0.5 * angle_rad;
  double squared = half.squaredNorm();
  int halvings = 0;
  for (; squared > kPolynomialLimit * kPolynomialLimit && halvings < kMaxHalvings; ++halvings) {
    half *= 0.5;
    squared *= 0.25;
  }
  const double s = squared;
  const double sine_over_h =
      1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0))));
  const double cosine =
      1.0 - s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0 * (1.0 - s / 90.0))));
  double w = cosine;
  Vec3 v = half * sine_over_h;
  for (int i = 0; i < halvings; ++i) {
    const double doubled_w = w * w - v.squaredNorm();
    v *= 2.0 * w;
    w = doubled_w;
    const double length = std::sqrt(w * w + v.squaredNorm());
    w /= length;
    v /= length;
  }
  return Quat(w, v.x(), v.y(), v.z());
}

Mat3 rotated_tensor(const Mat3& rotation, const Mat3& tensor_local) {
  const Mat3 half = rotation * tensor_local;
  Mat3 out;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      out(i, j) = half.row(i).dot(rotation.row(j));
      out(j, i) = out(i, j);
    }
  }
  return out;
}

void push(const BodyParams& params, const Vec3& impulse_newton_s, const Vec3& point_local_m,
          BodyState& state) {
  const Mat3 rotation = state.orientation.toRotationMatrix();
  const Mat3 inverse_inertia = rotated_tensor(rotation, params.inverse_inertia_local);
  const Vec3 arm(rotation * point_local_m);
  const Vec3 twist = arm.cross(impulse_newton_s);
  for (int axis = 0; axis < 3; ++axis) {
    state.linear_velocity_m_s[axis] += impulse_newton_s[axis] / params.mass_kg;
    state.angular_velocity_rad_s[axis] += inverse_inertia.row(axis).dot(twist);
  }
}

bool is_isotropic(const Mat3& inertia) {
  return inertia(0, 0) == inertia(1, 1) && inertia(1, 1) == inertia(2, 2) && inertia(0, 1) == 0.0 &&
         inertia(0, 2) == 0.0 && inertia(1, 2) == 0.0;
}

namespace {

Quat product(const Quat& rotation, const Quat& orientation) {
  // Written out: Eigen's product has a vectorised form whose order of terms is its own affair.
  const double w = rotation.w(), x = rotation.x(), y = rotation.y(), z = rotation.z();
  const double ow = orientation.w(), ox = orientation.x(), oy = orientation.y(),
               oz = orientation.z();
  const double rw = w * ow - x * ox - y * oy - z * oz;
  const double rx = w * ox + x * ow + y * oz - z * oy;
  const double ry = w * oy - x * oz + y * ow + z * ox;
  const double rz = w * oz + x * oy - y * ox + z * ow;
  const double inverse = 1.0 / std::sqrt(rw * rw + rx * rx + ry * ry + rz * rz);
  return Quat(rw * inverse, rx * inverse, ry * inverse, rz * inverse);
}

}  // namespace

Quat turned(const Vec3& angle_rad, const Quat& orientation) {
  if (angle_rad == Vec3::Zero()) return orientation;
  return product(rotation_by(angle_rad), orientation);
}

namespace {

Vec3 spin_of(const BodyParams& params, const Quat& orientation, const Vec3& angular_momentum) {
  const Mat3 rotation = orientation.toRotationMatrix();
  return rotation *
         Vec3(params.inverse_inertia_local * Vec3(rotation.transpose() * angular_momentum));
}

}  // namespace

void rotate_freely(const BodyParams& params, double dt_s, BodyState& state) {
  const Vec3 spin = state.angular_velocity_rad_s;
  if (spin == Vec3::Zero()) return;
  const Quat start = state.orientation;
  if (is_isotropic(params.inertia_local_kg_m2)) {
    state.orientation = turned(dt_s * spin, start);
    return;
  }
  const Mat3 rotation = start.toRotationMatrix();
  const Vec3 angular_momentum =
      rotation * Vec3(params.inertia_local_kg_m2 * Vec3(rotation.transpose() * spin));
  const Quat middle = turned((0.5 * dt_s) * spin, start);
  const Vec3 middle_spin = spin_of(params, middle, angular_momentum);
  state.orientation = turned(dt_s * middle_spin, start);
  state.angular_velocity_rad_s = spin_of(params, state.orientation, angular_momentum);
}

const char* fault_of(const BodyState& s) {
  // Negated comparisons, so that NaN is a fault.
  if (!(s.position_m.cwiseAbs().maxCoeff() <= kLargestPosition_m) || !s.position_m.allFinite()) {
    return "position not finite or beyond 1e12 m";
  }
  if (!(s.linear_velocity_m_s.squaredNorm() <= kLargestSpeed_m_s * kLargestSpeed_m_s)) {
    return "speed not finite or above 1e9 m/s";
  }
  if (!(s.angular_velocity_rad_s.squaredNorm() <= kLargestSpin_rad_s * kLargestSpin_rad_s)) {
    return "spin not finite or above 1e9 rad/s";
  }
  if (!(std::abs(s.orientation.squaredNorm() - 1.0) < 1e-6)) return "orientation not unit";
  return "";
}

}  // namespace soda::physics
