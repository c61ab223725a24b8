#include "analysis/trace/recorded_order.hpp"

#include <algorithm>
#include <tuple>

#include "analysis/exit_codes.hpp"
#include "analysis/logged_run.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "analysis/trace/trace_words.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

// All of a happening that must come out again: not when it was, nor how long it took.
struct Deed {
  Happening what{};
  kernel::VirtualTime time, other;
  kernel::LpId peer{};
  std::uint32_t kind = 0, slot = 0;
  std::uint64_t incarnation = 0;
  bool anti = false, anew = false;

  friend bool operator==(const Deed&, const Deed&) = default;
};

using Deeds = std::vector<std::vector<Deed>>;  // of each world

void add(const TraceRecord& record, Deeds& deeds) {
  if (record.what == Happening::kGvt || record.what == Happening::kCommitted ||
      record.what == Happening::kCost)
    return;
  const bool has_time = record.what != Happening::kSettled;
  deeds[kernel::index_of(record.lp)].push_back(
      {record.what, has_time ? record.time : kernel::kBeginning, record.other, record.peer,
       record.kind, record.slot, record.incarnation, record.anti, record.anew});
}

std::string words_for(const std::vector<Deed>& deeds, std::size_t at) {
  if (at >= deeds.size()) return "nothing";
  const Deed& deed = deeds[at];
  std::string text = happening_words(deed.what);
  if (deed.what != Happening::kSettled) text += " " + words_of(deed.time);
  if (deed.incarnation > 0)
    text += ", number " + std::to_string(deed.incarnation) + " with " +
            world_words(kernel::index_of(deed.peer));
  return text;
}

void refuse_repetition(const LogReader& log, const std::string& why) {
  throw UsageError("--as-executed: " + log.file() + " " + why);
}

}  // namespace

kernel::RecordedOrder recorded_order(LogReader& log, scenarios::Scenario& scenario) {
  const std::int64_t asked = asked_steps(log);
  if (!log.complete() || log.last_step() < asked)
    refuse_repetition(log, "is of a run that ended early");
  if (scenario.run.inputs.any()) refuse_repetition(log, "is of a run with user input");
  if (scenario.run.balancing.policy != models::BalancingPolicy::kOff)
    refuse_repetition(log, "is of a run with balancing");
  const std::uint32_t worlds = scenario.territory.worlds;
  if (worlds == 1 || scenario.run.executor == models::ExecutorKind::kSequential)
    refuse_repetition(log, "is of a run in sequence");
  scenario.run.steps = asked;
  kernel::RecordedOrder order;
  read_records(log, worlds, [&order](std::uint32_t worker, const TraceRecord& record) {
    if (worker >= order.size()) order.resize(worker + 1);
    if (record.what == Happening::kArrived || record.what == Happening::kSettled ||
        record.what == Happening::kExecuted || record.what == Happening::kGvt)
      order[worker].push_back(
          {record.what, record.lp, record.peer, record.time, record.incarnation});
  });
  return order;
}

std::optional<std::string> trace_divergence(LogReader& log, std::uint32_t worlds,
                                            std::span<const kernel::Bytes> chunks) {
  Deeds logged(worlds), now(worlds);
  read_records(log, worlds,
               [&logged](std::uint32_t, const TraceRecord& record) { add(record, logged); });
  for (const kernel::Bytes& bytes : chunks) {
    kernel::TraceChunk chunk(bytes);
    for (TraceRecord record; chunk.next(record);) add(record, now);
  }
  for (std::uint32_t world = 0; world < worlds; ++world) {
    if (logged[world] == now[world]) continue;
    const auto at = static_cast<std::size_t>(std::ranges::mismatch(logged[world], now[world]).in1 -
                                             logged[world].begin());
    return "world " + std::to_string(world) + ", happening " + std::to_string(at) + ": logged " +
           words_for(logged[world], at) + ", now " + words_for(now[world], at);
  }
  return std::nullopt;
}

}  // namespace soda::analysis
