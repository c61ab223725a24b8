// Steps of a log with some bodies, for tests.
#pragma once

#include <cstdint>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/measures/error_measures.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis_test {

inline const std::vector<std::uint32_t> kLabels = {3, 7, 40};

inline std::vector<physics::BodyState> states_at(std::int64_t step) {
  std::vector<physics::BodyState> states(kLabels.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double x = 0.1 * static_cast<double>(step) + static_cast<double>(i);
    states[i].position_m = physics::Vec3(x, -0.0, 1e-300);
    states[i].linear_velocity_m_s = physics::Vec3(1.0 / 3.0, x * x, -x);
  }
  states[1].impulses.push_back(
      {static_cast<physics::BodyId>(2), 1, 5, 0.25, {1.0, 2.0, 0.5 * static_cast<double>(step)}});
  return states;
}

inline std::uint64_t digest_of(const std::vector<physics::BodyState>& states) {
  return physics::digest(analysis::all_ids(states.size()), states);
}

inline analysis::LoggedStep logged_step(std::int64_t step, std::uint64_t digest,
                                        const std::vector<physics::BodyState>& states) {
  return {step, digest, true, analysis::all_ids(states.size()), states, {}, {}};
}

}  // namespace soda::analysis_test
