#include "physics/integrators/giving_way.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "physics/math/disjoint_sets.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {
namespace {

// How far a body came.
struct Moved {
  Vec3 linear_m = Vec3::Zero(), angular_rad = Vec3::Zero();
};
Moved between(const BodyState& from, const BodyState& to) {
  return {to.position_m - from.position_m, small_rotation(from.orientation, to.orientation)};
}

// Of a row, by which it gets wider.
double widened_m(const NormalRow& row, std::span<const Moved> moved) {
  double sum = -row.normal.dot(moved[row.a].linear_m) - row.arm_a.dot(moved[row.a].angular_rad);
  if (row.b < moved.size())
    sum += row.normal.dot(moved[row.b].linear_m) + row.arm_b.dot(moved[row.b].angular_rad);
  return sum;
}

// What moves as a whole.
struct Whole {
  double mass_kg = 0.0;
  bool held = false;
  Vec3 aside_m = Vec3::Zero();
};

struct Wholes {
  std::vector<Whole> all;              // by their root
  std::vector<std::uint32_t> of_body;  // its root
};

Wholes find_wholes(const IslandStep& island, const JointSystem& joints) {
  const std::size_t count = island.ids.size();
  std::vector<std::uint32_t> parent(count);
  std::iota(parent.begin(), parent.end(), 0u);
  std::vector<bool> held(count, false);
  for (std::size_t j = 0; j < joints.joints.size(); ++j) {
    const auto& [a, b] = joints.bodies[j];
    if (a >= count || b >= count)
      held[std::min(a, b)] = true;
    else
      parent[find_root(parent, a)] = find_root(parent, b);
  }
  Wholes wholes{std::vector<Whole>(count), {}};
  for (std::uint32_t i = 0; i < count; ++i) {
    const BodyParams& params = island.scene.bodies[index_of(island.ids[i])];
    Whole& whole = wholes.all[wholes.of_body.emplace_back(find_root(parent, i))];
    whole.mass_kg += params.mass_kg;
    whole.held = whole.held || held[i] || params.kinematic;
  }
  return wholes;
}

// A contact that is to be kept as wide as this.
struct KeptGap {
  std::uint32_t a = 0, b = 0;  // wholes; the second may be none
  Vec3 normal = Vec3::Zero();
  double lacks_m = 0.0, pushed_m = 0.0;
};

// One iteration over all of them. Returns the largest change.
double push_aside(std::span<KeptGap> gaps, std::span<Whole> wholes) {
  double most = 0.0;
  for (KeptGap& gap : gaps) {
    Whole& a = wholes[gap.a];
    Whole* const b = gap.b < wholes.size() ? &wholes[gap.b] : nullptr;
    const double of_a = a.held ? 0.0 : 1.0 / a.mass_kg;
    const double of_b = b == nullptr || b->held ? 0.0 : 1.0 / b->mass_kg;
    if (!(of_a + of_b > 0.0) || gap.a == gap.b) continue;
    const Vec3 aside = (b == nullptr ? Vec3(Vec3::Zero()) : b->aside_m) - a.aside_m;
    const double wanted = std::max(0.0, gap.pushed_m + gap.lacks_m - gap.normal.dot(aside));
    const double change = wanted - gap.pushed_m;
    gap.pushed_m = wanted;
    a.aside_m -= gap.normal * (change * of_a / (of_a + of_b));
    if (b != nullptr) b->aside_m += gap.normal * (change * of_b / (of_a + of_b));
    most = std::max(most, std::abs(change));
  }
  return most;
}

// The rows' gaps, of which `deeper` says by how much closing has deepened them. None if that is
// nothing to see.
std::vector<KeptGap> deepened(const ContactProblem& problem, std::span<const Moved> came,
                              std::span<const Moved> closed) {
  constexpr double kOfSlop = 0.01;  // less is pushed out as other overlaps are
  std::vector<KeptGap> gaps;
  bool any = false;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    const double gap_m = problem.contacts[i].separation_m + widened_m(row, came);
    const double deeper_m = -widened_m(row, closed) - std::max(gap_m, 0.0);
    any = any || deeper_m > kOfSlop * problem.contacts[i].slop_m;
    gaps.push_back({row.a, row.b, row.normal, deeper_m, 0.0});
  }
  if (!any) gaps.clear();
  return gaps;
}

// By how much each whole moves aside. Whether any does.
bool move_aside(std::span<KeptGap> gaps, Wholes& wholes) {
  constexpr int kMostIterations = 50;
  constexpr double kEnough = 1e-3;  // of what is lacking most
  double most_m = 0.0;
  for (KeptGap& gap : gaps) {
    const std::size_t bodies = wholes.of_body.size();
    gap.a = wholes.of_body[gap.a];
    gap.b = gap.b < bodies ? wholes.of_body[gap.b] : static_cast<std::uint32_t>(bodies);
    most_m = std::max(most_m, gap.lacks_m);
  }
  for (int iteration = 0; iteration < kMostIterations; ++iteration)
    if (push_aside(gaps, wholes.all) <= kEnough * most_m) break;
  return std::ranges::any_of(wholes.all,
                             [](const Whole& whole) { return whole.aside_m != Vec3::Zero(); });
}

// What moving aside gives.
double aside_joule(const IslandStep& island, const Wholes& wholes) {
  double work_joule = 0.0;
  for (std::size_t i = 0; i < island.ids.size(); ++i)
    if (falls(island.scene, island.ids[i]))
      work_joule -=
          island.scene.bodies[index_of(island.ids[i])].mass_kg *
          field_of(island.scene, island.ids[i]).dot(wholes.all[wholes.of_body[i]].aside_m);
  return work_joule;
}

// A velocity after the displacement back, by which it becomes at most 0 along it. Displacements
// back that are small beside the displacement are of second order in it: they say nothing about
// velocities.
Vec3 stopped(const Vec3& velocity, const Vec3& back, double time_s) {
  constexpr double kOfDisplacement = 0.1;
  const double squared = back.squaredNorm(), against = -velocity.dot(back) * time_s;
  if (!(against > 0.0) || kOfDisplacement * against > squared) return velocity;
  return velocity + back * (std::min(1.0, against / squared) / time_s);
}

// Its displacement back, and its velocity.
void come_back(const BodyParams& params, double time_s, const Moved& back, BodyState& state,
               GivenWay& given) {
  if (params.kinematic || !(time_s > 0.0)) return;
  const Vec3 linear = stopped(state.linear_velocity_m_s, back.linear_m, time_s);
  const Vec3 angular = stopped(state.angular_velocity_rad_s, back.angular_rad, time_s);
  const Vec3 impulse = (linear - state.linear_velocity_m_s) * params.mass_kg;
  const Mat3 inertia =
      rotated_tensor(state.orientation.toRotationMatrix(), params.inertia_local_kg_m2);
  given.by_world_newton_s += impulse;
  given.by_world_newton_m_s +=
      state.position_m.cross(impulse) + inertia * (angular - state.angular_velocity_rad_s);
  state.linear_velocity_m_s = linear;
  state.angular_velocity_rad_s = angular;
}

}  // namespace

GivenWay give_way(const IslandStep& island, const OpenMotion& motion, const JointSystem& joints,
                  const ContactProblem& problem, std::span<BodyState> states) {
  GivenWay given;
  std::vector<Moved> came, closed;
  for (std::size_t i = 0; i < states.size(); ++i) {
    came.push_back(between(motion.before[i], motion.open[i]));
    closed.push_back(between(motion.open[i], states[i]));
  }
  std::vector<KeptGap> gaps = deepened(problem, came, closed);
  if (gaps.empty()) return given;
  Wholes wholes = find_wholes(island, joints);
  if (!move_aside(gaps, wholes)) return given;
  const double work_joule = aside_joule(island, wholes);
  const double share = work_joule > motion.most_joule ? motion.most_joule / work_joule : 1.0;
  given.work_joule = share * work_joule;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const BodyParams& params = island.scene.bodies[index_of(island.ids[i])];
    const Vec3 aside = wholes.all[wholes.of_body[i]].aside_m * share;
    states[i].position_m += aside;
    come_back(params, motion.time_s, {closed[i].linear_m + aside, closed[i].angular_rad}, states[i],
              given);
  }
  return given;
}

}  // namespace soda::physics
