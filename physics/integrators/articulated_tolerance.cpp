// Articulated islands to a tolerance: how many parts, of which order.
#include <cmath>

#include "physics/forces/forces.hpp"
#include "physics/integrators/articulated_island.hpp"
#include "physics/integrators/articulated_parts.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {
namespace {

constexpr double kWanted = 0.7;  // of the tolerance: what a new number of parts is aimed at
constexpr int kMostTries = 3;

// How many parts there have to be where `parts` are off by some widths, to be off by no more than
// are wanted; infinite numbers included. What displacements are taken to be off by falls with the
// square of the number, what velocities are with the number.
double parts_for(double relative_error, double wanted_relative_error, int parts) {
  constexpr double kOfDisplacement = 2.0 / 3.0;  // of one part that takes the whole step
  const double displacements =
      kOfDisplacement / parts / (kOfDisplacement / parts + (1.0 - kOfDisplacement));
  const double half = 0.5 * (1.0 - displacements) * relative_error / wanted_relative_error;
  return parts *
         (half + std::sqrt(half * half + displacements * relative_error / wanted_relative_error));
}

// In parts of the second order, as long as they cost less than those of the fourth.
bool advance_by_second(const ArticulatedIsland& articulated, double most_relative_error, int fewest,
                       KickErrors& errors, std::span<const BodyState> states,
                       IslandReport& report) {
  constexpr int kMost = 15;  // times the fewest: stages of the least that the fourth order takes
  double wanted = fewest;
  for (int tries = 0; tries < kMostTries && wanted <= kMost * fewest; ++tries) {
    if (tries > 0) articulated.motion.start(states);
    errors.restart();
    IslandReport linked = report;
    const Parts parts{static_cast<int>(wanted), false, true};
    const bool holds = advance_parts(articulated, parts, &errors, linked) == PartsEnd::kHolds;
    if (holds && errors.relative_error() <= most_relative_error) {
      report = linked;
      errors.tell(report);
      return true;
    }
    wanted =
        holds ? parts_for(errors.relative_error(), kWanted * most_relative_error, parts.count) + 1.0
              : 2.0 * parts.count;
  }
  return false;
}

// In parts of the fourth order, and again in twice as many: these are off by a fifteenth of what
// the two differ by; a quarter is counted.
bool advance_by_fourth(const ArticulatedIsland& articulated, double most_relative_error, int fewest,
                       const BodySizes& sizes, std::span<const BodyState> states,
                       IslandReport& report) {
  constexpr double kCounted = 0.25;
  constexpr int kMost = 128;
  double wanted = fewest;
  for (int tries = 0; tries < kMostTries && wanted <= kMost; ++tries) {
    const int parts = static_cast<int>(wanted);
    IslandReport coarse = report, fine = report;
    articulated.motion.start(states);
    const auto in_parts = [&](int count, IslandReport& of) {
      return advance_parts(articulated, {count, true, true}, nullptr, of) == PartsEnd::kHolds;
    };
    bool holds = in_parts(parts, coarse);
    const std::span<const BodyState> reached = articulated.motion.states();
    const std::vector<BodyState> before(reached.begin(), reached.end());
    articulated.motion.start(states);
    holds = holds && in_parts(2 * parts, fine);
    StepError error = apart_of(sizes, before, articulated.motion.states());
    error.relative_error *= kCounted;
    if (holds && error.relative_error <= most_relative_error) {
      report = fine;
      report.error_estimate = error.relative_error;
      report.worst_body = articulated.island.ids[error.body];
      return true;
    }
    wanted *=
        holds ? 1.0 + std::sqrt(std::sqrt(error.relative_error / (kWanted * most_relative_error)))
              : 2.0;
  }
  return false;
}

bool advance_within(const ArticulatedIsland& articulated, double most_relative_error,
                    const BodySizes& sizes, std::span<BodyState> states, IslandReport& report,
                    std::vector<AdvanceFault>& faults) {
  articulated.motion.start(states);
  const int fewest = substeps_of(articulated, kLongestParts);
  if (fewest == 0) return false;
  KickErrors errors(sizes, articulated.island.ids);
  if (!advance_by_second(articulated, most_relative_error, fewest, errors, states, report) &&
      !advance_by_fourth(articulated, most_relative_error, fewest, sizes, states, report))
    return false;
  take_states(articulated, states, faults);
  return true;
}

}  // namespace

bool advance_articulated_to_tolerance(const IslandStep& island, JointSystem& joints,
                                      std::span<BodyState> states, IslandReport& report,
                                      std::vector<AdvanceFault>& faults) {
  const SceneDescription& scene = island.scene;
  for (const BodyId id : island.ids)
    if (is_pushed(scene.bodies[index_of(id)])) return false;
  if (joints.bounded || has_springs(scene, joints)) return false;
  const double most_relative_error = scene.tolerance * (island.dt_s / scene.dt_s);
  const BodySizes sizes = sizes_of(scene, island.geometry, island.ids);
  return with_articulated(island, joints, [&](const ArticulatedIsland& articulated) {
    return advance_within(articulated, most_relative_error, sizes, states, report, faults);
  });
}

}  // namespace soda::physics
