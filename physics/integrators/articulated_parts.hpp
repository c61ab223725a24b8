// A step of an articulated island in equal parts.
#pragma once

#include <span>
#include <vector>

#include "physics/integrators/articulated_motion.hpp"
#include "physics/integrators/ball_motion.hpp"
#include "physics/integrators/rattle_motion.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// What is advanced. `joints`: which there are; of no interest here are their rows.
struct ArticulatedIsland {
  const IslandStep& island;
  JointSystem& joints;
  ArticulatedMotion& motion;
};

// Calls `use` with the articulated island and what moves it: a single body on a ball joint needs no
// arrays.
template <class Use>
bool with_articulated(const IslandStep& island, JointSystem& joints, const Use& use) {
  if (const Joint* ball = BallMotion::joint_of(island.scene, island.ids, joints)) {
    BallMotion motion(island.scene, island.ids.front(), *ball);
    return use(ArticulatedIsland{island, joints, motion});
  }
  RattleMotion motion(island.scene, island.ids, joints);
  return use(ArticulatedIsland{island, joints, motion});
}

// By how much bodies may swing about taut joints and turn in a part.
struct PartBounds {
  double swing_rad = 0.0, rotation_rad = 0.0;
};
// Where an estimate tells what parts are off by: well below what is unstable.
inline constexpr PartBounds kLongestParts{0.5, 1.0};

// How many parts keep to the bounds, and are short enough for explicit spring impulses. 0 where no
// number would do.
int substeps_of(const ArticulatedIsland& articulated, const PartBounds& bounds);

// As many are tried where fewer do not hold: what they take is bounded.
int most_parts(JointSystem& joints);

// What parts of second order are off by, as far as their kicks tell.
class KickErrors {
 public:
  KickErrors(const BodySizes& sizes, std::span<const BodyId> ids) : sizes_(sizes), ids_(ids) {}

  void restart() { sum_ = largest_ = 0.0; }

  // A part that kicks at both ends only sees a force that changes evenly in between as if it had
  // its first half too long: of the change of velocity between both kicks, places are off by a
  // third of the time. Velocities are only by what the force bends in the part, a sixth of that for
  // as much as a radian of it. `scaled`: what energy took of velocities.
  void add(double part_s, std::span<const KickChange> changes, double scaled,
           std::span<const BodyState> states);

  double relative_error() const { return sum_; }
  void tell(IslandReport& report) const {
    report.error_estimate = sum_;
    report.worst_body = worst_;
  }

 private:
  const BodySizes& sizes_;
  std::span<const BodyId> ids_;
  std::vector<BodyDifference> differences_;
  double sum_ = 0.0, largest_ = 0.0;
  BodyId worst_{};
};

// Equal parts of a step.
struct Parts {
  int count = 1;
  bool fourth = false;  // five stages each, of the fourth order; else one, of the second
  bool more = false;    // whether there can be
};

// How parts end: all of them made, joints left open, or an energy that errs by more than a trace;
// of a loss that ends none where there are to be no more parts.
enum class PartsEnd { kHolds, kOpen, kEnergy };

// From where the motion was started. Energy is kept, or may fall where something is stopped.
// `errors`: of parts of second order, where somebody asks.
PartsEnd advance_parts(const ArticulatedIsland& articulated, const Parts& parts, KickErrors* errors,
                       IslandReport& report);

// The states of the motion; those that are absurd stay and are faults.
void take_states(const ArticulatedIsland& articulated, std::span<BodyState> states,
                 std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
