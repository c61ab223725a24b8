// The scenario of an event log, as it was run, and what a step is in it.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/runs/overrides.hpp"
#include "models/territory/territory.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// As logged, with the options of that run and then `overrides`; to be run as far as the log goes.
// Its inputs are those that acted, wherever they came from, at the steps at which they did. Reads
// all steps. Throws FileError if they, or the bodies, are none of the logged scenario.
scenarios::Scenario logged_scenario(LogReader& log, const Overrides& overrides);

// The same run, to go on from step `from` of the log, with inputs that had not acted then: those
// that the log knows to come, and the scenario's. `options` get those of the logged run where they
// say nothing. Throws UsageError if the log has no states of that step, or the run was to end
// before it.
scenarios::Scenario resumed_scenario(LogReader& log, std::int64_t from, Overrides& options);

// The same but for the states, which are void, and with no more of the scenario than `extent` says:
// for who reads the states that it needs (`ids`: who is there). The log has some of that step.
scenarios::Scenario resumed_without_states(LogReader& log, std::int64_t from,
                                           std::span<const physics::BodyId> ids,
                                           scenarios::ScenarioExtent extent, Overrides& options);

// Throws FileError for a state whose contacts or joints the scene has not.
void check_state(const LogReader& log, std::int64_t step, const physics::BodyState& state,
                 const physics::SceneDescription& scene);

// Throws FileError for a state that is no number: no run has committed it.
void require_numbers(const LogReader& log, const LoggedStep& logged);

// The territories after what changed at the beginning of the step that led to `logged`.
void follow_changes(const LoggedStep& logged, models::TerritoryMap& map);

// Of each body of the step, the place in `ids` of the first one of its island: what contacts that
// bear something and whole joints hold together. A body that nothing holds is an island.
std::vector<std::uint32_t> islands_of(const LoggedStep& logged,
                                      const physics::SceneDescription& scene);

// How many steps the logged run was to have.
std::int64_t asked_steps(const LogReader& log);

// Says where the log is cut off or damaged, if it is.
void tell_flaws(const LogReader& log, const std::string& file, std::ostream& err);

}  // namespace soda::analysis
