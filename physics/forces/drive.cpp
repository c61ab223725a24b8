#include "physics/forces/drive.hpp"

#include <cmath>

namespace soda::physics {
namespace {

// As seen along gravity.
Vec3 level(const Vec3& v, const Vec3& gravity) {
  const double squared = gravity.squaredNorm();
  if (squared == 0.0) return v;
  return v - gravity * (gravity.dot(v) / squared);
}

// Where a body stands beside a segment of a lane.
struct NearestSegment {
  Vec3 along = Vec3::Zero();  // unit direction of the segment
  Vec3 aside = Vec3::Zero();  // from the segment's nearest point to the body
};

// Where a way point is nearest, it is nearest of both its segments, to the bit: its offset is the
// same vector. The later one wins, so that who cuts no corner still turns.
NearestSegment nearest_segment(const Lane& lane, const Vec3& gravity, const Vec3& position) {
  NearestSegment nearest;
  double least = 0.0;
  const std::size_t segments = lane.way_points_m.size() - 1;
  Vec3 from_start = level(position - lane.way_points_m[0], gravity);
  for (std::size_t i = 0; i < segments; ++i) {
    const Vec3 from_end = level(position - lane.way_points_m[i + 1], gravity);
    const Vec3 along = level(lane.way_points_m[i + 1] - lane.way_points_m[i], gravity).normalized();
    const double distance = along.dot(from_start);
    Vec3 aside = from_start - along * distance;
    if (distance < 0.0 && i > 0) aside = from_start;
    if (along.dot(from_end) > 0.0 && i + 1 < segments) aside = from_end;
    const double squared = aside.squaredNorm();
    if (i == 0 || squared <= least) {
      nearest = {along, aside};
      least = squared;
    }
    from_start = from_end;
  }
  return nearest;
}

// Along the lane; outside it, turned towards it, by 45 degrees at half a width from its edge.
Vec3 lane_velocity(const Lane& lane, const Vec3& gravity, const Vec3& position) {
  const NearestSegment nearest = nearest_segment(lane, gravity, position);
  const double distance = nearest.aside.norm();
  const double outside = distance - lane.half_width_m;
  if (!(outside > 0.0)) return nearest.along * lane.speed_m_s;
  const Vec3 heading = nearest.along * lane.half_width_m - nearest.aside * (outside / distance);
  return heading * (lane.speed_m_s / heading.norm());
}

}  // namespace

Vec3 wanted_velocity(const Drive& drive, const Vec3& gravity_m_s2, const Vec3& position_m) {
  return drive.lane ? lane_velocity(*drive.lane, gravity_m_s2, position_m) : drive.velocity_m_s;
}

Vec3 drive_acceleration(const SceneDescription& scene, double dt_s, const Drive& drive,
                        const BodyState& state) {
  const Vec3 wanted = wanted_velocity(drive, scene.gravity_m_s2, state.position_m);
  const Vec3 missing = level(wanted - state.linear_velocity_m_s, scene.gravity_m_s2);
  Vec3 acceleration = missing * (1.0 / (drive.time_constant_s + dt_s));
  const double size = acceleration.norm();
  if (size <= drive.max_acceleration_m_s2) return acceleration;
  return acceleration * (drive.max_acceleration_m_s2 / size);
}

}  // namespace soda::physics
