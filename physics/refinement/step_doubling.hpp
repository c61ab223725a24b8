// Some equal steps of an island over the same time, and what they tell of steps of no length.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/refinement/error_budget.hpp"

namespace soda::physics {

struct Limits {
  int most_solves = 0;
  int deepest = 0;  // cuts
};

// The last part that was done.
struct PastSubInterval {
  std::vector<BodyState> from;
  double time_s = 0.0;  // none yet: 0
};

// An island while it is refined: its manifolds tell which pairs are looked at; what else stays, and
// how far it came. Trials have faults of their own.
struct RefinedIsland : IslandStep {
  SolveScratch& scratch;
  StageCounters& counters;
  BodySizes sizes;
  ErrorBudget budget;
  Exactness how = Exactness::kOngoing;
  JointSystem springs;  // explicit: before its contacts are solved; else none
  Limits limits = {};
  PastSubInterval past = {};
  int solves = 0;
  std::vector<ContactManifold> found = {};  // scratch
};

// Equal steps, from the same states.
struct Trial {
  std::vector<BodyState> states;
  IslandReport report;
  bool failed = false;
  VelocityPath path;
};

// Whether a point of these contacts pushed in the step that led to the state of the lower body.
bool pressed(const BodyState& state, const ContactManifold& m, std::uint32_t feature);

// Stored impulses are those of a whole step, whatever the length of the last part.
void scale_impulses(double factor, std::span<BodyState> states);

// The contacts of the pairs of the island's manifolds once more, where the bodies are now, over its
// time. `found` is overwritten.
void find_again(const IslandStep& island, std::span<const BodyState> states,
                StageCounters& counters, std::vector<ContactManifold>& found);

// The contacts of all pairs of the island that can meet then, and its links.
void find_all_again(const IslandStep& island, std::span<const BodyState> states,
                    StageCounters& counters, std::vector<ContactManifold>& found);

// As find_again(), over time_s.
void contacts_at(const RefinedIsland& island, double time_s, std::span<const BodyState> states,
                 std::vector<ContactManifold>& found);

// `steps` steps over time_s, or of that many parts each if springs are explicit. `start`: the
// contacts at `from` over that time. A point that pressed before stays in touch: its gap at the
// start is closed at the same speed in every trial, and the gaps that steps of finite length open
// in between are let be. They are of second order, and to close them would make velocities of first
// order, but not in the first step of a trial.
Trial try_steps(RefinedIsland& island, std::span<const BodyState> from,
                std::span<const ContactManifold> start, double time_s, int steps);

// What trials of 1, 2, 4, 8 .. steps tell of steps of no length, by polynomials in their length:
// with each trial one more order. Sums of the reports likewise.
class RichardsonExtrapolation {
 public:
  explicit RichardsonExtrapolation(const Trial& one);
  void add(const Trial& next);  // of twice as many steps

  // Both after the second trial. What the last order changed; and what halving the steps changed.
  StepError error(const BodySizes& sizes) const;
  StepError change(const BodySizes& sizes) const;

  // `finest`: the trial that was added last.
  Trial limit(const Trial& finest) const;

 private:
  struct Row {  // against the first trial
    ShortList<BodyDifference, 2> bodies;
    Vec3 impulse = Vec3::Zero(), angular_impulse = Vec3::Zero();
    Vec3 work = Vec3::Zero();      // x: of position correction, y: of motors
    std::vector<JointLoad> loads;  // themselves; the same joints in every trial
  };
  Row against_first(const Trial& trial) const;
  StepError apart(const BodySizes& sizes, const Row& a, const Row& b) const;

  const Trial& one_;
  std::vector<Row> last_;  // of the last trial, by order
  Row before_;             // the trial before it
};

// Steps give an island no energy, but what is extrapolated from them may have a trace more.
// Velocities shrink by as much, which keeps their directions, and statics gave that much less.
// Returns by which share of themselves velocities were changed; more than 1 if it is too much for a
// trace: then nothing is changed. Nothing where something besides gravity and contacts gives
// energy.
double take_back_gain(const RefinedIsland& island, std::span<const BodyState> from, Trial& trial);

}  // namespace soda::physics
