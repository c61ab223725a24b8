#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"

namespace soda::models {

std::uint64_t final_digest(const SimulationResult& result) {
  if (result.final_ids.size() == result.final_states.size())
    return physics::digest(result.final_ids, result.final_states);
  std::vector<physics::BodyState> states;
  for (const physics::BodyId id : result.final_ids)
    states.push_back(result.final_states[physics::index_of(id)]);
  return physics::digest(result.final_ids, states);
}

}  // namespace soda::models
