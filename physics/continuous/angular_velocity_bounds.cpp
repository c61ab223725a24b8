#include "physics/continuous/angular_velocity_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

bool has_principal_axes(const Mat3& inertia) {
  return inertia(0, 1) == 0.0 && inertia(0, 2) == 0.0 && inertia(1, 2) == 0.0;
}

struct Squares {
  Vec3 component = Vec3::Zero();  // of the angular velocity, about each principal axis
  double all = 0.0;
};

// Energy and angular momentum stay, and both are linear in the squares of the angular velocity
// about the principal axes; so these are largest where one of the three vanishes.
Squares most_squares(const Mat3& inertia, const Vec3& angular_velocity_local) {
  constexpr double kRounding = 1.01;
  constexpr double kEqual = 1e-9;  // moments: what follows from their difference is lost
  const Vec3 momentum = times(inertia, angular_velocity_local);
  const double energy = momentum.dot(angular_velocity_local);  // twice
  const double squared = momentum.squaredNorm(),
               least = -1e-3 * angular_velocity_local.squaredNorm();
  Squares most{angular_velocity_local.cwiseAbs2(), angular_velocity_local.squaredNorm()};
  bool differ = false;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int low = inertia(i, i) < inertia(j, j) ? i : j, high = low == i ? j : i;
    const double small = inertia(low, low), large = inertia(high, high);
    if (!(large - small > kEqual * large)) continue;
    differ = true;
    const double about_low = (energy * large - squared) / (small * (large - small));
    const double about_high = (squared - energy * small) / (large * (large - small));
    if (!(about_low >= least) || !(about_high >= least)) continue;
    most.component[low] = std::max(most.component[low], about_low);
    most.component[high] = std::max(most.component[high], about_high);
    most.all = std::max(most.all, about_low + about_high);
  }
  if (!differ) most.component.setConstant(most.all);
  return {kRounding * most.component, kRounding * most.all};
}

// The size of a product v x r, if their components are at most as large as these.
double most_product(const Vec3& v, const Vec3& r) {
  return Vec3(v[1] * r[2] + v[2] * r[1], v[2] * r[0] + v[0] * r[2], v[0] * r[1] + v[1] * r[0])
      .norm();
}

// A point at r from the centre has the velocity w x r and the acceleration w x (w x r) + dw/dt x r.
AngularVelocityBounds bounds(double radius_m, double angular_speed_rad_s, double change_rad_s2) {
  return {angular_speed_rad_s,
          change_rad_s2,
          angular_speed_rad_s * angular_speed_rad_s + change_rad_s2,
          angular_speed_rad_s * radius_m,
          0.0,
          change_rad_s2 * radius_m};
}

// Component by component: a rod that rotates fast about its length moves its ends little.
AngularVelocityBounds bounds_by_axes(const Mat3& inertia, const CompiledShape& shape,
                                     const Vec3& angular_velocity_local) {
  const Squares most = most_squares(inertia, angular_velocity_local);
  const Vec3 angular_velocity = most.component.cwiseSqrt();
  Vec3 change;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    change[i] = std::abs(inertia(j, j) - inertia(k, k)) / inertia(i, i) * angular_velocity[j] *
                angular_velocity[k];
  }
  AngularVelocityBounds found = bounds(shape.bounding_radius_m, std::sqrt(most.all), change.norm());
  found.speed_m_s = std::min(found.speed_m_s, most_product(angular_velocity, shape.reach_m));
  found.change_m_s2 = std::min(found.change_m_s2, most_product(change, shape.reach_m));
  return found;
}

// The axis goes round at |angular momentum| / (moment across it).
int fast_axis(const Mat3& inertia, const Vec3& angular_velocity_local, double radius_m,
              const AngularVelocityBounds& most) {
  constexpr double kMuchLess = 0.25;
  const int axis = symmetry_axis(inertia);
  if (axis < 0) return -1;
  const double across = inertia((axis + 1) % 3, (axis + 1) % 3);
  const double round_1_s2 =
      times(inertia, angular_velocity_local).squaredNorm() / (across * across);
  return round_1_s2 * radius_m < kMuchLess * most.pull_m_s2 ? axis : -1;
}

}  // namespace

AngularVelocityBounds angular_velocity_bounds(const BodyParams& params, const CompiledShape& shape,
                                              const Mat3& rotation,
                                              const Vec3& angular_velocity_rad_s) {
  const Mat3& inertia = params.inertia_local_kg_m2;
  const Vec3 local = rotation.transpose() * angular_velocity_rad_s;
  AngularVelocityBounds found;
  if (is_isotropic(inertia)) {
    found = bounds(shape.bounding_radius_m, angular_velocity_rad_s.norm(), 0.0);
  } else if (has_principal_axes(inertia)) {
    found = bounds_by_axes(inertia, shape, local);
  } else {
    // As no moment is larger than the sum of the others, |dw/dt| is at most |w|^2 / sqrt(3).
    const double squared = times(inertia, local).dot(local) * params.inverse_inertia_local.norm();
    found = bounds(shape.bounding_radius_m, std::sqrt(squared), 0.6 * squared);
  }
  found.pull_m_s2 = found.angular_speed_rad_s * found.speed_m_s + found.change_m_s2;
  found.fast_axis = fast_axis(params.inertia_local_kg_m2, local, shape.bounding_radius_m, found);
  return found;
}

}  // namespace soda::physics
