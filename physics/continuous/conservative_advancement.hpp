// Two solids in free flight: where they are, and how long they cannot touch.
#pragma once

#include "physics/continuous/angular_velocity_bounds.hpp"
#include "physics/model/body_state.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// One body of the pair at the moment that is looked at.
struct Flyer {
  Solid solid;                         // relative to the centre of a at that moment; or a part
  const CompiledShape& whole;          // of the body
  const BodyParams* params = nullptr;  // null: static, or a sphere, whose turning is not followed
  BodyState turning{};                 // orientation and angular velocity; of no use without params
  AngularVelocityBounds most{};        // see bound_turning()
  const CompiledPart* part = nullptr;  // of a compound, that the solid is
  Vec3 arm = Vec3::Zero();             // from the body's centre to the solid's

  bool turns() const { return params != nullptr; }
  // Of the body, which a part may be turned against. It turns.
  Mat3 rotation() const {
    return part ? turning.orientation.toRotationMatrix() : solid.placed.pose.rotation;
  }
  // In the solid's frame.
  Vec3 local_arm() const {
    return part ? part->pose.direction_to_local(part->pose.position) : Vec3(Vec3::Zero());
  }
  double radius_m() const { return whole.bounding_radius_m; }  // about the body's centre
};

// How long the bounding spheres of a and b (of a static: its box or plane) do not touch, from now
// on: at most dt_s. Exact for spheres.
double spheres_apart_s(const PairStep& pair);

// Moved from time to time: turning goes on from where it was, at a price that grows with the time.
class FlyingSolids {
 public:
  // As of the beginning. No meshes. Of compounds, the parts.
  explicit FlyingSolids(const PairStep& pair, PartPair parts = {});
  // The pair's body a, or a part of it, and a solid that stays where it is in the world: a triangle
  // of a mesh.
  FlyingSolids(const PairStep& pair, const Solid& fixed, std::uint32_t part_a);

  void go_to(double time_s);
  // Before the first of apart_s().
  void bound_turning();
  // How long from now the gap along a direction, that is given now, cannot fall below `floor_m`: to
  // 1e-4 of that time. The direction stays, turns with a or b or with the edges that are nearest:
  // what promises most.
  struct Wait {
    double time_s = 0.0;
    const Flyer* with = nullptr;    // the direction turns with it
    Vec3 drift_1_s = Vec3::Zero();  // or by this a second, without one
  };
  Wait apart_s(const Separation& now, double floor_m, double most_s) const;
  // Of the points within `touching_m` of the supporting planes, how fast the first of them come
  // nearer to the other solid.
  double approach_m_s(const Vec3& normal, double touching_m) const;

  const Flyer& a() const { return a_; }
  const Flyer& b() const { return b_; }
  bool is_static_b() const { return is_fixed_; }
  bool turns() const { return a_.turns() || b_.turns(); }
  const Vec3& relative_field_m_s2() const { return field_; }      // of b against a
  Vec3 velocity() const { return velocity_ + field_ * time_s_; }  // of b against a
  Vec3 centre_of_a_m() const;

 private:
  Wait apart_edges_s(const Separation& now, double floor_m, double least_s, double most_s) const;
  double apart_rotating_s(const Separation& now, double left_m, double most_s) const;
  double apart_turning_s(const Separation& now, bool with_a, double left_m, double least_s,
                         double most_s) const;

  bool is_fixed_, is_plane_;  // b
  Flyer a_, b_;
  Vec3 centre_, velocity_;  // of b against a, at the beginning
  Vec3 between_;            // the centre of b against that of a now
  Vec3 field_;
  Vec3 start_m_, start_velocity_, pull_;  // of a
  double time_s_ = 0.0;
};

}  // namespace soda::physics
