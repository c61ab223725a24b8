#include "physics/measures/refinement_error.hpp"

#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

double relative_error_of(const BodySizes& sizes, std::size_t body, const BodyDifference& d) {
  const double radius = sizes.bodies[body].radius_m;
  return (d.place_m.norm() + radius * d.rotation_rad.norm() +
          sizes.dt_s * (d.velocity_m_s.norm() + radius * d.angular_velocity_rad_s.norm())) /
         sizes.bodies[body].width_m;
}

// The largest of all bodies; `difference` gives that of one.
template <class OfBody>
StepError largest(const BodySizes& sizes, std::size_t bodies, const OfBody& difference) {
  StepError most;
  for (std::size_t i = 0; i < bodies; ++i) {
    const double relative_error = relative_error_of(sizes, i, difference(i));
    if (relative_error > most.relative_error) most = {relative_error, i};
  }
  return most;
}

}  // namespace

BodySizes sizes_of(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids) {
  BodySizes sizes;
  sizes.dt_s = scene.dt_s;
  sizes.bodies.reserve(ids.size());
  for (const BodyId id : ids) {
    const CompiledShape& shape = shape_of(scene, geometry, id);
    sizes.bodies.push_back({shape.bounding_radius_m, shape.min_extent_m});
  }
  return sizes;
}

StepError larger(const StepError& a, const StepError& b) {
  return b.relative_error > a.relative_error ? b : a;
}

StepError change_of(const BodySizes& sizes, std::span<const BodyState> from,
                    std::span<const BodyState> to) {
  return largest(sizes, from.size(), [&](std::size_t i) {
    return BodyDifference{Vec3::Zero(), Vec3::Zero(),
                          to[i].linear_velocity_m_s - from[i].linear_velocity_m_s,
                          to[i].angular_velocity_rad_s - from[i].angular_velocity_rad_s};
  });
}

StepError displacement_of(const BodySizes& sizes, std::span<const BodyState> from,
                          std::span<const BodyState> to, double time_s) {
  return largest(sizes, from.size(), [&](std::size_t i) {
    const Vec3 displacement = to[i].position_m - from[i].position_m;
    return BodyDifference{displacement - to[i].linear_velocity_m_s * time_s, Vec3::Zero(),
                          Vec3::Zero(), Vec3::Zero()};
  });
}

StepError speed_of(const BodySizes& sizes, std::span<const BodyState> states) {
  return largest(sizes, states.size(), [&](std::size_t i) {
    return BodyDifference{Vec3::Zero(), Vec3::Zero(), states[i].linear_velocity_m_s,
                          states[i].angular_velocity_rad_s};
  });
}

BodyDifference difference_of(const BodyState& from, const BodyState& to) {
  const Quat rotation = to.orientation * from.orientation.conjugate();
  return {to.position_m - from.position_m,
          2.0 * (rotation.w() < 0.0 ? Vec3(-rotation.vec()) : Vec3(rotation.vec())),
          to.linear_velocity_m_s - from.linear_velocity_m_s,
          to.angular_velocity_rad_s - from.angular_velocity_rad_s};
}

StepError apart_of(const BodySizes& sizes, std::span<const BodyState> from,
                   std::span<const BodyState> to) {
  return largest(sizes, from.size(), [&](std::size_t i) { return difference_of(from[i], to[i]); });
}

StepError largest_of(const BodySizes& sizes, std::span<const BodyDifference> differences) {
  return largest(sizes, differences.size(), [&](std::size_t i) { return differences[i]; });
}

StepError apart_of(const BodySizes& sizes, std::span<const BodyDifference> a,
                   std::span<const BodyDifference> b) {
  return largest(sizes, a.size(), [&](std::size_t i) {
    return BodyDifference{b[i].place_m - a[i].place_m, b[i].rotation_rad - a[i].rotation_rad,
                          b[i].velocity_m_s - a[i].velocity_m_s,
                          b[i].angular_velocity_rad_s - a[i].angular_velocity_rad_s};
  });
}

StepError roughness_indicator(const BodySizes& sizes, std::span<const BodyState> from,
                              const VelocityPath& one, const VelocityPath& two,
                              const VelocityPath& four, double time_s) {
  const std::size_t n = from.size();
  // Free of the first and second power of the step's length; a jump shows in full.
  const auto first = [](const Vec3& start, const Vec3& a, const Vec3& b, const Vec3& c) -> Vec3 {
    return (8.0 * (c - start) - 6.0 * (b - start) + (a - start)) * (1.0 / 3.0);
  };
  const auto later = [&four, n](std::size_t i, Vec3 BodyVelocity::*part) -> Vec3 {
    return four[3 * n + i].*part - four[i].*part +
           3.0 * (four[n + i].*part - four[2 * n + i].*part);
  };
  const StepError at_first = largest(sizes, n, [&](std::size_t i) {
    return BodyDifference{
        Vec3::Zero(), Vec3::Zero(),
        first(from[i].linear_velocity_m_s, one[i].linear, two[i].linear, four[i].linear),
        first(from[i].angular_velocity_rad_s, one[i].angular, two[i].angular, four[i].angular)};
  });
  const StepError at_last = largest(sizes, n, [&](std::size_t i) {
    return BodyDifference{Vec3::Zero(), Vec3::Zero(), later(i, &BodyVelocity::linear),
                          later(i, &BodyVelocity::angular)};
  });
  StepError most = larger(at_first, at_last);
  most.relative_error *= 0.25 * time_s / sizes.dt_s;
  return most;
}

StepError unsteadiness_indicator(const BodySizes& sizes, std::span<const BodyState> from,
                                 std::span<const BodyState> after_one,
                                 std::span<const BodyState> after_two, const VelocityPath& two,
                                 double time_s) {
  return largest(sizes, from.size(), [&](std::size_t i) {
    const BodyState &start = from[i], &one = after_one[i], &end = after_two[i];
    BodyDifference off = difference_of(one, end);
    off.place_m -= (0.5 * time_s) * (two[i].linear - end.linear_velocity_m_s);
    off.rotation_rad -= (0.5 * time_s) * (two[i].angular - end.angular_velocity_rad_s);
    const Vec3 bend = start.linear_velocity_m_s - 2.0 * two[i].linear + end.linear_velocity_m_s;
    const Vec3 twist =
        start.angular_velocity_rad_s - 2.0 * two[i].angular + end.angular_velocity_rad_s;
    off.velocity_m_s = off.velocity_m_s.cwiseAbs() + bend.cwiseAbs();
    off.angular_velocity_rad_s = off.angular_velocity_rad_s.cwiseAbs() + twist.cwiseAbs();
    return off;
  });
}

StepError bend_indicator(const BodySizes& sizes, std::span<const BodyState> from,
                         const VelocityPath& two) {
  const std::size_t n = from.size();
  return largest(sizes, n, [&](std::size_t i) {
    return BodyDifference{
        Vec3::Zero(), Vec3::Zero(),
        from[i].linear_velocity_m_s - 2.0 * two[i].linear + two[n + i].linear,
        from[i].angular_velocity_rad_s - 2.0 * two[i].angular + two[n + i].angular};
  });
}

double share_before_bend(const BodySizes& sizes, std::span<const BodyState> before, double past_s,
                         std::span<const BodyState> from, const VelocityPath& two, double time_s) {
  if (!(past_s > 0.0)) return 0.5;
  struct Lines {
    double along, squared;  // what parts them at the start, along their change of slope
  };
  const auto lines = [&](const Vec3& past, const Vec3& start, const Vec3& half, const Vec3& end) {
    const Vec3 first = (start - past) * (time_s / past_s);  // changes over time_s
    const Vec3 second = 2.0 * (end - half), change = second - first;
    return Lines{(start - (end - second)).dot(change), change.squaredNorm()};
  };
  const BodyState &past = before.front(), &start = from.front();
  const Lines linear =
      lines(past.linear_velocity_m_s, start.linear_velocity_m_s, two[0].linear, two[1].linear);
  const Lines angular = lines(past.angular_velocity_rad_s, start.angular_velocity_rad_s,
                              two[0].angular, two[1].angular);
  const double radius = sizes.bodies.front().radius_m, scale = radius * radius;
  const double share =
      (linear.along + scale * angular.along) / (linear.squared + scale * angular.squared);
  return share > 0.0 && share < 0.5 ? share : 0.5;
}

}  // namespace soda::physics
