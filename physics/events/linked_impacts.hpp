// Impacts of what joints hold: a row of balls on strings hands its speed on.
#pragma once

#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

struct Touching {
  BodyId a{}, b{};
};

// Whether impacts of an island with joints are found in time: something can bounce, and its joints
// are not swept, which would be too much work.
bool bounce_in_time(const IslandStep& island, std::span<const BodyState> states);

// Pairs that are no rows of a part, but are to be located: they can bounce, and neither touch and
// come nearer nor pressed in the step before, nor are they `held`. And the others.
struct BouncesInTime {
  std::vector<Touching> pairs;
  std::vector<ContactManifold> others;
};
BouncesInTime find_bounces_in_time(const IslandStep& island,
                                   std::span<const ContactManifold> manifolds,
                                   std::span<const Touching> held,
                                   std::span<const BodyState> states);

// Whether one of them has come to overlap by a thousandth of its width in a part that it was no row
// of.
bool have_missed_one(const IslandStep& island, std::span<const Touching> pairs,
                     std::span<const BodyState> before, std::span<const BodyState> after);

// Points that touch and approach each other faster than the restitution threshold bounce, all of
// them at once, with friction and with what the joints of the island do; and so do those that come
// nearer by that, until none does. Limits and motors do nothing. Velocities change, places do not;
// no impact gives energy. Rows of the part that follows have to hold what is left after many
// rounds. Returns whether anything has changed: then there are other pairs ahead.
bool resolve_linked_impacts(const IslandStep& island, std::span<const ContactManifold> manifolds,
                            std::span<BodyState> states, IslandReport& report,
                            StageCounters& counters);

// What impacts told, to the report of the parts.
void add_bounces(const IslandReport& bounces, IslandReport& report);

}  // namespace soda::physics
