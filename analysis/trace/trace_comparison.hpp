// Two traces, world by world: the first happening that differs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "kernel/api/event_recorder.hpp"

namespace soda::analysis {

// Of each world what happened to it, without what may lie elsewhere when all is the same: GVT,
// commits and costs. Notes are left out.
using WorldHistories = std::vector<std::vector<kernel::TraceRecord>>;

// Adds the record to the history of its world, if it belongs there.
void add_to_histories(const kernel::TraceRecord& record, WorldHistories& histories);
// Of all records of the log. Throws as read_records().
WorldHistories histories_of(LogReader& log, std::uint32_t worlds);

struct HistoryDifference {
  std::uint32_t world = 0;
  std::size_t happening = 0;                         // of this world, from 1
  std::optional<kernel::TraceRecord> first, second;  // none: that history ends before
  std::int64_t clock_ns = 0;                         // of the earlier one
};
// One for each world whose histories, of as many worlds, are not the same but for the clock; in the
// order of their clocks.
std::vector<HistoryDifference> differences_of(const WorldHistories& first,
                                              const WorldHistories& second);
// The sentence of what happened; "nothing" of none.
std::string side_text(const std::optional<kernel::TraceRecord>& side);

}  // namespace soda::analysis
