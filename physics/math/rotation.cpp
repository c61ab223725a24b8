// Rotations, and torque-free rotation over a step. There, the world angular momentum L stays; with
// one or two different moments the motion is a closed form, with three its Taylor series is summed
// to rounding.
#include <algorithm>
#include <array>
#include <cmath>

#include "physics/math/rigid_motion.hpp"

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
  // Taylor's series, by reciprocals: divisions take several times as long.
  const double sine_over_h =
      1.0 - s * (1.0 / 6.0) *
                (1.0 - s * (1.0 / 20.0) *
                           (1.0 - s * (1.0 / 42.0) *
                                      (1.0 - s * (1.0 / 72.0) * (1.0 - s * (1.0 / 110.0)))));
  const double cosine =
      1.0 - s * (1.0 / 2.0) *
                (1.0 - s * (1.0 / 12.0) *
                           (1.0 - s * (1.0 / 30.0) *
                                      (1.0 - s * (1.0 / 56.0) * (1.0 - s * (1.0 / 90.0)))));
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

namespace {

// First `orientation`, then `rotation`; unit to rounding even if they are not quite.
inline Quat composed(const Quat& rotation, const Quat& orientation) {
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

Quat turn_between(const Vec3& from, const Vec3& to) {
  constexpr double kOpposite = -1.0 + 1e-12;  // beyond it, rounding is what is left of the axis
  const Vec3 a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  if (cosine < kOpposite) {
    const Vec3 across = a.unitOrthogonal();
    return turn_between(-a, b) * Quat(0.0, across.x(), across.y(), across.z());
  }
  const double twice_w = std::sqrt((1.0 + cosine) * 2.0);
  const Vec3 axis = a.cross(b) * (1.0 / twice_w);
  return {0.5 * twice_w, axis.x(), axis.y(), axis.z()};
}

Quat turned(const Vec3& angle_rad, const Quat& orientation) {
  if (angle_rad == Vec3::Zero()) return orientation;
  return composed(rotation_by(angle_rad), orientation);
}
namespace {

Vec3 column(const Quat& q, int axis) {
  const double w = q.w(), x = q.x(), y = q.y(), z = q.z();
  if (axis == 0) return {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)};
  if (axis == 1) return {2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)};
  return {2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)};
}

// Precession about L at L / I1, and a rotation about the body's axis that undoes the part of it
// that does not belong to that axis. Both rates are constant, so the step has no error of its own.
void rotate_symmetric(const Mat3& inertia, int axis, double dt_s, BodyState& state) {
  const Vec3 before = column(state.orientation, axis);
  const double about_axis = before.dot(state.angular_velocity_rad_s);
  const double ratio = inertia(axis, axis) / inertia((axis + 1) % 3, (axis + 1) % 3);
  const double excess = (1.0 - ratio) * about_axis;
  const Vec3 precession = state.angular_velocity_rad_s - before * excess;
  Vec3 angular_velocity_local = Vec3::Zero();
  angular_velocity_local[axis] = excess * dt_s;
  state.orientation =
      turned(precession * dt_s, composed(state.orientation, rotation_by(angular_velocity_local)));
  state.angular_velocity_rad_s = precession + column(state.orientation, axis) * excess;
}

constexpr int kMostTerms = 24;
constexpr double kTermLimit = 1e-17;  // terms of the attitude below it are not worth having
// A stretch is so short that the angular velocity cannot turn by more (rad). Its series converges
// like (stretch / (pi/2))^k at worst, that of a constant one like that of the sine.
constexpr double kLongestStretch_rad = 0.5;
constexpr double kMostStretches = 1024.0;

// The rotation during `dt_s` in the body's frame, which holds `momentum` at the start: terms of
// M' = M x w, q' = q w / 2 with w = I^-1 M, in powers of t / dt.
Quat series_rotation(const Mat3& inverse_inertia, const Vec3& momentum, double dt_s) {
  std::array<Vec3, kMostTerms> m, w, v;  // v: the vector part of q, s its scalar part
  std::array<double, kMostTerms> s;
  m[0] = momentum;
  w[0] = times(inverse_inertia, momentum) * dt_s;
  s[0] = 1.0;
  v[0] = Vec3::Zero();
  double sum_s = 1.0, last = 1.0;
  Vec3 sum_v = Vec3::Zero();
  for (int k = 0; k + 1 < kMostTerms; ++k) {
    Vec3 moment = Vec3::Zero(), vector = Vec3::Zero();
    double scalar = 0.0;
    for (int j = 0; j <= k; ++j) {
      const Vec3& angular_velocity = w[k - j];
      moment += m[j].cross(angular_velocity);
      scalar -= v[j].dot(angular_velocity);
      vector += angular_velocity * s[j] + v[j].cross(angular_velocity);
    }
    const double share = 1.0 / (k + 1);
    m[k + 1] = moment * share;
    w[k + 1] = times(inverse_inertia, m[k + 1]) * dt_s;
    s[k + 1] = 0.5 * share * scalar;
    v[k + 1] = vector * (0.5 * share);
    sum_s += s[k + 1];
    sum_v += v[k + 1];
    // Two in a row, as one can vanish by symmetry.
    const double size = s[k + 1] * s[k + 1] + v[k + 1].squaredNorm();
    if (size <= kTermLimit * kTermLimit && last <= kTermLimit * kTermLimit) break;
    last = size;
  }
  return Quat(sum_s, sum_v.x(), sum_v.y(), sum_v.z());
}

void rotate_asymmetric(const BodyParams& params, double dt_s, BodyState& state) {
  const Mat3& inverse_inertia = params.inverse_inertia_local;
  const Mat3 rotation = state.orientation.toRotationMatrix();
  const Vec3 angular_velocity_local(rotation.transpose() * state.angular_velocity_rad_s);
  Vec3 momentum_local = times(params.inertia_local_kg_m2, angular_velocity_local);
  const Vec3 momentum(rotation * momentum_local);
  // The angular velocity never exceeds what all of the energy gives about the axis of the smallest
  // moment.
  const double fastest =
      std::sqrt(momentum_local.dot(angular_velocity_local) *
                (inverse_inertia(0, 0) + inverse_inertia(1, 1) + inverse_inertia(2, 2)));
  // Limited, so that a step of any state ends: an absurdly fast body comes less far than it should
  // in the same motion, with L and the energy as they were.
  const double wanted = std::ceil(fastest * std::abs(dt_s) * (1.0 / kLongestStretch_rad));
  const int stretches = wanted > 1.0 ? static_cast<int>(std::min(wanted, kMostStretches)) : 1;
  const double stretch_s = wanted > kMostStretches
                               ? std::copysign(kLongestStretch_rad / fastest, dt_s)
                               : dt_s / stretches;
  Mat3 turned_rotation = rotation;
  for (int i = 0; i < stretches; ++i) {
    if (i > 0) momentum_local = turned_rotation.transpose() * momentum;
    state.orientation =
        composed(state.orientation, series_rotation(inverse_inertia, momentum_local, stretch_s));
    turned_rotation = state.orientation.toRotationMatrix();
  }
  state.angular_velocity_rad_s =
      turned_rotation * times(inverse_inertia, Vec3(turned_rotation.transpose() * momentum));
}

}  // namespace

bool is_isotropic(const Mat3& inertia) {
  return inertia(0, 0) == inertia(1, 1) && inertia(1, 1) == inertia(2, 2) && inertia(0, 1) == 0.0 &&
         inertia(0, 2) == 0.0 && inertia(1, 2) == 0.0;
}

int symmetry_axis(const Mat3& inertia) {
  if (inertia(0, 1) != 0.0 || inertia(0, 2) != 0.0 || inertia(1, 2) != 0.0) return -1;
  if (inertia(0, 0) == inertia(1, 1)) return 2;
  if (inertia(0, 0) == inertia(2, 2)) return 1;
  return inertia(1, 1) == inertia(2, 2) ? 0 : -1;
}

void rotate_freely(const BodyParams& params, double dt_s, BodyState& state) {
  if (state.angular_velocity_rad_s == Vec3::Zero()) return;
  const Mat3& inertia = params.inertia_local_kg_m2;
  if (is_isotropic(inertia)) {
    state.orientation = turned(dt_s * state.angular_velocity_rad_s, state.orientation);
    return;
  }
  const int axis = symmetry_axis(inertia);
  if (axis >= 0) {
    rotate_symmetric(inertia, axis, dt_s, state);
  } else {
    rotate_asymmetric(params, dt_s, state);
  }
}

}  // namespace soda::physics
