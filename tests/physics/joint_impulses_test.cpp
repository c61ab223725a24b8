#include "physics/constraints/joint_impulses.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

// A light leg under a heavy table would feel a hundred thousandth of what it bears.
TEST(JointImpulses, AreLoadedAsTheyWereStoredHoweverTheJointIsTurned) {
  for (const JointKind kind : {JointKind::kBall, JointKind::kHinge, JointKind::kSlider,
                               JointKind::kFixed, JointKind::kDistance})
    for (const double open_rad : {0.0, 1e-4, 0.05}) {
      World world;
      const std::uint32_t box = world.add_shape(Box{Vec3(0.1, 0.2, 0.3)});
      world.add_body(box, Vec3::Zero());
      world.add_body(box, Vec3(0.3, 0.4, 0.9));
      Joint joint = test::joint_at(kind, world, 0, 1, Vec3(0.1, 0.2, 0.4), Vec3(1, 2, 2) / 3.0);
      joint.length_m = 1.0;
      if (kind == JointKind::kHinge) joint.limits = JointLimits{-1.0, 1.0};
      if (kind == JointKind::kHinge) joint.motor = JointMotor{1.0, 2.0};
      test::add(world, joint);
      world.states[1].orientation =
          test::about(Vec3(1, 2, 2), 0.3) * test::about(Vec3(2, -1, 0), open_rad);
      const std::vector<ContactManifold> manifolds = test::contacts_of(world, BodyId{0}, BodyId{1});
      JointSystem joints = find_joints(world.scene, world.ids, manifolds);
      ASSERT_EQ(joints.joints.size(), 1u);
      build_joint_rows(world.scene, world.scene.dt_s, world.states, false, joints);
      std::vector<double> given;
      for (JointRow& row : joints.rows) {
        row.impulse_newton_s = std::sin(1.0 + static_cast<double>(given.size()));
        given.push_back(row.impulse_newton_s);
      }
      append_joint_impulses(world.scene, 0, joints, world.states[0].impulses);
      for (JointRow& row : joints.rows) row.impulse_newton_s = 0.0;
      load_joint_impulses(world.scene, world.states, joints);
      for (std::size_t r = 0; r < given.size(); ++r)
        EXPECT_NEAR(joints.rows[r].impulse_newton_s, given[r], 1e-14)
            << static_cast<int>(kind) << " " << open_rad << " row " << r;
    }
}

}  // namespace
}  // namespace soda::physics
