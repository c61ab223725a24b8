#include "kernel/executors/distributed_executor.hpp"

#include <utility>

#include "kernel/api/invariant.hpp"
#include "kernel/api/partition.hpp"
#include "kernel/api/wire.hpp"
#include "kernel/executors/rank_link.hpp"
#include "kernel/executors/worker_group.hpp"

namespace soda::kernel {
namespace {

Partition all_workers(const Transport& transport, unsigned threads, std::size_t lps) {
  return {lps, std::size_t{threads} * transport.size()};
}

Bytes encode(const RunResult& result) {
  Bytes bytes;
  append_plain(bytes, result.counters);
  append_plain(bytes, result.kinds);
  append_plain(bytes, result.account.value_or(TimeAccount{}));
  // The text of a fault is known where its LP lives.
  const bool tells = result.fault && !result.fault->fault.what.empty();
  append_number(bytes, static_cast<std::uint8_t>(tells));
  if (!tells) return bytes;
  append_number(bytes, result.fault->fault.subject);
  const std::string& what = result.fault->fault.what;
  const auto text = std::as_bytes(std::span(what));
  bytes.insert(bytes.end(), text.begin(), text.end());
  return bytes;
}

void add(std::span<const std::byte> bytes, RunResult& sum) {
  sum.counters += take_plain<Counters>(bytes);
  sum.kinds += take_plain<EventCounts>(bytes);
  const TimeAccount account = take_plain<TimeAccount>(bytes);
  if (sum.account) *sum.account += account;
  if (take_number<std::uint8_t>(bytes) == 0) return;
  SODA_ASSERT(sum.fault.has_value(), "a fault that the root does not know");
  sum.fault->fault.subject = take_number<decltype(Fault::subject)>(bytes);
  sum.fault->fault.what.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

}  // namespace

LpRange own_lps(const Transport& transport, unsigned threads, std::size_t lps) {
  const Partition partition = all_workers(transport, threads, lps);
  const std::size_t first_worker = std::size_t{threads} * transport.rank();
  return {static_cast<std::uint32_t>(partition.first_of(first_worker)),
          static_cast<std::uint32_t>(partition.first_of(first_worker + threads))};
}

RunResult run_distributed(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const ThreadsOptions& options, Transport& transport,
                          const RecordHooks& records, const ProgressFn& progress) {
  const Transport::Agreement all_here = transport.agree(0);
  if (all_here.code != 0) throw PeerFailed{all_here.code};
  transport.set_runs(true);

  RankLink link(transport, records);
  WorkerGroup group(all_workers(transport, options.threads, lps.size()),
                    std::size_t{options.threads} * transport.rank(), options.threads, &link);
  RunResult own = run_worker_group(group, lps, end, options, progress);
  link.close();

  const std::vector<Bytes> all = transport.gather(encode(own));
  transport.set_runs(false);
  if (!transport.is_root()) return own;
  RunResult sum;
  if (own.account) sum.account.emplace();
  sum.fault = std::move(own.fault);
  sum.stopped = own.stopped;
  sum.stopped_at = own.stopped_at;
  for (const Bytes& bytes : all) add(bytes, sum);
  // Rounds of different ranks are not the same rounds: the root's own are reported.
  sum.counters.gvt_rounds = own.counters.gvt_rounds;
  return sum;
}

}  // namespace soda::kernel
