// Joints that hold their bodies far off.
#include <cmath>

#include "models/cost/joint_cost.hpp"
#include "scenarios/cross_checks.hpp"
#include "scenarios/placed_boxes.hpp"
#include "scenarios/warnings.hpp"

namespace soda::scenarios {
namespace {

// In bounding radii. A pendulum may be long, and then its joint is with the world; what holds two
// bodies together is about where they are.
constexpr double kFarFromOne = 100.0, kFarFromTwo = 10.0;

struct End {
  Vec3 centre_m;
  double radius_m = 0.0;
  std::int64_t label = 0;
};

End end_of(const Written& written, std::int64_t label) {
  const std::uint32_t body = *find_body(written.scenario.scene, label);
  const std::uint32_t shape = written.scenario.scene.bodies[body].shape;
  return {written.scenario.initial[body].position_m, written.boxes.shapes[shape].bounding_radius_m,
          label};
}

struct Anchor {
  const JsonValue& place;
  Vec3 at_m;
};

void tell(const Anchor& anchor, const End& end, WarningList& warnings) {
  warnings.add("anchor-far", anchor.place, [&] {
    const double apart = (anchor.at_m - end.centre_m).norm();
    const bool local = anchor.at_m.norm() <= 2.0 * end.radius_m;
    return WarningText{"an anchor " + about(apart) + " m off the centre of body " +
                           std::to_string(end.label) + ", which reaches " + about(end.radius_m) +
                           " m",
                       local ? "an anchor in the world frame: add the body's position"
                             : "another anchor; it is given in the world frame, in metres"};
  });
}

// An anchor that only one body has, and the world or a long joint.
void check_one(const Anchor& anchor, const End& end, double far, WarningList& warnings) {
  if ((anchor.at_m - end.centre_m).norm() > far * end.radius_m) tell(anchor, end, warnings);
}

// Fine anywhere between the two bodies, however far they are apart.
void check_two(const Anchor& anchor, const End& a, const End& b, WarningList& warnings) {
  const double radius = std::max(a.radius_m, b.radius_m);
  const Vec3 low = a.centre_m.cwiseMin(b.centre_m), high = a.centre_m.cwiseMax(b.centre_m);
  const Vec3 nearest = anchor.at_m.cwiseMax(low).cwiseMin(high);
  if ((anchor.at_m - nearest).norm() <= kFarFromTwo * radius) return;
  const bool a_is_nearer = (anchor.at_m - a.centre_m).norm() <= (anchor.at_m - b.centre_m).norm();
  tell(anchor, a_is_nearer ? a : b, warnings);
}

struct Checker {
  const Written& written;
  WarningList& warnings;

  template <class Spec>
  void operator()(const Spec& spec) const {
    const End body = end_of(written, spec.body);
    const Anchor anchor{*find_member(*spec.json, "anchor_m"), spec.anchor_m};
    if constexpr (requires { spec.other_anchor_m; }) {
      check_one(anchor, body, spec.other_body ? kFarFromTwo : kFarFromOne, warnings);
      const Anchor other{*find_member(*spec.json, "other_anchor_m"), spec.other_anchor_m};
      if (spec.other_body)
        check_one(other, end_of(written, *spec.other_body), kFarFromTwo, warnings);
    } else if (spec.other_body) {
      check_two(anchor, body, end_of(written, *spec.other_body), warnings);
    } else {
      check_one(anchor, body, kFarFromOne, warnings);
    }
  }
};

}  // namespace

void check_anchors(const Written& written, WarningList& warnings) {
  for (const JointSpec& spec : written.document.joints)
    std::visit(Checker{written, warnings}, spec);
}

void check_joint_cost(const Written& written, WarningList& warnings) {
  const physics::SceneDescription& scene = written.scenario.scene;
  if (scene.joints.empty()) return;
  const double step_ns = 1e9 * scene.dt_s;
  for (const models::JointCost& cost : models::costly_islands(scene)) {
    if (static_cast<double>(cost.factors_ns) <= step_ns) return;
    warnings.add("joint-cost", *find_member(*written.document.json, "joints"), [&] {
      return WarningText{models::words_for(scene, cost) + "; longer than the step itself",
                         "fewer joints on one body, or islands that do not hang together"};
    });
  }
}

}  // namespace soda::scenarios
