#include "physics/step/stages.hpp"

#include <array>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/events/contact_impacts.hpp"
#include "physics/events/event_driven_impacts.hpp"
#include "physics/events/floor_stops.hpp"
#include "physics/events/linked_step.hpp"
#include "physics/events/sleeping.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/end_contacts.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/solvers/blows.hpp"
#include "physics/solvers/solve_choice.hpp"
#include "physics/step/sent_on.hpp"

namespace soda::physics {
namespace {

constexpr std::size_t kKernels = static_cast<std::size_t>(ShapeKernel::kCount);

constexpr std::array kShapeNames = std::to_array<const char*>(
    {"sphere", "box", "capsule", "cylinder", "hull", "mesh", "halfspace", "compound"});
static_assert(kShapeNames.size() == std::variant_size_v<Shape>);

// What a stage counts, if that is one number.
std::function<std::uint64_t(const StageCounters&)> count_of(std::uint64_t StageCounters::*member) {
  return [member](const StageCounters& counters) { return counters.*member; };
}

void add_detection(const SceneDescription& scene, std::vector<Stage>& stages) {
  stages.push_back({"swept boxes",
                    need_of(!scene.bodies.empty(), "bodies move", "the scene has no dynamic body"),
                    count_of(&StageCounters::boxes)});
  stages.push_back({"broadphase pairs",
                    need_of(can_meet(scene.bodies.size(), scene.statics.size()),
                            "bodies can meet bodies or statics", "nothing can touch"),
                    count_of(&StageCounters::candidate_pairs)});
  std::array<bool, kKernels> kernels{};
  bool fcl = false;
  for (const ShapePair& pair : shape_pairs(scene)) {
    kernels[static_cast<std::size_t>(pair.kernel)] = true;
    fcl = fcl || pair.by_fcl;
  }
  for (std::size_t kernel = 0; kernel < kKernels; ++kernel)
    stages.push_back(
        {std::string(name_of(static_cast<ShapeKernel>(kernel))) + " kernel",
         need_of(kernels[kernel], "a pair of these shapes can meet", "no such pair of shapes"),
         [kernel](const StageCounters& counters) { return counters.narrowphase_tests[kernel]; }});
  stages.push_back({"FCL's routines",
                    need_of(fcl, "FCL says how a pair of these shapes meets",
                            "no pair of these shapes is asked of FCL"),
                    count_of(&StageCounters::fcl_calls)});
  stages.push_back({"own routines for FCL's",
                    need_of(scene.narrowphase == Narrowphase::kFcl && fcl,
                            "FCL may give no answer of use", "FCL is asked about boxes at most"),
                    count_of(&StageCounters::fcl_failures)});
}

// Islands are those of contacts and of joints.
Need solver_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene), joints = joint_rows_needed(scene);
  return !contacts && joints ? joints : contacts;
}

void add_solves(const SceneDescription& scene, std::vector<Stage>& stages) {
  const std::vector<Stage> more = {
      {"driven bodies", drives_needed(scene), count_of(&StageCounters::driven_bodies)},
      {"forces and damping", forces_needed(scene), count_of(&StageCounters::forced_bodies)},
      {"kinematic bodies", kinematic_needed(scene), count_of(&StageCounters::kinematic_bodies)},
      {"contact solver", solver_needed(scene), count_of(&StageCounters::islands_solved)},
      {"direct contact solver", direct_solves_needed(scene),
       count_of(&StageCounters::factor_multiplications)},
      {"friction rows", friction_needed(scene), count_of(&StageCounters::friction_rows)},
      {"rolling friction rows", rolling_needed(scene), count_of(&StageCounters::rolling_rows)},
      {"conveyor rows", conveyors_needed(scene), count_of(&StageCounters::conveyor_rows)},
      {"joint rows", joint_rows_needed(scene), count_of(&StageCounters::joint_rows)},
      {"sweeps through joints", joint_iterations_needed(scene),
       count_of(&StageCounters::joint_sweeps)},
      {"limit rows", limits_needed(scene), count_of(&StageCounters::limit_rows)},
      {"motor rows", motors_needed(scene), count_of(&StageCounters::motor_rows)},
      {"breaking joints", breaks_needed(scene), count_of(&StageCounters::joints_broken)},
      {"restitution rows", restitution_needed(scene), count_of(&StageCounters::restitution_rows)},
      {"blows shared out", blows_needed(scene), count_of(&StageCounters::blows)},
      {"impacts in flight", flights_needed(scene), count_of(&StageCounters::flight_searches)},
      {"hits among contacts", contact_impacts_needed(scene),
       count_of(&StageCounters::hit_searches)},
      {"impacts of what joints draw", linked_impacts_needed(scene),
       count_of(&StageCounters::linked_searches)},
      {"islands advanced anew", passes_needed(scene), count_of(&StageCounters::islands_again)},
      {"contacts that come round", end_contacts_needed(scene),
       count_of(&StageCounters::turned_searches)},
      {"contacts of what is sent on", sent_contacts_needed(scene),
       count_of(&StageCounters::unseen_searches)},
      {"refined steps of islands", refinement_needed(scene),
       count_of(&StageCounters::refined_steps)},
      {"contacts of bodies at rest", sleeping_needed(scene),
       count_of(&StageCounters::pairs_at_rest)},
      {"blocks of giant islands", blocks_needed(scene), count_of(&StageCounters::blocks_solved)},
      {"warm starting", warm_starts_needed(scene), count_of(&StageCounters::warm_started_rows)}};
  stages.insert(stages.end(), more.begin(), more.end());
}

// A compound is of each kind that its parts are of.
void count_kinds(const SceneDescription& scene, std::uint32_t shape,
                 std::array<std::size_t, kShapeNames.size()>& count) {
  const auto* compound = std::get_if<Compound>(&scene.shapes[shape]);
  if (compound == nullptr) {
    ++count[scene.shapes[shape].index()];
    return;
  }
  std::array<bool, kShapeNames.size()> is_of{};
  for (const CompoundPart& part : compound->parts) is_of[scene.shapes[part.shape].index()] = true;
  for (std::size_t kind = 0; kind < is_of.size(); ++kind)
    if (is_of[kind]) ++count[kind];
}

}  // namespace

std::vector<ShapePair> shape_pairs(const SceneDescription& scene) {
  constexpr std::size_t kKinds = kShapeNames.size();
  std::array<std::size_t, kKinds> bodies{}, statics{};
  std::array<const Shape*, kKinds> example{};
  for (const Shape& shape : scene.shapes) example[shape.index()] = &shape;
  for (const BodyParams& body : scene.bodies) count_kinds(scene, body.shape, bodies);
  for (const StaticBody& fixed : scene.statics) count_kinds(scene, fixed.shape, statics);
  std::vector<ShapePair> pairs;
  for (std::size_t a = 0; a < kKinds; ++a)
    for (std::size_t b = a; b < kKinds; ++b) {
      const bool two_bodies = a == b ? bodies[a] > 1 : bodies[a] > 0 && bodies[b] > 0;
      const bool with_static =
          (bodies[a] > 0 && statics[b] > 0) || (statics[a] > 0 && bodies[b] > 0);
      if (!two_bodies && !with_static) continue;
      const ShapeKernel kernel = kernel_for(*example[a], *example[b]);
      pairs.push_back(
          {kShapeNames[a], kShapeNames[b], kernel, is_asked_of_fcl(scene.narrowphase, kernel)});
    }
  return pairs;
}

std::vector<Stage> stages_of(const SceneDescription& scene) {
  std::vector<Stage> stages;
  add_detection(scene, stages);
  add_solves(scene, stages);
  return stages;
}

}  // namespace soda::physics
