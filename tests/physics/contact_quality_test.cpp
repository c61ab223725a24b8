#include "physics/measures/contact_quality.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

// One point under a body of 2 kg on a floor, friction .5, with an impulse and a velocity that a
// test makes up. A spherical body, so that the point's velocity is the body's.
struct OnePoint {
  test::World world = test::under_gravity();
  std::vector<BodyState> before, after;
  ContactManifold manifold;

  OnePoint(const Vec3& velocity, double push_newton_s, const Vec3& friction_on_body_newton_s,
           double separation_m = 0.0) {
    world.add_floor(Material{0.5, 0.0});
    world.add_body(world.add_shape(Sphere{0.5}), Vec3(0, 0, 0.5), 1000.0, Material{0.5, 0.0});
    world.scene.bodies[0].mass_kg = 2.0;
    manifold.a = BodyId{0};
    manifold.b = static_id(0);
    manifold.normal = -Vec3::UnitZ();
    manifold.count = 1;
    manifold.points[0].separation_m = separation_m;
    before = after = world.states;
    after[0].linear_velocity_m_s = velocity;
    // Stored on the pair's second body, the floor.
    after[0].impulses = {{static_id(0), 0, 0, push_newton_s, -friction_on_body_newton_s}};
  }
  ContactResiduals measured(std::span<const ContactManifold> besides = {}) {
    std::vector<ContactManifold> manifolds{manifold};
    manifolds.insert(manifolds.end(), besides.begin(), besides.end());
    ContactQuality quality;
    add_contacts(world.scene, manifolds, before, after, quality);
    return quality.largest;
  }
};

TEST(ContactQuality, FindsNothingWrongWithRestRollingAndSliding) {
  for (OnePoint point : {OnePoint(Vec3::Zero(), 3.0, Vec3(1.0, 0.5, 0)),
                         OnePoint(Vec3(2.0, 0, 0), 3.0, Vec3(-1.5, 0, 0)),
                         OnePoint(Vec3(0, 0, -0.06), 0.0, Vec3::Zero(), 0.001)}) {
    const ContactResiduals r = point.measured();
    EXPECT_LT(r.signorini_m_s, 1e-15);
    EXPECT_LT(r.complementarity_m_s, 1e-15);
    EXPECT_LT(r.cone_m_s, 1e-15);
    EXPECT_LT(r.dissipation_m_s, 1e-15);
  }
}

// `soda accuracy` ended with a signal here: a joint with the world is none with a static.
TEST(ContactQuality, LeavesJointsOut) {
  OnePoint point(Vec3(2.0, 0, 0), 3.0, Vec3::Zero());
  Joint spring;
  spring.a = BodyId{0};
  spring.kind = JointKind::kSpring;
  spring.length_m = spring.stiffness_newton_m = 1.0;
  point.world.scene.joints = {spring};
  order_joints(point.world.scene);
  std::vector<ContactManifold> joints;
  append_world_joints(point.world.scene, std::array{BodyId{0}}, std::array{BodyState{}}, joints);
  ASSERT_EQ(joints.size(), 1u);
  EXPECT_EQ(point.measured(joints).dissipation_m_s, point.measured().dissipation_m_s);
}

TEST(ContactQuality, TellsEachLawByTheSizeOfItsViolation) {
  EXPECT_NEAR(OnePoint(Vec3(0, 0, -0.1), 3.0, Vec3::Zero()).measured().signorini_m_s, 0.1, 1e-15);
  // The gap of 1 mm may close in the step, not more.
  EXPECT_NEAR(OnePoint(Vec3(0, 0, -0.1), 0.0, Vec3::Zero(), 0.001).measured().signorini_m_s,
              0.1 - 0.06, 1e-15);
  EXPECT_NEAR(OnePoint(Vec3::Zero(), -1.0, Vec3::Zero()).measured().signorini_m_s, 0.5, 1e-15);
  EXPECT_NEAR(OnePoint(Vec3(0, 0, 0.2), 3.0, Vec3::Zero()).measured().complementarity_m_s, 0.2,
              1e-15);
  EXPECT_NEAR(OnePoint(Vec3::Zero(), 3.0, Vec3(1.8, 0, 0)).measured().cone_m_s, 0.15, 1e-15);
  // Friction across the sliding takes nothing from it; half of what it could, leaves half.
  EXPECT_NEAR(OnePoint(Vec3(2, 0, 0), 3.0, Vec3(0, 1.5, 0)).measured().dissipation_m_s, 2.0, 1e-15);
  EXPECT_NEAR(OnePoint(Vec3(2, 0, 0), 3.0, Vec3(-0.75, 0, 0)).measured().dissipation_m_s, 1.0,
              1e-15);
}

TEST(ContactQuality, LeavesBouncingPairsOutForTheyFollowAnotherLaw) {
  OnePoint point(Vec3(0, 0, 0.2), 3.0, Vec3::Zero());
  point.world.scene.bodies[0].material.restitution = 0.5;
  ContactQuality quality;
  add_contacts(point.world.scene, {&point.manifold, 1}, point.before, point.after, quality);
  EXPECT_EQ(quality.points, 0u);
}

// What a step of ours leaves behind: sliding is solved to rounding.
TEST(ContactQuality, OfASlidingBoxIsRounding) {
  test::World world = test::under_gravity();
  world.add_floor(Material{0.3, 0.0});
  world.add_body(world.add_shape(Box{}), Vec3(0, 0, 0.5), 1000.0, Material{0.3, 0.0})
      .linear_velocity_m_s = Vec3(3, 1, 0);
  world.run(5);
  const std::vector<BodyState> before = world.states;
  const Geometry geometry(world.scene);
  world.run(1, geometry);
  StepScratch scratch;
  StageCounters counters;
  compute_boxes(world.scene, geometry, world.ids, before, scratch.boxes, counters);
  find_contacts(world.scene, geometry, world.ids, before, scratch, counters);
  ContactQuality quality;
  add_contacts(world.scene, scratch.manifolds, before, world.states, quality);
  EXPECT_EQ(quality.points, 4u);
  EXPECT_LT(quality.largest.signorini_m_s, 1e-9);
  EXPECT_LT(quality.largest.complementarity_m_s, 1e-9);
  EXPECT_LT(quality.largest.cone_m_s, 1e-9);
  EXPECT_LT(quality.largest.dissipation_m_s, 1e-8);
}

}  // namespace
}  // namespace soda::physics
