#include "kernel/virtual_cluster/virtual_executor.hpp"

#include "kernel/api/invariant.hpp"
#include "kernel/virtual_cluster/virtual_cluster.hpp"

namespace soda::kernel {
namespace {

VirtualResult run_as_asked(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                           const VirtualOptions& options, const ProgressFn& progress) {
  if (options.synchronisation == Synchronisation::kLockstep)
    return run_virtual_lockstep(lps, end, options, progress);
  return VirtualCluster(lps, end, options, progress).run();
}

}  // namespace

VirtualResult run_virtual(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const VirtualOptions& options, const ProgressFn& progress) {
  SODA_ASSERT(options.processors >= 1 && options.window >= 0 && options.latency_ns >= 0 &&
                  options.jitter_ns >= 0 && options.gvt_interval_ns >= 0 &&
                  options.gvt_delay_ns >= 0,
              "processors ", options.processors, ", window ", options.window, ", latency ",
              options.latency_ns, " ns, jitter ", options.jitter_ns, " ns, GVT ",
              options.gvt_interval_ns, " and ", options.gvt_delay_ns, " ns");
  if (lps.empty()) return {};
  VirtualResult result =
      options.observer ? run_as_asked(observed(lps, *options.observer), end, options, progress)
                       : run_as_asked(lps, end, options, progress);
  raise_failure(result.run);
  return result;
}

}  // namespace soda::kernel
