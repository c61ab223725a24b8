#include "scenarios/orientation.hpp"

#include <cmath>

namespace soda::scenarios {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295769;

// Taylor series. For |x| <= pi/4 the first terms left out are x^19/19! < 1e-19 and
// x^18/18! < 3e-18, below half an ulp of the result.
double sine_near_zero(double x) {
  const double y = x * x;
  double sum = 0.0;
  for (int n = 17; n >= 3; n -= 2) sum = (1.0 + sum) * (-y / ((n - 1.0) * n));
  return x + x * sum;
}

double cosine_near_zero(double x) {
  const double y = x * x;
  double sum = 0.0;
  for (int n = 16; n >= 2; n -= 2) sum = (1.0 + sum) * (-y / ((n - 1.0) * n));
  return 1.0 + sum;
}

double norm_of(double a, double b, double c, double d) {
  return std::sqrt(a * a + b * b + c * c + d * d);
}

physics::Quat scaled(double w, double x, double y, double z, double norm) {
  return physics::Quat(w / norm, x / norm, y / norm, z / norm);
}

physics::Quat from_quaternion(const QuaternionSpec& q, FaultList& faults) {
  const double norm = norm_of(q.w, q.x, q.y, q.z);
  if (std::abs(norm - 1.0) <= 1e-3) return scaled(q.w, q.x, q.y, q.z, norm);
  add_fault(faults, *q.json,
            {"a quaternion of norm " + number_text(norm),
             "a unit quaternion (norm within 0.001 of 1)", ""});
  return physics::Quat::Identity();
}

physics::Quat from_axis_angle(const AxisAngleSpec& rotation, FaultList& faults) {
  const Vec3& a = rotation.axis;
  const double norm = norm_of(a.x(), a.y(), a.z(), 0.0);
  if (norm < 1e-6) {
    add_fault(faults, *find_member(*rotation.json, "axis"),
              {"an axis of length " + number_text(norm), "an axis of length at least 1e-6", ""});
    return physics::Quat::Identity();
  }
  const SineCosine half = sine_cosine_of_degrees(0.5 * rotation.angle_deg);
  const double s = half.sine / norm;
  const double w = half.cosine, x = s * a.x(), y = s * a.y(), z = s * a.z();
  return scaled(w, x, y, z, norm_of(w, x, y, z));
}

}  // namespace

SineCosine sine_cosine_of_degrees(double angle_deg) {
  // Both steps are exact: fmod by definition, and the difference because it has no more digits
  // than its larger operand.
  const double turn = std::fmod(angle_deg, 360.0);
  const int quarter = static_cast<int>(std::floor(turn / 90.0 + 0.5));
  const double rest = (turn - 90.0 * quarter) * kRadiansPerDegree;
  const double s = sine_near_zero(rest), c = cosine_near_zero(rest);
  switch (((quarter % 4) + 4) % 4) {
    case 0:
      return {s, c};
    case 1:
      return {c, 0.0 - s};
    case 2:
      return {0.0 - s, 0.0 - c};
    default:
      return {0.0 - c, s};
  }
}

const JsonValue* located(const OrientationSpec& spec) {
  return std::visit([](const auto& s) { return s.json; }, spec);
}

physics::Quat orientation_of(const OrientationSpec& spec, FaultList& faults) {
  if (const auto* q = std::get_if<QuaternionSpec>(&spec)) {
    const bool given = q->json != nullptr;
    return given && q->sound ? from_quaternion(*q, faults) : physics::Quat::Identity();
  }
  const AxisAngleSpec& rotation = std::get<AxisAngleSpec>(spec);
  return rotation.sound ? from_axis_angle(rotation, faults) : physics::Quat::Identity();
}

}  // namespace soda::scenarios
