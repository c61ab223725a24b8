#include "physics/solvers/solve_choice.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "physics/model/kinematic.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/substeps.hpp"

namespace soda::physics {
namespace {

// Two blocks of two layers each.
constexpr std::size_t kLeastInBlocks = 4;

// Whether its bodies and statics can have that many contact points.
bool can_be_large(const SceneDescription& scene) {
  constexpr std::size_t kPointsOfPair = std::tuple_size_v<decltype(ContactManifold::points)>;
  if (solid_statics(scene) < scene.statics.size()) return true;  // meshes have many manifolds
  const std::size_t bodies = scene.bodies.size();
  const std::size_t pairs = bodies * (bodies - 1) / 2 + bodies * scene.statics.size();
  return pairs * kPointsOfPair >= kLargeIslandPoints;
}

}  // namespace

Need direct_solves_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  return need_of(scene.solver.direct, "islands can be cheap to factorise",
                 "switched off in the solver settings");
}

Need blocks_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (scene.bodies.size() < kLeastInBlocks) return {false, "too few bodies for two blocks"};
  return need_of(can_be_large(scene), "an island may have hundreds of contact points",
                 "no island can have so many contact points");
}

Need joint_iterations_needed(const SceneDescription& scene) {
  const Need joints = joint_rows_needed(scene);
  if (!joints) return joints;
  return need_of(!(scene.tolerance > 0.0), "islands can take too much work to factorise",
                 "to a tolerance, joints are solved directly");
}

SolveChoice choose_solve(const SceneDescription& scene, double dt_s, bool accurate,
                         std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states) {
  SolveChoice choice;
  choice.elimination = plan_direct_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (choice.elimination || !is_large(manifolds)) return choice;
  if (!scene.joints.empty() && std::ranges::any_of(manifolds, is_joint)) return choice;
  if (any_kinematic(scene, ids)) return choice;
  IslandBlocks blocks = split_island(ids, manifolds);
  if (blocks.count() > 1) choice.blocks = std::move(blocks);
  return choice;
}

namespace {

// Multiplications of a step. Of iterations over a row, of joints or of contacts; of Newton's
// method, in which each of some steps factorises and goes over the rows; of joints between
// iterations of contacts; of contacts that are swept through exact joints, for each row and body.
constexpr double kIterationsOfRow = 1000.0;
constexpr double kNewtonSteps = 6.0, kNewtonOfRow = 100.0, kJointFactors = 15.0;
constexpr double kThroughJoints = 600.0;
// Of masses: between more unequal ones iterations do not get far.
constexpr double kMostSweptRatio = 1e4;
// What a direct solution of contacts may take in any case; beyond, no more than iterations. And
// what one factorisation of an articulated island may: it is exact, and worth more, but takes many
// where it has loops.
struct Worth {
  double factorisation, contacts;
};
constexpr Worth kFast{1.3e4, 2e5}, kBalanced{9e5, 1e6};
constexpr double kFactorisationOfRow = 66.0;
Worth worth_of(const SceneDescription& scene) { return scene.solver.refined ? kBalanced : kFast; }

bool can_be_swept(const SceneDescription& scene, std::span<const BodyId> ids) {
  return !(scene.tolerance > 0.0) && mass_ratio(scene, ids) < kMostSweptRatio;
}

double most_articulated(const SceneDescription& scene, double rows) {
  return std::max(worth_of(scene).factorisation, kFactorisationOfRow * rows);
}

}  // namespace

bool are_joints_swept(const SceneDescription& scene, const JointIsland& island) {
  return can_be_swept(scene, island.bodies) &&
         static_cast<double>(island.multiplications) > most_articulated(scene, island.rows);
}

JointedChoice choose_jointed_solve(const IslandStep& island, bool accurate,
                                   std::span<const BodyState> states, JointSystem& joints) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  JointedChoice choice;
  const std::uint32_t points = points_of(manifolds);
  if (points > 0)
    choice.elimination = plan_direct_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (accurate || !can_be_swept(scene, ids)) return choice;
  choice.substeps = substeps_of(scene.solver);
  const double joint_rows = joints.first_row.back();
  if (points == 0) {
    const double most = most_articulated(scene, joint_rows);
    choice.swept = choice.swept_else = factor_multiplications(most, joints) > most;
    return choice;
  }
  const double contact_rows = 3.0 * static_cast<double>(points), rows = joint_rows + contact_rows;
  const double most = std::max(worth_of(scene).contacts, kIterationsOfRow * rows);
  const double through = kThroughJoints * contact_rows * static_cast<double>(ids.size());
  const auto newton = [&] {
    const auto once = static_cast<double>(choice.elimination->multiplications);
    return kNewtonSteps * (once + kNewtonOfRow * rows);
  };
  const double left = (most - through) / kJointFactors;
  choice.swept_else = through > most || factor_multiplications(left, joints) > left;
  choice.swept = choice.swept_else && (!choice.elimination || newton() > most);
  return choice;
}

}  // namespace soda::physics
