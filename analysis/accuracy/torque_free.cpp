#include "analysis/accuracy/torque_free.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>

namespace soda::analysis {
namespace {

using physics::Mat3;
using physics::Quat;
using physics::Vec3;
using Real = long double;

// Principal axes as columns, right-handed, with ascending moments. Moments that differ by rounding
// are one moment: a symmetric body has no middle axis.
struct Principal {
  Mat3 axes;
  std::array<Real, 3> moment;
};

Principal principal_of(const Mat3& inertia) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
  Principal p{solver.eigenvectors(), {}};
  if (p.axes.determinant() < 0.0) p.axes.col(0) = -p.axes.col(0);
  for (int i = 0; i < 3; ++i) p.moment[static_cast<std::size_t>(i)] = solver.eigenvalues()[i];
  auto& m = p.moment;
  const Real same = 1e-12L * m[2];
  if (m[1] - m[0] < same) m[0] = m[1] = 0.5L * (m[0] + m[1]);
  if (m[2] - m[1] < same) m[1] = m[2] = 0.5L * (m[1] + m[2]);
  return p;
}

// Spin in the principal frame: w1 = A1 cn, w2 = A2 sn, w3 = A3 dn, where axis 3 is the outer one
// about which the spin goes round without ever changing its sign.
class EulerSpin {
 public:
  // `i`: moments in the order in which axis 3 is that axis.
  EulerSpin(const std::array<Real, 3>& i, const std::array<Real, 3>& w) {
    const Real p = i[0] * (i[2] - i[0]) * w[0] * w[0] + i[1] * (i[2] - i[1]) * w[1] * w[1];
    const Real q = i[1] * (i[1] - i[0]) * w[1] * w[1] + i[2] * (i[2] - i[0]) * w[2] * w[2];
    // p = 2 E I3 - L^2 and q = L^2 - 2 E I1, written without cancellation.
    const Real sign3 = w[2] < 0 ? -1 : 1;
    const Real parity = i[2] > i[1] ? 1 : -1;  // the signs of w1 w2 w3 that Euler's equations allow
    amplitude_ = {std::sqrt(p / (i[0] * (i[2] - i[0]))),
                  parity * sign3 * std::sqrt(p / (i[1] * (i[2] - i[1]))),
                  sign3 * std::sqrt(q / (i[2] * (i[2] - i[0])))};
    rate_ = std::sqrt((i[2] - i[1]) * q / (i[0] * i[1] * i[2]));
    modulus_ = std::sqrt((i[1] - i[0]) * p / ((i[2] - i[1]) * q));
    phase_ =
        boost::math::ellint_1(modulus_, std::atan2(w[1] / amplitude_[1], w[0] / amplitude_[0]));
  }

  std::array<Real, 3> at(Real t) const {
    Real cn = 0, dn = 0;
    const Real sn = boost::math::jacobi_elliptic(modulus_, phase_ + rate_ * t, &cn, &dn);
    return {amplitude_[0] * cn, amplitude_[1] * sn, amplitude_[2] * dn};
  }
  Real rate() const { return rate_; }

 private:
  std::array<Real, 3> amplitude_{};
  Real rate_ = 0, modulus_ = 0, phase_ = 0;
};

// The principal axes in a frame whose z is the angular momentum, when axis 3 stands at `azimuth`.
Mat3 attitude_in_momentum_frame(const std::array<Real, 3>& moment, const std::array<Real, 3>& w,
                                Real azimuth) {
  std::array<Real, 3> l{};
  Real squared = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    l[k] = moment[k] * w[k];
    squared += l[k] * l[k];
  }
  for (Real& component : l) component /= std::sqrt(squared);
  const Real sine = std::hypot(l[0], l[1]);
  const Real c = std::cos(azimuth), s = std::sin(azimuth);
  const Real a = -l[0] / sine, b = l[1] / sine;  // axis 1 = a p + b q, axis 2 = -b p + a q
  const std::array<Real, 3> p{l[2] * c, l[2] * s, -sine}, q{-s, c, 0}, e{sine * c, sine * s, l[2]};
  Mat3 out;
  for (int k = 0; k < 3; ++k) {
    const auto n = static_cast<std::size_t>(k);
    out(k, 0) = static_cast<double>(a * p[n] + b * q[n]);
    out(k, 1) = static_cast<double>(-b * p[n] + a * q[n]);
    out(k, 2) = static_cast<double>(e[n]);
  }
  return out;
}

// Azimuth of axis 3 about the angular momentum, integrated as time goes on.
class Precession {
 public:
  Precession(const std::array<Real, 3>& moment, const EulerSpin& spin)
      : moment_(moment), spin_(spin) {}

  Real at(Real t) {
    const auto rate = [this](Real s) {
      const std::array<Real, 3> w = spin_.at(s);
      const Real l0 = moment_[0] * w[0], l1 = moment_[1] * w[1], l2 = moment_[2] * w[2];
      return std::sqrt(l0 * l0 + l1 * l1 + l2 * l2) * (l0 * w[0] + l1 * w[1]) / (l0 * l0 + l1 * l1);
    };
    const int parts = 1 + static_cast<int>(std::fabs(t - time_) * spin_.rate() / 0.25L);
    const Real length = (t - time_) / parts;
    for (int part = 0; part < parts; ++part) {
      const Real from = time_ + length * part;
      if (length != 0)
        azimuth_ += boost::math::quadrature::gauss<Real, 20>::integrate(rate, from, from + length);
    }
    time_ = t;
    return azimuth_;
  }

 private:
  std::array<Real, 3> moment_;
  EulerSpin spin_;
  Real time_ = 0, azimuth_ = 0;
};

Motion straight_on(const StartingBody& body, double t) {
  return {body.state.position_m + body.state.linear_velocity_m_s * t,
          body.state.linear_velocity_m_s, body.state.orientation,
          body.state.angular_velocity_rad_s};
}

MotionAt steady(const StartingBody& body) {
  return [body](double t) {
    Motion motion = straight_on(body, t);
    const Vec3 turn = body.state.angular_velocity_rad_s * t;
    if (turn.norm() > 0.0)
      motion.orientation =
          Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * body.state.orientation;
    return motion;
  };
}

}  // namespace

MotionAt torque_free(const StartingBody& body) {
  const Principal principal = principal_of(body.params.inertia_local_kg_m2);
  const Vec3 local = principal.axes.transpose() *
                     (body.state.orientation.conjugate() * body.state.angular_velocity_rad_s);
  std::array<Real, 3> i = principal.moment, w{local[0], local[1], local[2]};
  const Vec3 momentum(static_cast<double>(i[0] * w[0]), static_cast<double>(i[1] * w[1]),
                      static_cast<double>(i[2] * w[2]));
  if (local.cross(momentum).norm() <= 1e-15 * local.norm() * momentum.norm()) return steady(body);

  // Axis 3 is that of the largest or of the smallest moment: the one about which spin goes round.
  Mat3 axes = principal.axes;
  if (i[0] * (i[0] - i[1]) * w[0] * w[0] + i[2] * (i[2] - i[1]) * w[2] * w[2] < 0) {
    axes.col(0) = -principal.axes.col(2);
    axes.col(2) = principal.axes.col(0);
    w = {-w[2], w[1], w[0]};
    std::swap(i[0], i[2]);
  }
  const EulerSpin spin(i, w);
  const Mat3 world = body.state.orientation.toRotationMatrix() * axes *
                     attitude_in_momentum_frame(i, spin.at(0), 0).transpose();
  return [body, spin, i, axes, world, precession = Precession(i, spin)](double t) mutable {
    Motion motion = straight_on(body, t);
    const std::array<Real, 3> now = spin.at(t);
    const Mat3 attitude =
        world * attitude_in_momentum_frame(i, now, precession.at(t)) * axes.transpose();
    motion.orientation = Quat(attitude).normalized();
    motion.angular_velocity_rad_s =
        attitude * axes *
        Vec3(static_cast<double>(now[0]), static_cast<double>(now[1]), static_cast<double>(now[2]));
    return motion;
  };
}

}  // namespace soda::analysis
