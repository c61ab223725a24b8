#include "kernel/api/counters.hpp"

#include <algorithm>

namespace soda::kernel {
namespace {

constexpr KernelPath kPaths[] = {
    {"alone", &Counters::alone},
    {"batches", &Counters::batches},
    {"shuffled", &Counters::shuffled},
    {"in_order", &Counters::in_order},
    {"taken_back", &Counters::taken_back},
    {"stragglers", &Counters::stragglers},
    {"absorbed", &Counters::absorbed},
    {"rollbacks", &Counters::rollbacks},
    {"coasted", &Counters::coasted},
    {"jumps", &Counters::jumps},
    {"adopted", &Counters::adopted},
    {"anti_messages", &Counters::anti_messages},
    {"withdrawn", &Counters::withdrawn},
    {"held", &Counters::held},
    {"failed", &Counters::failed},
    {"to_threads", &Counters::to_threads},
    {"to_ranks", &Counters::to_ranks},
    {"full_rounds", &Counters::full_rounds},
    {"timed_rounds", &Counters::timed_rounds},
    {"idle_rounds", &Counters::idle_rounds},
};

}  // namespace

std::span<const KernelPath> kernel_paths() { return kPaths; }

Counters& operator+=(Counters& sum, const Counters& more) {
  for (const KernelPath& path : kPaths) sum.*path.count += more.*path.count;
  sum.executed += more.executed;
  sum.rolled_back += more.rolled_back;
  sum.committed += more.committed;
  sum.messages += more.messages;
  sum.gvt_rounds += more.gvt_rounds;
  sum.lead_sum += more.lead_sum;
  sum.lead_max = std::max(sum.lead_max, more.lead_max);
  sum.history_max = std::max(sum.history_max, more.history_max);
  return sum;
}

}  // namespace soda::kernel
