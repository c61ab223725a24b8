#include "scenarios/kinematic.hpp"

#include <cmath>
#include <string>

#include "scenarios/cross_checks.hpp"
#include "scenarios/format.hpp"
#include "scenarios/format_limits.hpp"
#include "scenarios/orientation.hpp"

namespace soda::scenarios {
namespace {

// Of a sine of at most 0.2, by its series.
double arcsine(double sine) {
  constexpr int kTerms = 14;
  const double squared = sine * sine;
  double term = sine, sum = 0.0;
  for (int k = 0; k < kTerms; ++k) {
    sum += term / (2.0 * k + 1.0);
    term *= squared * (2.0 * k + 1.0) / (2.0 * k + 2.0);
  }
  return sum;
}

struct Placed {
  std::int64_t step = 0;
  Vec3 centre_m = Vec3::Zero();
  physics::Quat orientation = physics::Quat::Identity();
};

Placed placed(const WayPointSpec& point, const Vec3& center_m, const physics::Quat& turned,
              double time_step_s, FaultList& faults) {
  Placed out;
  out.step = whole_steps(point.time_s, time_step_s, *find_member(*point.json, "time_s"),
                         "a time at which a step begins", faults);
  out.orientation = located(point.orientation) ? orientation_of(point.orientation, faults) : turned;
  out.centre_m = point.position_m + out.orientation._transformVector(center_m);
  return out;
}

void check_start(const BodySpec& spec, const Placed& first, const physics::BodyState& start,
                 FaultList& faults) {
  const WayPointSpec& point = spec.path.front();
  if (first.step != 0)
    add_fault(faults, *find_member(*point.json, "time_s"),
              {"a path that starts at " + number_text(point.time_s) + " s",
               "0 as the time of the first way point", ""});
  if (point.position_m != spec.position_m)
    add_fault(faults, *find_member(*point.json, "position_m"),
              {"a path that starts elsewhere than its body",
               "the body's position_m at the first way point", ""});
  if (turn_between(start.orientation, first.orientation).norm() > 1e-9)
    add_fault(faults, *located(point.orientation),
              {"a path that starts with another orientation than its body",
               "the body's orientation at the first way point, or none", ""});
}

PathLeg leg_between(const Placed& from, const Placed& to, double time_step_s) {
  const double time_s = static_cast<double>(to.step - from.step) * time_step_s;
  return {from.step, (to.centre_m - from.centre_m) / time_s,
          turn_between(from.orientation, to.orientation) / time_s};
}

}  // namespace

Vec3 turn_between(const physics::Quat& from, const physics::Quat& to) {
  const physics::Quat turn = to * from.conjugate();
  const double sign = turn.w() < 0.0 ? -1.0 : 1.0;
  const Vec3 axis = sign * turn.vec();
  const double length = axis.norm();
  if (!(length > 0.0)) return Vec3::Zero();
  // Halved until the series is short.
  constexpr int kHalvings = 3;
  double cosine = sign * turn.w() / std::sqrt(turn.w() * turn.w() + length * length);
  double sine = length / std::sqrt(turn.w() * turn.w() + length * length);
  for (int i = 0; i < kHalvings; ++i) {
    cosine = std::sqrt(0.5 * (1.0 + cosine));
    sine *= 0.5 / cosine;
  }
  return axis * (2.0 * (1 << kHalvings) * arcsine(sine) / length);
}

void check_kinematic(const BodySpec& spec, FaultList& faults) {
  if (!spec.json) return;
  const bool weighed = spec.mass_kg || spec.density_kg_m3;
  if (!spec.kinematic) {
    if (find_member(*spec.json, "kinematic") && !weighed)
      add_fault(faults, *spec.json,
                {"neither mass_kg nor density_kg_m3", "either mass_kg or density_kg_m3", ""});
    if (const JsonValue* const path = find_member(*spec.json, "path"))
      add_fault(faults, *path,
                {"a path of a body that is not kinematic", "\"kinematic\": true, or no path", ""});
    return;
  }
  for (const char* const key :
       {"mass_kg", "density_kg_m3", "principal_inertia_kg_m2", "drive", "force_newton",
        "body_force_newton", "torque_newton_m", "linear_damping_1_s", "angular_damping_1_s"})
    if (const JsonValue* const member = find_member(*spec.json, key))
      add_fault(faults, *member,
                {"the key \"" + std::string(key) + "\" of a kinematic body",
                 "no mass, drive, force or damping where velocities alone move a body", ""});
  if (spec.path.empty()) return;
  for (const char* const key : {"velocity_m_s", "angular_velocity_rad_s"})
    if (const JsonValue* const member = find_member(*spec.json, key))
      add_fault(faults, *member,
                {"a velocity of a body with a path", "either a path or velocities", ""});
  if (!spec.present)
    add_fault(faults, *find_member(*spec.json, "present"),
              {"a path of a body that is not there", "a body that is there from the start", ""});
}

std::vector<PathLeg> legs_of(const BodySpec& spec, const Vec3& center_m,
                             const physics::BodyState& start, double time_step_s,
                             FaultList& faults) {
  std::vector<PathLeg> legs;
  if (!spec.kinematic || spec.path.empty()) return legs;
  const std::size_t before = faults.size();
  std::vector<Placed> places;
  for (const WayPointSpec& point : spec.path) {
    if (!point.sound) return {};
    const physics::Quat turned = places.empty() ? start.orientation : places.back().orientation;
    places.push_back(placed(point, center_m, turned, time_step_s, faults));
    if (places.size() > 1 && places.back().step <= places[places.size() - 2].step)
      add_fault(faults, *find_member(*point.json, "time_s"),
                {number_text(point.time_s) + " s after a way point that is not earlier",
                 "times that ascend by a step or more", ""});
  }
  check_start(spec, places.front(), start, faults);
  if (faults.size() > before) return {};
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    legs.push_back(leg_between(places[i], places[i + 1], time_step_s));
    const PathLeg& leg = legs.back();
    const double most =
        std::max(leg.linear_m_s.cwiseAbs().maxCoeff(), leg.angular_rad_s.cwiseAbs().maxCoeff());
    if (most > kSpeed.max)
      add_fault(faults, *spec.path[i + 1].json,
                {"a way at " + number_text(most) + " m/s or rad/s", "at most 1e6 of either", ""});
  }
  legs.push_back({places.back().step, Vec3::Zero(), Vec3::Zero()});
  return legs;
}

}  // namespace soda::scenarios
