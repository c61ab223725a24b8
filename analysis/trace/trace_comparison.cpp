#include "analysis/trace/trace_comparison.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include "analysis/trace/recorded_walk.hpp"
#include "analysis/trace/trace_records.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

// All that comes out again, if it is the same: not when it was, nor how long it took.
auto deed_of(const TraceRecord& record) {
  const bool has_time = record.what != Happening::kSettled;
  return std::tuple(record.what, has_time ? record.time : kernel::kBeginning, record.other,
                    record.peer, record.kind, record.slot, record.version, record.anti,
                    record.anew);
}

}  // namespace

void add_to_histories(const TraceRecord& record, WorldHistories& histories) {
  if (record.what == Happening::kGvt || record.what == Happening::kCommitted ||
      record.what == Happening::kCost)
    return;
  TraceRecord& kept = histories[kernel::index_of(record.lp)].emplace_back(record);
  kept.took_ns = 0;
  kept.note = {};
}

WorldHistories histories_of(LogReader& log, std::uint32_t worlds) {
  WorldHistories histories(worlds);
  read_records(log, worlds, [&histories](std::uint32_t, const TraceRecord& record) {
    add_to_histories(record, histories);
  });
  return histories;
}

std::vector<HistoryDifference> differences_of(const WorldHistories& first,
                                              const WorldHistories& second) {
  std::vector<HistoryDifference> differences;
  for (std::uint32_t world = 0; world < first.size(); ++world) {
    const auto [a, b] = std::ranges::mismatch(first[world], second[world], {}, deed_of, deed_of);
    const bool has_a = a != first[world].end(), has_b = b != second[world].end();
    if (!has_a && !has_b) continue;
    HistoryDifference& found = differences.emplace_back();
    found.world = world;
    found.happening = static_cast<std::size_t>(a - first[world].begin()) + 1;
    found.clock_ns = std::numeric_limits<std::int64_t>::max();
    if (has_a) found.first = *a;
    if (has_b) found.second = *b;
    for (const auto& side : {found.first, found.second})
      if (side) found.clock_ns = std::min(found.clock_ns, side->clock_ns);
  }
  std::ranges::stable_sort(differences, {}, &HistoryDifference::clock_ns);
  return differences;
}

std::string side_text(const std::optional<TraceRecord>& side) {
  return side ? happening_text({*side, 0}) : "nothing";
}

}  // namespace soda::analysis
