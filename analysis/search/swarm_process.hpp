// Trials in processes of their own: a broken invariant aborts, and must not end the search.
#pragma once

#include <string>
#include <vector>

#include "analysis/search/swarm_trial.hpp"

namespace soda::analysis {

struct TrialOutcome {
  bool failed = false;
  std::string what;  // the violation, or what the process wrote before it died
  TrialSums sums;    // if it did not fail
  std::vector<kernel::Decision> decisions;  // if recorded
};

// Runs the trial in a forked child and waits for it. `record`: collect the adversary's decisions,
// also of a child that dies. To be called from a program with one thread. Throws CheckFailed if no
// process can be made.
TrialOutcome run_isolated(const SwarmSubject& subject, const Trial& trial, bool record = false);

}  // namespace soda::analysis
