#include "physics/broadphase/occupied_cells.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "physics/shapes/geometry.hpp"
#include "tests/support/scenes.hpp"

namespace soda::physics {
namespace {

Aabb box_at(const Vec3& middle, const Vec3& half) { return {middle - half, middle + half}; }

TEST(OccupiedCells, FindAllThatOverlapAndFewOthers) {
  soda::test::Choices choices(3);
  for (int trial = 0; trial < 40; ++trial) {
    const double room_m = trial % 2 == 0 ? 50.0 : 1e6, far_m = trial % 3 == 0 ? 1e8 : 0.0;
    std::vector<Aabb> boxes;
    for (std::size_t i = 1 + choices.below(150); i > 0; --i)
      boxes.push_back(box_at(Vec3::Constant(far_m) + choices.vector(-room_m, room_m),
                             choices.vector(0.1, 1.5)));
    const OccupiedCells cells(boxes);
    int others = 0;
    for (int i = 0; i < 2000; ++i) {
      const Aabb box = box_at(Vec3::Constant(far_m) + choices.vector(-1.1 * room_m, 1.1 * room_m),
                              choices.vector(0.1, i % 10 == 0 ? 20.0 : 2.0));
      bool any = false;
      for (const Aabb& other : boxes) any = any || overlap(box, other);
      if (any) {
        EXPECT_TRUE(cells.may_overlap(box)) << "trial " << trial;
      }
      others += !any && i % 10 != 0 && cells.may_overlap(box);
    }
    if (room_m == 50.0) {
      EXPECT_LT(others, 600) << "trial " << trial;
    }
  }
}

TEST(OccupiedCells, TakeWhatIsNotFiniteForNear) {
  const double far = std::numeric_limits<double>::infinity();
  const Aabb everywhere{Vec3::Constant(-far), Vec3::Constant(far)};
  const Aabb one = box_at(Vec3(1, 2, 3), Vec3(1, 1, 1));
  EXPECT_TRUE(OccupiedCells({&one, 1}).may_overlap(everywhere));
  for (int axis = 0; axis < 3; ++axis) {
    Aabb line = one;
    line.min[axis] = -far;
    line.max[axis] = far;
    EXPECT_TRUE(OccupiedCells({&one, 1}).may_overlap(line)) << axis;
  }
  const Aabb huge = box_at(Vec3::Zero(), Vec3::Constant(1e300));
  const std::vector<Aabb> both{one, huge};
  EXPECT_TRUE(OccupiedCells(both).may_overlap(one));
  EXPECT_TRUE(OccupiedCells(both).may_overlap(box_at(Vec3(-1e290, 0, 0), Vec3(1, 1, 1))));
}

}  // namespace
}  // namespace soda::physics
