#include "analysis/search/swarm_process.hpp"

#include <cstring>

#include "analysis/process/isolated_process.hpp"

namespace soda::analysis {

TrialOutcome run_isolated(const SwarmSubject& subject, const Trial& trial, bool record) {
  const ChildOutcome child = run_in_child([&](ChildResults& results) {
    if (record)
      run_trial(subject, trial, [&](const kernel::Decision& decision) { results.write(decision); });
    else
      results.write(run_trial(subject, trial));
  });
  TrialOutcome outcome;
  outcome.failed = child.failed;
  outcome.what = child.what;
  if (record) {
    outcome.decisions.resize(child.bytes.size() / sizeof(kernel::Decision));
    std::memcpy(outcome.decisions.data(), child.bytes.data(),
                outcome.decisions.size() * sizeof(kernel::Decision));
  } else if (!child.failed && child.bytes.size() == sizeof outcome.sums) {
    std::memcpy(&outcome.sums, child.bytes.data(), sizeof outcome.sums);
  }
  return outcome;
}

}  // namespace soda::analysis
