#include "analysis/accuracy/closed_forms.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

constexpr double kForever = std::numeric_limits<double>::infinity();

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

Quat turned_by(const Vec3& angle_rad, const Quat& orientation) {
  const double angle = angle_rad.norm();
  if (angle == 0.0) return orientation;
  return Quat(Eigen::AngleAxisd(angle, angle_rad / angle)) * orientation;
}

// Straight on at constant velocity and spin, from `position_m` at time 0.
Motion coasting(const Vec3& position_m, const Vec3& velocity_m_s, const Quat& orientation,
                const Vec3& spin_rad_s, double time_s) {
  return {position_m + velocity_m_s * time_s, velocity_m_s,
          turned_by(spin_rad_s * time_s, orientation), spin_rad_s};
}

double restitution_power(double restitution, int power) {
  return std::pow(restitution, static_cast<double>(power));
}

}  // namespace

Slope slope_of(double slope_deg, double azimuth_deg) {
  const double t = radians(slope_deg), p = radians(azimuth_deg);
  Slope slope;
  slope.down = Vec3(std::cos(t) * std::cos(p), std::cos(t) * std::sin(p), -std::sin(t));
  slope.side = Vec3(-std::sin(p), std::cos(p), 0.0);
  slope.normal = slope.down.cross(slope.side);
  return slope;
}

MotionAt free_flight(const StartingBody& body, const Vec3& gravity_m_s2) {
  return [body, gravity_m_s2](double t) {
    Motion motion;
    motion.position_m =
        body.state.position_m + body.state.linear_velocity_m_s * t + gravity_m_s2 * (0.5 * t * t);
    motion.linear_velocity_m_s = body.state.linear_velocity_m_s + gravity_m_s2 * t;
    return motion;
  };
}

SlidingLaw sliding_law(double speed_m_s, double gravity_m_s2, double slope_deg, double friction) {
  const double t = radians(slope_deg);
  SlidingLaw law;
  law.speed_m_s = speed_m_s;
  const double pull = gravity_m_s2 * std::sin(t), rubs = gravity_m_s2 * friction * std::cos(t);
  law.acceleration_m_s2 = speed_m_s < 0.0 ? pull + rubs : pull - rubs;
  if (speed_m_s >= 0.0 && law.acceleration_m_s2 >= 0.0) return law;
  law.turns = true;
  law.stops = pull <= rubs;
  law.stop_time_s = -speed_m_s / law.acceleration_m_s2;
  law.stop_way_m = 0.5 * speed_m_s * law.stop_time_s;
  law.after_m_s2 = std::max(0.0, pull - rubs);
  return law;
}

MotionAt sliding(const StartingBody& body, const Slope& slope, const SlidingLaw& law) {
  return [body, slope, law](double t) {
    const bool first = !law.turns || t < law.stop_time_s;
    const double then_s = t - law.stop_time_s;
    const double way = first ? law.speed_m_s * t + 0.5 * law.acceleration_m_s2 * t * t
                             : law.stop_way_m + 0.5 * law.after_m_s2 * then_s * then_s;
    const double speed =
        first ? law.speed_m_s + law.acceleration_m_s2 * t : law.after_m_s2 * then_s;
    return Motion{body.state.position_m + slope.down * way, slope.down * speed,
                  body.state.orientation, Vec3(Vec3::Zero())};
  };
}

// A sphere that rolls slides like a box on which 5/7 of all forces act.
MotionAt rolling_to_a_stop(const StartingBody& body, double gravity_m_s2,
                           const scenarios::Rolling& answer) {
  const Slope slope = slope_of(answer.slope_deg, answer.azimuth_deg);
  const Vec3 axis = slope.normal.cross(slope.down);
  const double radius = body.radius_m, start = body.state.position_m.dot(slope.down);
  const MotionAt way =
      sliding(body, slope,
              sliding_law(body.state.linear_velocity_m_s.dot(slope.down), 5.0 / 7.0 * gravity_m_s2,
                          answer.slope_deg, answer.rolling_friction_m / radius));
  return [=](double time) {
    Motion motion = way(time);
    const double angle = (motion.position_m.dot(slope.down) - start) / radius;
    motion.orientation = turned_by(axis * angle, body.state.orientation);
    motion.angular_velocity_rad_s = axis * (motion.linear_velocity_m_s.dot(slope.down) / radius);
    return motion;
  };
}

MotionAt rolling(const StartingBody& body, double gravity_m_s2, const scenarios::Rolling& answer) {
  if (answer.rolling_friction_m > 0.0) return rolling_to_a_stop(body, gravity_m_s2, answer);
  const Slope slope = slope_of(answer.slope_deg, answer.azimuth_deg);
  const Vec3 axis = slope.normal.cross(slope.down);
  const double t = radians(answer.slope_deg), radius = body.radius_m;
  const double pull = gravity_m_s2 * std::sin(t);
  const double most_friction = answer.friction * gravity_m_s2 * std::cos(t);
  const double u0 = body.state.linear_velocity_m_s.dot(slope.down);
  const double w0 = body.state.angular_velocity_rad_s.dot(axis);
  const double slip = u0 - w0 * radius;
  const bool grips = 7.0 * most_friction >= 2.0 * pull;
  const double sign = slip < 0.0 ? -1.0 : 1.0;
  // While it slides; friction also turns a solid sphere, 5/2 as strongly.
  const double a = pull - sign * most_friction, alpha = sign * 2.5 * most_friction / radius;
  const double slip_rate = a - alpha * radius;
  double grip_time = kForever;
  if (slip == 0.0 && grips) grip_time = 0.0;
  if (slip != 0.0 && slip * slip_rate < 0.0) grip_time = -slip / slip_rate;
  return [=](double time) {
    const double s = std::min(time, grip_time), r = time - s;
    // Rolling: 5/7 of the pull, as a solid sphere's spin takes the rest.
    const double roll = 5.0 / 7.0 * pull;
    const double us = u0 + a * s, ws = w0 + alpha * s;
    const double way = u0 * s + 0.5 * a * s * s + us * r + 0.5 * roll * r * r;
    const double angle = w0 * s + 0.5 * alpha * s * s + ws * r + 0.5 * (roll / radius) * r * r;
    return Motion{body.state.position_m + slope.down * way, slope.down * (us + roll * r),
                  turned_by(axis * angle, body.state.orientation),
                  Vec3(axis * (ws + roll / radius * r))};
  };
}

double BouncingLaw::flight_s(int bounce) const {
  return 2.0 * impact_speed_m_s * restitution_power(restitution, bounce) / gravity_m_s2;
}

double BouncingLaw::apex_m(int bounce) const {
  const double speed = impact_speed_m_s * restitution_power(restitution, bounce);
  return 0.5 * speed * speed / gravity_m_s2;
}

double BouncingLaw::rest_time_s() const {
  return first_impact_s + flight_s(1) / (1.0 - restitution);
}

BouncingLaw bouncing_law(const StartingBody& body, double gravity_m_s2, double restitution) {
  const double height = body.state.position_m.z() - body.radius_m;
  const double v = body.state.linear_velocity_m_s.z();
  BouncingLaw law;
  law.gravity_m_s2 = gravity_m_s2;
  law.restitution = restitution;
  law.impact_speed_m_s = std::sqrt(v * v + 2.0 * gravity_m_s2 * height);
  law.first_impact_s = (v + law.impact_speed_m_s) / gravity_m_s2;
  return law;
}

MotionAt bouncing(const StartingBody& body, const BouncingLaw& law) {
  return [body, law](double t) {
    Motion motion{body.state.position_m, Vec3::Zero(), body.state.orientation, Vec3(Vec3::Zero())};
    double height = 0.0, speed = 0.0;
    if (t < law.first_impact_s) {
      const double v = body.state.linear_velocity_m_s.z();
      speed = v - law.gravity_m_s2 * t;
      height = body.state.position_m.z() - body.radius_m + 0.5 * (v + speed) * t;
    } else if (t < law.rest_time_s()) {
      double since = t - law.first_impact_s;
      int bounce = 1;
      for (; since >= law.flight_s(bounce) && law.flight_s(bounce) > 1e-12; ++bounce)
        since -= law.flight_s(bounce);
      const double rise = 0.5 * law.gravity_m_s2 * law.flight_s(bounce);
      speed = rise - law.gravity_m_s2 * since;
      height = std::max(0.0, 0.5 * (rise + speed) * since);
    }
    motion.position_m.z() = body.radius_m + height;
    motion.linear_velocity_m_s.z() = speed;
    return motion;
  };
}

std::vector<MotionAt> two_spheres(const StartingBody& a, const StartingBody& b,
                                  const Vec3& gravity_m_s2, double restitution) {
  const Vec3 x = b.state.position_m - a.state.position_m;
  const Vec3 v = b.state.linear_velocity_m_s - a.state.linear_velocity_m_s;
  const double reach = a.radius_m + b.radius_m, closing = -x.dot(v), vv = v.squaredNorm();
  const double root = closing * closing - vv * (x.squaredNorm() - reach * reach);
  const bool meets = closing > 0.0 && root >= 0.0;
  // The smaller root, without cancellation.
  const double time =
      meets ? (x.squaredNorm() - reach * reach) / (closing + std::sqrt(root)) : kForever;
  Vec3 impulse = Vec3::Zero();  // on b
  if (meets) {
    const Vec3 normal = (x + v * time).normalized();
    const double mass = 1.0 / (1.0 / a.params.mass_kg + 1.0 / b.params.mass_kg);
    impulse = normal * (-(1.0 + restitution) * mass * v.dot(normal));
  }
  const auto moving = [&](const StartingBody& body, const Vec3& change) -> MotionAt {
    return [body, change, time, gravity_m_s2](double t) {
      const double after = std::max(0.0, t - time);
      Motion motion = coasting(body.state.position_m, body.state.linear_velocity_m_s,
                               body.state.orientation, body.state.angular_velocity_rad_s, t);
      motion.position_m += change * after + gravity_m_s2 * (0.5 * t * t);
      motion.linear_velocity_m_s += (t > time ? change : Vec3(Vec3::Zero())) + gravity_m_s2 * t;
      return motion;
    };
  };
  return {moving(a, -impulse / a.params.mass_kg), moving(b, impulse / b.params.mass_kg)};
}

MotionAt floor_impact(const StartingBody& body, const scenarios::FloorImpact& answer) {
  const Vec3 v = body.state.linear_velocity_m_s, w = body.state.angular_velocity_rad_s;
  const Vec3 arm = Vec3::UnitZ() * -body.radius_m;
  const double mass = body.params.mass_kg, inertia = 0.4 * mass * body.radius_m * body.radius_m;
  const double time = v.z() < 0.0 ? (body.state.position_m.z() - body.radius_m) / -v.z() : kForever;
  Vec3 slip = v + w.cross(arm);
  slip.z() = 0.0;
  const double normal_impulse = (1.0 + answer.restitution) * mass * -v.z();
  const double sticking = 2.0 / 7.0 * mass * slip.norm();
  Vec3 impulse = Vec3::UnitZ() * normal_impulse;
  if (slip.norm() > 0.0)
    impulse -= slip.normalized() * std::min(sticking, answer.friction * normal_impulse);
  const Vec3 after_v = v + impulse / mass, after_w = w + arm.cross(impulse) / inertia;
  return [=](double t) {
    if (t <= time) return coasting(body.state.position_m, v, body.state.orientation, w, t);
    const Motion there = coasting(body.state.position_m, v, body.state.orientation, w, time);
    return coasting(there.position_m, after_v, *there.orientation, after_w, t - time);
  };
}

// Equal masses that exchange velocities are points that pass through each other, once the diameters
// between a body and the first are taken out: the n-th body is always the n-th point.
std::vector<MotionAt> sphere_line(const std::vector<StartingBody>& bodies) {
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return bodies[a].state.position_m.x() < bodies[b].state.position_m.x();
  });
  struct Point {
    double x, v;
  };
  std::vector<Point> points;
  for (std::size_t n = 0; n < order.size(); ++n) {
    const StartingBody& body = bodies[order[n]];
    points.push_back({body.state.position_m.x() - 2.0 * body.radius_m * static_cast<double>(n),
                      body.state.linear_velocity_m_s.x()});
  }
  std::vector<MotionAt> motions(bodies.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    const StartingBody& body = bodies[order[n]];
    motions[order[n]] = [body, points, n](double t) {
      std::vector<Point> now;
      now.reserve(points.size());
      for (const Point& p : points) now.push_back({p.x + p.v * t, p.v});
      std::sort(now.begin(), now.end(),
                [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.v < b.v; });
      Motion motion{body.state.position_m, Vec3(now[n].v, 0, 0), body.state.orientation,
                    Vec3(Vec3::Zero())};
      motion.position_m.x() = now[n].x + 2.0 * body.radius_m * static_cast<double>(n);
      return motion;
    };
  }
  return motions;
}

}  // namespace soda::analysis
