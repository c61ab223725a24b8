// What changes the bodies of a world between two steps: some have left, some migrate in, users act.
#pragma once

#include <vector>

#include "models/messages/messages.hpp"
#include "models/territory/territory.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// What the messages for the beginning of a step bring, but for user input.
struct Arrivals {
  std::vector<Migrant> migrants;
  std::vector<WorldId> sources;  // of migrants, in the order of the messages
  std::vector<CellTransfer> transfers;
};
Arrivals read_arrivals(Bag bag);

// Bodies whose centre is in no cell of the world stay no longer. `states[i]` is of ids[i].
void drop_foreign(const TerritoryMap& map, WorldId self, std::vector<physics::BodyId>& ids,
                  std::vector<physics::BodyState>& states);

// Migrants join the own bodies; returns those that did, ascending by id. While a migration is being
// rolled back an id can arrive twice or be here still: the body that is here wins, then the one
// from the lowest source, whatever the order of arrival.
std::vector<Migrant> merge_migrants(std::vector<Migrant> migrants,
                                    std::vector<physics::BodyId>& ids,
                                    std::vector<physics::BodyState>& states);

// User input: acts on the step's own bodies and rules. Every world hears of every input, for all of
// them keep the same account of which bodies take part and what they are made of; the owner alone,
// or the world that owns the place, acts on the body. Returns the bodies that were touched here,
// ascending.
std::vector<physics::BodyId> take_inputs(StepInProgress& step, Bag bag);

}  // namespace soda::models
