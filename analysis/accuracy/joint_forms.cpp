#include "analysis/accuracy/joint_forms.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

// What is left of a velocity, the way of a velocity of 1, and that of an acceleration of 1.
struct Course {
  double left, speed_s, way_s2;
};
Course course(double damping_1_s, double t) {
  if (damping_1_s == 0.0) return {1.0, t, 0.5 * t * t};
  const double speed = -std::expm1(-damping_1_s * t) / damping_1_s;
  return {std::exp(-damping_1_s * t), speed, (t - speed) / damping_1_s};
}

Quat about(const Vec3& axis, double angle_rad) { return Quat(Eigen::AngleAxisd(angle_rad, axis)); }

bool parallel(const Vec3& a, const Vec3& b) {
  return a.cross(b).norm() <= 1e-12 * a.norm() * b.norm();
}

// A stretch of even acceleration.
struct Stretch {
  double from_s, place, speed, acceleration;
};

// The time after which `way` is gone from `speed` on, at even acceleration; never: infinity.
double time_to(double way, double speed, double acceleration) {
  const double never = std::numeric_limits<double>::infinity();
  if (acceleration == 0.0) return speed * way > 0.0 ? way / speed : never;
  const double root = speed * speed + 2.0 * acceleration * way;
  if (root < 0.0) return never;
  double best = never;
  for (const double sign : {-1.0, 1.0}) {
    const double t = (-speed + sign * std::sqrt(root)) / acceleration;
    if (t > 1e-12) best = std::min(best, t);
  }
  return best;
}

struct Travel {
  double pull = 0.0, motor = 0.0, target = 0.0;  // accelerations, and the motor's speed
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool has_motor = false;

  double acceleration(double speed) const {
    if (!has_motor) return pull;
    if (speed == target && motor >= std::abs(pull)) return 0.0;
    return pull + (target > speed ? motor : -motor);
  }
};

std::vector<Stretch> stretches_of(const Travel& travel, double speed) {
  constexpr std::size_t kMost = 100;
  std::vector<Stretch> all;
  Stretch now{0.0, 0.0, speed, 0.0};
  while (all.size() < kMost) {
    now.acceleration = travel.acceleration(now.speed);
    const double way = now.speed != 0.0 ? now.speed : now.acceleration;
    const bool held = now.speed == 0.0 && ((way < 0.0 && now.place <= travel.least) ||
                                           (way > 0.0 && now.place >= travel.most));
    if (held) now.acceleration = 0.0;
    all.push_back(now);
    if (held) break;
    const double a = now.acceleration;
    const double stop_below = time_to(travel.least - now.place, now.speed, a);
    const double stop_above = time_to(travel.most - now.place, now.speed, a);
    const double reach = travel.has_motor && a != 0.0 && (travel.target - now.speed) / a > 0.0
                             ? (travel.target - now.speed) / a
                             : std::numeric_limits<double>::infinity();
    const double t = std::min({stop_below, stop_above, reach});
    if (!std::isfinite(t)) break;
    now.from_s += t;
    now.place += now.speed * t + 0.5 * a * t * t;
    now.speed = t == reach ? travel.target : 0.0;
    if (t == stop_below) now.place = travel.least;
    if (t == stop_above) now.place = travel.most;
  }
  return all;
}

}  // namespace

MotionAt forced_flight(const StartingBody& body, const physics::BodyForces& forces,
                       const Vec3& gravity_m_s2) {
  const Quat& q = body.state.orientation;
  const Vec3 acceleration = gravity_m_s2 + body.params.own_field_m_s2 +
                            Vec3(q * forces.body_force_newton) / body.params.mass_kg;
  const Vec3 spin = body.state.angular_velocity_rad_s;
  const physics::Mat3 inertia =
      q.toRotationMatrix() * body.params.inertia_local_kg_m2 * q.toRotationMatrix().transpose();
  const Vec3 twist = inertia.inverse() * forces.torque_newton_m;
  const bool turns = spin != Vec3::Zero() || twist != Vec3::Zero();
  const Vec3 axis =
      !turns ? Vec3(Vec3::UnitZ()) : Vec3((spin != Vec3::Zero() ? spin : twist).normalized());
  const bool known =
      parallel(spin, axis) && parallel(twist, axis) && parallel(inertia * axis, axis);
  return [=](double t) {
    const Course linear = course(forces.linear_damping_1_s, t);
    const Course angular = course(forces.angular_damping_1_s, t);
    const Vec3 v = body.state.linear_velocity_m_s;
    Motion motion;
    motion.position_m = body.state.position_m + v * linear.speed_s + acceleration * linear.way_s2;
    motion.linear_velocity_m_s = v * linear.left + acceleration * linear.speed_s;
    if (!known) return motion;
    const double angle = axis.dot(spin) * angular.speed_s + axis.dot(twist) * angular.way_s2;
    motion.orientation = about(axis, angle) * body.state.orientation;
    motion.angular_velocity_rad_s = spin * angular.left + twist * angular.speed_s;
    return motion;
  };
}

namespace {

// y'' = -k/m y - 2 decay y'.
struct Oscillator {
  double decay_1_s = 0.0;
  double squared = 0.0;  // of the rate; < 0: creeps back
};
struct SwingState {
  double y = 0.0, v = 0.0;
};

SwingState after(const Oscillator& of, const SwingState& start, double t) {
  const auto [decay, squared] = of;
  const auto [y0, v0] = start;
  const double damped = std::exp(-decay * t);
  if (std::abs(squared) <= 1e-12 * decay * decay)
    return {damped * (y0 + (v0 + decay * y0) * t), damped * (v0 - decay * (v0 + decay * y0) * t)};
  if (squared > 0.0) {
    const double rate = std::sqrt(squared), b = (v0 + decay * y0) / rate;
    const double c = std::cos(rate * t), s = std::sin(rate * t);
    return {damped * (y0 * c + b * s),
            damped * ((b * rate - decay * y0) * c - (y0 * rate + decay * b) * s)};
  }
  const double root = std::sqrt(-squared), slow = -decay + root, fast = -decay - root;
  const double of_slow = (v0 - fast * y0) / (slow - fast), of_fast = y0 - of_slow;
  return {of_slow * std::exp(slow * t) + of_fast * std::exp(fast * t),
          of_slow * slow * std::exp(slow * t) + of_fast * fast * std::exp(fast * t)};
}

// From one end of a swing to the next, about the place where spring and friction are equal.
struct Swing {
  double from_s = 0.0, place = 0.0;
  SwingState start;
  bool rests = false;
};

// Of an oscillator that swings; `reach`: how far from its place friction can hold it.
std::vector<Swing> swings_of(const Oscillator& oscillator, SwingState now, double reach) {
  constexpr std::size_t kMost = 10'000;
  const double rate = std::sqrt(oscillator.squared), decay = oscillator.decay_1_s;
  std::vector<Swing> all;
  double from_s = 0.0;
  while (all.size() < kMost) {
    if (now.v == 0.0 && std::abs(now.y) <= reach) {
      all.push_back({from_s, now.y, {}, true});
      break;
    }
    const double way = now.v != 0.0 ? now.v : -now.y;
    const double place = way > 0.0 ? -reach : reach;
    const SwingState start{now.y - place, now.v};
    all.push_back({from_s, place, start, false});
    // v = 0: tan(rate t) = v0 rate / (decay v0 + (rate^2 + decay^2) y0)
    const double squared = rate * rate + decay * decay;
    double angle = std::numbers::pi;
    if (start.v != 0.0) angle = std::atan2(start.v * rate, decay * start.v + squared * start.y);
    if (angle <= 0.0) angle += std::numbers::pi;
    const double t = angle / rate;
    now = {place + after(oscillator, start, t).y, 0.0};
    from_s += t;
  }
  return all;
}

}  // namespace

MotionAt damped_oscillator(const StartingBody& body, const physics::Joint& spring,
                           const Vec3& gravity_m_s2, double friction) {
  const Vec3 anchor = spring.anchor_b_m;
  const Vec3 line = (body.state.position_m - anchor).normalized();
  const double mass = body.params.mass_kg, k = spring.stiffness_newton_m;
  const double rest = spring.length_m + mass * gravity_m_s2.dot(line) / k;
  const SwingState start{(body.state.position_m - anchor).norm() - rest,
                         body.state.linear_velocity_m_s.dot(line)};
  const double decay = 0.5 * spring.damping_newton_s_m / mass;
  const Oscillator oscillator{decay, k / mass - decay * decay};
  const std::vector<Swing> swings =
      friction > 0.0 ? swings_of(oscillator, start, friction * mass * gravity_m_s2.norm() / k)
                     : std::vector<Swing>{{0.0, 0.0, start, false}};
  return [=](double t) {
    const auto next = std::find_if(swings.begin() + 1, swings.end(),
                                   [t](const Swing& swing) { return swing.from_s > t; });
    const Swing& swing = next[-1];
    const SwingState now =
        swing.rests ? SwingState{} : after(oscillator, swing.start, t - swing.from_s);
    Motion motion;
    motion.position_m = anchor + line * (rest + swing.place + now.y);
    motion.linear_velocity_m_s = line * now.v;
    return motion;
  };
}

MotionAt steady_precession(const StartingBody& body, const physics::Joint& ball,
                           const Vec3& gravity_m_s2, double precession_rad_s) {
  const Vec3 point = ball.anchor_b_m, up = -gravity_m_s2.normalized();
  const Vec3 arm = body.state.position_m - point, axis = arm.normalized();
  const Vec3 spin = body.state.angular_velocity_rad_s;
  const double own = axis.dot(Vec3(spin - up * precession_rad_s));
  return [=](double t) {
    const Quat precessed = about(up, precession_rad_s * t);
    Motion motion;
    motion.position_m = point + precessed * arm;
    motion.angular_velocity_rad_s = Vec3(precessed * spin);
    motion.linear_velocity_m_s =
        motion.angular_velocity_rad_s->cross(Vec3(motion.position_m - point));
    motion.orientation = precessed * about(axis, own * t) * body.state.orientation;
    return motion;
  };
}

// A joint's limits and motor are the world's against the body.
MotionAt joint_travel(const StartingBody& body, const physics::Joint& joint,
                      const Vec3& gravity_m_s2) {
  const bool slides = joint.kind == physics::JointKind::kSlider;
  const Vec3 axis = joint.frame_b * Vec3(Vec3::UnitZ());
  const Vec3 point = joint.anchor_b_m, arm = body.state.position_m - point;
  const physics::Mat3 turn = body.state.orientation.toRotationMatrix();
  const double inertia =
      axis.dot(Vec3(turn * body.params.inertia_local_kg_m2 * turn.transpose() * axis)) +
      body.params.mass_kg * arm.cross(axis).squaredNorm();
  Travel travel;
  travel.pull = slides ? gravity_m_s2.dot(axis) : 0.0;
  if (joint.motor) {
    travel.has_motor = true;
    travel.motor = joint.motor->most_push / (slides ? body.params.mass_kg : inertia);
    travel.target = -joint.motor->speed;
  }
  if (joint.limits) {
    travel.least = -joint.limits->most;
    travel.most = -joint.limits->least;
  }
  const Vec3& moving = slides ? body.state.linear_velocity_m_s : body.state.angular_velocity_rad_s;
  const std::vector<Stretch> stretches = stretches_of(travel, moving.dot(axis));
  return [=](double time) {
    Stretch at = stretches.front();
    for (const Stretch& stretch : stretches)
      if (stretch.from_s <= time) at = stretch;
    const double t = time - at.from_s;
    const double place = at.place + at.speed * t + 0.5 * at.acceleration * t * t;
    const double speed = at.speed + at.acceleration * t;
    Motion motion;
    motion.orientation =
        slides ? body.state.orientation : about(axis, place) * body.state.orientation;
    motion.angular_velocity_rad_s = slides ? Vec3(Vec3::Zero()) : Vec3(axis * speed);
    motion.position_m = slides ? Vec3(body.state.position_m + axis * place)
                               : Vec3(point + about(axis, place) * arm);
    motion.linear_velocity_m_s =
        slides ? Vec3(axis * speed)
               : motion.angular_velocity_rad_s->cross(Vec3(motion.position_m - point));
    return motion;
  };
}

}  // namespace soda::analysis
