#include "kernel/api/execution_times.hpp"

#include <algorithm>
#include <utility>

namespace soda::kernel {

ExecutionTimes::OfLp& ExecutionTimes::of(LpId lp) {
  if (index_of(lp) >= lps_.size()) lps_.resize(index_of(lp) + 1);
  return lps_[index_of(lp)];
}

void ExecutionTimes::executed(LpId lp, VirtualTime time, std::int64_t took_ns) {
  executed_ns_ += took_ns;
  of(lp).standing.emplace_back(time, took_ns);
}

// What was absorbed has stood without an execution: then there is nothing to undo.
void ExecutionTimes::rolled_back(LpId lp, VirtualTime time) {
  auto& [standing, undone] = of(lp);
  if (standing.empty() || standing.back().first != time) return;
  undone.insert_or_assign(time, standing.back().second);
  standing.pop_back();
}

void ExecutionTimes::put_back(LpId lp, VirtualTime time) {
  auto& [standing, undone] = of(lp);
  const auto found = undone.find(time);
  if (found == undone.end()) return;
  standing.emplace_back(time, found->second);
  undone.erase(found);
}

void ExecutionTimes::committed(LpId lp, VirtualTime time) {
  auto& [standing, undone] = of(lp);
  for (; !standing.empty() && standing.front().first <= time; standing.pop_front())
    committed_ns_ += standing.front().second;
  undone.erase(undone.begin(), undone.upper_bound(time));
}

}  // namespace soda::kernel
