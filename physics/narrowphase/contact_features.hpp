// From a contact axis to contact points: supporting features, clipping, reduction to four points.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "physics/model/contact_manifold.hpp"
#include "physics/shapes/compiled_shape.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// A shape where its pair is examined. All coordinates of a pair are relative to the centre of its
// first body, so that distance from the world origin costs no precision.
struct PlacedShape {
  const CompiledShape& shape;
  Pose pose;
};

inline Vec3 support_point(const PlacedShape& s, const Vec3& direction) {
  return s.pose.to_world(support(s.shape, s.pose.direction_to_local(direction)));
}

// Gap between the supporting planes along a unit normal that points from a to b; < 0: overlap.
double separation_along(const PlacedShape& a, const PlacedShape& b, const Vec3& normal);

inline constexpr int kMaxFeaturePoints = 32;  // larger hull faces are thinned out to this

// What a shape shows to a direction: one point, a segment, or a convex polygon (counter-clockwise
// seen from outside).
struct SupportFeature {
  std::array<Vec3, kMaxFeaturePoints> points;
  int count = 0;
  std::uint32_t code = 0;      // which feature of its shape, below 2^7 where shapes are small
  Vec3 normal = Vec3::Zero();  // outward normal of a polygon; zero otherwise
};
SupportFeature support_feature(const PlacedShape& s, const Vec3& direction);
// Of a hull: the face through which the ray from its centre of mass in this direction leads out.
// What it would stand on; a face that is steeper may support better, but the hull tips over it.
SupportFeature face_ahead(const PlacedShape& hull, const Vec3& direction);

// Relative motion of a pair during the step: decides how far apart contacts still matter.
struct PairMotion {
  Vec3 velocity_a = Vec3::Zero(), angular_velocity_a = Vec3::Zero();
  Vec3 velocity_b = Vec3::Zero(), angular_velocity_b = Vec3::Zero();
  Vec3 pulled_m_s = Vec3::Zero();  // of velocity_a, what fields add within dt_s
  Vec3 center_b = Vec3::Zero();    // a's is the origin
  // Of parts of compounds: from the centres of the bodies to those of the solids.
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();
  double dt_s = 0.0;
  double margin_m = 0.0;    // contacts within it are kept even when not closing
  double range_m = 0.0;     // no contact farther apart can be reached in this step
  double rotation_m = 0.0;  // of it, what rotations can close that show other features

  // Velocity of b relative to a at a point.
  Vec3 relative_velocity(const Vec3& point) const {
    return velocity_b + angular_velocity_b.cross(point - center_b) - velocity_a -
           angular_velocity_a.cross(point);
  }
  // Of the centre of b's solid relative to that of a's.
  Vec3 centres_velocity() const {
    Vec3 bodies = velocity_b - velocity_a;
    if (!is_off_centre()) return bodies;
    return bodies + angular_velocity_b.cross(arm_b) - angular_velocity_a.cross(arm_a);
  }
  bool is_off_centre() const { return arm_a != Vec3::Zero() || arm_b != Vec3::Zero(); }
  bool reaches(const Vec3& point, const Vec3& normal, double separation) const;
};

// Candidate points of one manifold. Beyond the capacity points are dropped.
struct ContactCandidates {
  // In a union, so that only those in use are written: there is one of these for each pair.
  union {
    std::array<ContactPoint, 2 * kMaxFeaturePoints> points;
  };
  int count = 0;

  ContactCandidates() {}  // NOLINT(modernize-use-equals-default): of a union it would be deleted
  ContactCandidates(const ContactCandidates&) = delete;
  ContactCandidates& operator=(const ContactCandidates& other) {
    count = other.count;
    std::copy_n(other.points.begin(), count, points.begin());
    return *this;
  }

  void add(const Vec3& position, double separation, std::uint32_t feature) {
    if (count < static_cast<int>(points.size())) points[count++] = {position, separation, feature};
  }
};

// Clips `incident` (segment or polygon) to the prism over the polygon `reference`. Positions are
// midway between the surfaces, separations along the reference's normal.
void clip_to_reference(const SupportFeature& reference, const SupportFeature& incident,
                       ContactCandidates& out);
// Whether the feature is a polygon whose normal is the direction, but for rounding.
bool is_along(const SupportFeature& feature, const Vec3& direction);
// Whether it is a polygon that meets the direction steeply: what touches an edge of it, along a
// direction that is not quite its normal, is over it with the whole of its feature.
bool is_over(const SupportFeature& feature, const Vec3& direction);
// Clips what is over the reference, with separations along the direction; `nearest_m` is the least.
void clip_over(const SupportFeature& reference, const SupportFeature& incident,
               const Vec3& direction, double nearest_m, ContactCandidates& out);

// The stretch along which two nearly parallel segments face each other; nothing if they are not
// parallel, or not both segments.
void overlap_segments(const SupportFeature& a, const SupportFeature& b, const Vec3& normal,
                      ContactCandidates& out);

// Drops the points that the motion cannot bring to touch within the step.
void keep_reached(const PairMotion& motion, const Vec3& normal, ContactCandidates& candidates);

// Keeps four points of large area including the deepest, sorts them and appends the pair's manifold
// in world coordinates (`origin_m` is the centre of body a when they touch). Nothing if there is no
// point, or anything is not finite.
void emit_manifold(const PairStep& pair, std::uint32_t part, const Vec3& normal,
                   const Vec3& origin_m, ContactCandidates& candidates,
                   std::vector<ContactManifold>& out);

}  // namespace soda::physics
