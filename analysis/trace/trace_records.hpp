// The records of the trace in an event log, read and checked, in the orders that commands need.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "kernel/api/event_recorder.hpp"

namespace soda::analysis {

// All below throw UsageError if the log has no trace, and FileError for what no soda wrote: worlds,
// kinds and bodies are checked. A record's note is there as long as the call.
using OnRecord = std::function<void(std::uint32_t worker, const kernel::TraceRecord& record)>;

// One worker after the other, of each in order.
void read_records(LogReader& log, std::uint32_t worlds, const OnRecord& on_record);

// All workers by their clocks; what has the same clock stays in order, by workers. An execution
// stands at its begin, so before what it has sent.
void read_records_by_clock(LogReader& log, std::uint32_t worlds, const OnRecord& on_record);

// The same, but nothing arrives before it was sent: clocks of workers may differ a little, and
// those of ranks more. What arrives and was sent in a part that the log has not stands by its
// clock.
void read_records_by_cause(LogReader& log, std::uint32_t worlds, const OnRecord& on_record);

// The bodies that a record's note names.
std::vector<std::uint32_t> noted_bodies(const kernel::TraceRecord& record);
// What a rewound world refused to absorb.
kernel::Refusal noted_refusal(const kernel::TraceRecord& record);

}  // namespace soda::analysis
