#include "physics/narrowphase/seams.hpp"

#include <algorithm>
#include <cmath>

namespace soda::physics {
namespace {

constexpr double kStep = 2e-3;     // of the smaller width
constexpr double kNearer = 1e-11;  // of it: what comes nearer by less does not

struct SeamTest {
  const PlacedShape &a, &b;
  const Vec3& towards;  // the direction from a to b in which they come nearer, there
  const Vec3& point;
  const PairMotion& motion;
  const Vec3& sunk_m;
  double width_m;

  // How much nearer they come along a direction, at a point, without fields.
  double nearer_m(const Vec3& normal, const Vec3& at) const {
    return -normal.dot(motion.relative_velocity(at) + motion.pulled_m_s) * motion.dt_s;
  }

  // Whether a solid shows a curved surface to a plane, which is the same when it turns.
  static bool is_curved(const PlacedShape& solid, const Vec3& normal) {
    constexpr double kOnItsSide = 0.05;
    const ShapeKind kind = solid.shape.kind;
    if (kind == ShapeKind::kCylinder)
      return std::abs(normal.dot(solid.pose.rotation.col(2))) < kOnItsSide;
    return kind == ShapeKind::kSphere || kind == ShapeKind::kCapsule;
  }

  // How far its turning takes points of a flat solid along a direction.
  double turned_m(const PlacedShape& solid, const Vec3& velocity_rad_s, const Vec3& normal) const {
    if (is_curved(solid, normal)) return 0.0;
    return velocity_rad_s.cross(normal).norm() * solid.shape.bounding_radius_m * motion.dt_s;
  }

  // Whether they come nearer along the face's normal, by more than a small part of what they come
  // nearer on their way to the edge.
  bool come_nearer(const PlacedShape& other, const Vec3& outward, const Vec3& normal) const {
    constexpr double kOfWay = 0.1;
    const double most_m = std::min(kStep * width_m, kOfWay * nearer_m(towards, point));
    return turned_m(a, motion.angular_velocity_a, normal) > most_m ||
           turned_m(b, motion.angular_velocity_b, normal) > most_m ||
           nearer_m(normal, support_point(other, -outward)) > most_m;
  }

  // `normal`: of a face of `of`, from a to b; `other` is the other solid.
  bool keeps_apart(const PlacedShape& of, const PlacedShape& other, const Vec3& outward,
                   double sign) const {
    const Vec3 normal = outward * sign;
    // Between flat solids, directions that are near are two views of one contact.
    constexpr double kFlat = 0.5, kCurved = 1.0 - 1e-9;
    if (normal.dot(towards) > (is_curved(other, normal) ? kCurved : kFlat)) return false;
    const double gap = separation_along(a, b, normal) - std::min(normal.dot(sunk_m), 0.0);
    if (gap < -kStep * width_m || come_nearer(other, outward, normal)) return false;
    const SupportFeature face = support_feature(of, outward);
    if (face.count < 3) return false;
    return !is_over(face, support_feature(other, -outward), towards * sign);
  }

  // By more than touching: what has just come there is as far back as clipping is inexact.
  bool is_over(const SupportFeature& face, SupportFeature other, const Vec3& back) const {
    constexpr double kOfFace = 1e-6, kOfWidth = 1e-6;
    const double size = (face.points[0] - face.points[face.count / 2]).norm();
    for (int i = 0; i < other.count; ++i)
      other.points[i] += back * (kOfFace * size + kOfWidth * width_m);
    ContactCandidates over;
    clip_to_reference(face, other, over);
    return over.count > 0;
  }

  bool any_of(const PlacedShape& of, const PlacedShape& other, double sign) const {
    return std::ranges::any_of(of.shape.face_planes, [&](const FacePlane& face) {
      const Vec3 outward = of.pose.rotation * face.normal;
      return keeps_apart(of, other, outward, sign);
    });
  }
};

}  // namespace

bool slides_past(const PlacedShape& a, const PlacedShape& b, const Vec3& normal, const Vec3& point,
                 const PairMotion& motion, const Vec3& sunk_m) {
  if (b.shape.kind == ShapeKind::kHalfSpace) return false;
  // Triangles of meshes have no width.
  const double of_a = a.shape.min_extent_m, of_b = b.shape.min_extent_m;
  const double width_m = of_b > 0.0 ? std::min(of_a, of_b) : of_a;
  const SeamTest test{a, b, normal, point, motion, sunk_m, width_m};
  if (!(test.nearer_m(normal, point) > kNearer * test.width_m)) return false;
  return test.any_of(a, b, 1.0) || test.any_of(b, a, -1.0);
}

}  // namespace soda::physics
