// Linkages to a tolerance: how many parts, of which order.
#include <cmath>

#include "physics/forces/forces.hpp"
#include "physics/integrators/linkage.hpp"
#include "physics/integrators/linkage_parts.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {
namespace {

constexpr double kWanted = 0.7;  // of the tolerance: what a new number of parts is aimed at
constexpr int kMostTries = 3;

// How many parts there have to be where `parts` are off by some widths, to be off by no more than
// are wanted; infinite numbers included. What ways are taken to be off by falls with the square of
// the number, what velocities are with the number.
double parts_for(double widths, double wanted_widths, int parts) {
  constexpr double kOfWays = 2.0 / 3.0;  // of one part that takes the whole step
  const double ways = kOfWays / parts / (kOfWays / parts + (1.0 - kOfWays));
  const double half = 0.5 * (1.0 - ways) * widths / wanted_widths;
  return parts * (half + std::sqrt(half * half + ways * widths / wanted_widths));
}

// In parts of the second order, as long as they cost less than those of the fourth.
bool advance_by_second(const Linkage& linkage, double most_widths, int fewest, KickErrors& errors,
                       std::span<const BodyState> states, IslandReport& report) {
  constexpr int kMost = 15;  // times the fewest: stages of the least that the fourth order takes
  double wanted = fewest;
  for (int tries = 0; tries < kMostTries && wanted <= kMost * fewest; ++tries) {
    if (tries > 0) linkage.motion.start(states);
    errors.restart();
    IslandReport linked = report;
    const Parts parts{static_cast<int>(wanted), false, true};
    const bool holds = advance_parts(linkage, parts, &errors, linked);
    if (holds && errors.widths() <= most_widths) {
      report = linked;
      errors.tell(report);
      return true;
    }
    wanted = holds ? parts_for(errors.widths(), kWanted * most_widths, parts.count) + 1.0
                   : 2.0 * parts.count;
  }
  return false;
}

// In parts of the fourth order, and again in twice as many: these are off by a fifteenth of what
// the two differ by; a quarter is counted.
bool advance_by_fourth(const Linkage& linkage, double most_widths, int fewest,
                       const BodySizes& sizes, std::span<const BodyState> states,
                       IslandReport& report) {
  constexpr double kCounted = 0.25;
  constexpr int kMost = 128;
  double wanted = fewest;
  for (int tries = 0; tries < kMostTries && wanted <= kMost; ++tries) {
    const int parts = static_cast<int>(wanted);
    IslandReport coarse = report, fine = report;
    linkage.motion.start(states);
    bool holds = advance_parts(linkage, {parts, true, true}, nullptr, coarse);
    const std::span<const BodyState> reached = linkage.motion.states();
    const std::vector<BodyState> before(reached.begin(), reached.end());
    linkage.motion.start(states);
    holds = holds && advance_parts(linkage, {2 * parts, true, true}, nullptr, fine);
    StepError error = apart_of(sizes, before, linkage.motion.states());
    error.widths *= kCounted;
    if (holds && error.widths <= most_widths) {
      report = fine;
      report.error_estimate = error.widths;
      report.worst_body = linkage.island.ids[error.body];
      return true;
    }
    wanted *= holds ? 1.0 + std::sqrt(std::sqrt(error.widths / (kWanted * most_widths))) : 2.0;
  }
  return false;
}

bool advance_within(const Linkage& linkage, double most_widths, const BodySizes& sizes,
                    std::span<BodyState> states, IslandReport& report,
                    std::vector<AdvanceFault>& faults) {
  linkage.motion.start(states);
  const int fewest = substeps_of(linkage, kLongestParts);
  if (fewest == 0) return false;
  KickErrors errors(sizes, linkage.island.ids);
  if (!advance_by_second(linkage, most_widths, fewest, errors, states, report) &&
      !advance_by_fourth(linkage, most_widths, fewest, sizes, states, report))
    return false;
  take_states(linkage, states, faults);
  return true;
}

}  // namespace

bool advance_linkage_to_tolerance(const IslandStep& island, JointSystem& joints,
                                  std::span<BodyState> states, IslandReport& report,
                                  std::vector<AdvanceFault>& faults) {
  const SceneDescription& scene = island.scene;
  for (const BodyId id : island.ids)
    if (is_pushed(scene.bodies[index_of(id)])) return false;
  if (joints.bounded || has_springs(scene, joints)) return false;
  const double most_widths = scene.tolerance * (island.dt_s / scene.dt_s);
  const BodySizes sizes = sizes_of(scene, island.geometry, island.ids);
  return with_linkage(island, joints, [&](const Linkage& linkage) {
    return advance_within(linkage, most_widths, sizes, states, report, faults);
  });
}

}  // namespace soda::physics
