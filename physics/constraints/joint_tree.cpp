#include "physics/constraints/joint_tree.hpp"

#include <algorithm>

namespace soda::physics {
namespace {

// From that many arms on, six unknowns more are less work than each arm coupled with each.
constexpr std::uint32_t kArmsOfHub = 6;

std::uint32_t body_count(std::span<const JointEnds> ends) {
  std::uint32_t count = 0;
  for (const JointEnds& of_joint : ends)
    for (const std::uint32_t body : of_joint)
      if (body != kImmovable) count = std::max(count, body + 1);
  return count;
}

// Joints of each body; those of what is immovable come last.
using JointsOfBodies = std::vector<std::vector<std::uint32_t>>;

JointsOfBodies joints_of_bodies(std::uint32_t bodies, std::span<const JointEnds> ends) {
  JointsOfBodies joints(bodies + 1);
  for (std::uint32_t joint = 0; joint < ends.size(); ++joint)
    for (const std::uint32_t body : ends[joint]) {
      std::vector<std::uint32_t>& of_body = joints[std::min(body, bodies)];
      if (of_body.empty() || of_body.back() != joint) of_body.push_back(joint);
    }
  return joints;
}

// All bodies, and what is immovable as one more, walked depth first. Of a joint that is the only
// way to a body, nothing found beyond it leads back before it: R. Tarjan, "A note on finding the
// bridges of a graph", Information Processing Letters 2 (1974).
class Walk {
 public:
  struct Step {
    std::uint32_t body, from, joint;
  };

  Walk(std::uint32_t bodies, std::span<const JointEnds> ends, const JointsOfBodies& joints)
      : bodies_(bodies),
        ends_(ends),
        joints_(joints),
        found_(bodies + 1, 0),
        low_(bodies + 1, 0),
        hanging_(ends.size(), kImmovable) {
    walk_from(bodies);
    for (std::uint32_t body = 0; body < bodies; ++body) walk_from(body);
  }

  const std::vector<Step>& steps() const { return steps_; }  // in the order in which they are found
  // Of each joint: the body that hangs on it, or kImmovable.
  const std::vector<std::uint32_t>& hanging() const { return hanging_; }

 private:
  struct Visit {
    Step step;
    std::size_t next = 0;  // of its joints
  };

  std::uint32_t other_end(std::uint32_t joint, std::uint32_t body) const {
    const std::uint32_t a = std::min(ends_[joint][0], bodies_);
    return a == body ? std::min(ends_[joint][1], bodies_) : a;
  }

  void find(const Step& step, std::vector<Visit>& way) {
    steps_.push_back(step);
    found_[step.body] = low_[step.body] = static_cast<std::uint32_t>(steps_.size());
    way.push_back({step});
  }

  void walk_from(std::uint32_t root) {
    if (found_[root] != 0) return;
    std::vector<Visit> way;
    find({root, root, kImmovable}, way);
    while (!way.empty()) {
      Visit& at = way.back();
      const auto [body, from, by] = at.step;
      if (at.next < joints_[body].size()) {
        const std::uint32_t joint = joints_[body][at.next++];
        const std::uint32_t other = other_end(joint, body);
        if (joint == by || other == body) continue;
        if (found_[other] == 0)
          find({other, body, joint}, way);
        else
          low_[body] = std::min(low_[body], found_[other]);
        continue;
      }
      way.pop_back();
      if (way.empty()) continue;
      low_[from] = std::min(low_[from], low_[body]);
      if (low_[body] > found_[from]) hanging_[by] = body;
    }
  }

  std::uint32_t bodies_;
  std::span<const JointEnds> ends_;
  const JointsOfBodies& joints_;
  std::vector<std::uint32_t> found_;  // from 1 on
  std::vector<std::uint32_t> low_;    // the first that was found of those that it leads to
  std::vector<std::uint32_t> hanging_;
  std::vector<Step> steps_;
};

bool is_hub(const std::vector<std::uint32_t>& joints, std::span<const std::uint32_t> hanging,
            std::uint32_t body) {
  const auto arms = std::ranges::count_if(joints, [&](std::uint32_t joint) {
    return hanging[joint] != kImmovable && hanging[joint] != body;
  });
  return static_cast<std::uint32_t>(arms) >= kArmsOfHub;
}

}  // namespace

JointTree joint_tree(std::span<const JointEnds> ends) {
  const std::uint32_t bodies = body_count(ends);
  const JointsOfBodies joints = joints_of_bodies(bodies, ends);
  JointTree tree;
  tree.hub_of.assign(bodies, kImmovable);
  tree.hub_of_arm.assign(ends.size(), kImmovable);
  const bool can_be = std::ranges::any_of(std::span(joints).first(bodies), [](const auto& of_body) {
    return of_body.size() >= kArmsOfHub;
  });
  tree.hangs_on.assign(ends.size(), 0);
  if (!can_be) return tree;
  const Walk walk(bodies, ends, joints);
  for (std::size_t i = walk.steps().size(); i-- > 0;) {
    const std::uint32_t body = walk.steps()[i].body;
    if (body == bodies || !is_hub(joints[body], walk.hanging(), body)) continue;
    tree.hub_of[body] = static_cast<std::uint32_t>(tree.hubs.size());
    tree.hubs.push_back(body);
  }
  const auto none = static_cast<std::uint32_t>(tree.hubs.size());
  tree.hangs_on.assign(ends.size(), none);
  std::vector<std::uint32_t> above(bodies + 1, none);
  for (const auto& [body, from, joint] : walk.steps()) {
    if (joint == kImmovable) continue;
    above[body] = above[from];
    if (from == bodies || tree.hub_of[from] == kImmovable || walk.hanging()[joint] != body)
      continue;
    above[body] = tree.hub_of_arm[joint] = tree.hub_of[from];
  }
  for (std::uint32_t joint = 0; joint < ends.size(); ++joint)
    for (const std::uint32_t end : ends[joint])
      if (end != kImmovable) tree.hangs_on[joint] = std::min(tree.hangs_on[joint], above[end]);
  return tree;
}

}  // namespace soda::physics
