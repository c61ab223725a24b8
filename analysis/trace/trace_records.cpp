#include "analysis/trace/trace_records.hpp"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <queue>
#include <set>
#include <utility>

#include "analysis/text/exit_codes.hpp"
#include "kernel/api/external_source.hpp"
#include "kernel/api/wire.hpp"
#include "models/world/event_kinds.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

// Those of many ranks can be more than there are worlds. What is kept for each is little.
constexpr std::uint32_t kMostWorkers = 1u << 20;

void refuse_unless(bool holds, const std::string& what) {
  if (!holds) throw DecodeError(what);
}

// What a world, a message or a body is called must be there.
void check(const TraceRecord& record, std::uint32_t worlds, std::size_t bodies) {
  // Times that sums of them can hold.
  refuse_unless(record.took_ns >= 0 && record.took_ns < std::int64_t{1} << 45 &&
                    std::abs(record.clock_ns / 2) < std::int64_t{1} << 55,
                "tells of a time beyond any run");
  const auto is_time = [](kernel::VirtualTime time) {
    return time == kernel::kNever || time == kernel::kBeginning ||
           std::abs(time.t / 2) < std::int64_t{1} << 53;
  };
  refuse_unless(is_time(record.time) && is_time(record.other), "tells of a step beyond any run");
  const auto is_world = [worlds](kernel::LpId lp) { return kernel::index_of(lp) < worlds; };
  if (record.what == Happening::kGvt) return;
  refuse_unless(is_world(record.lp),
                "tells of world " + std::to_string(kernel::index_of(record.lp)));
  if (is_of_message(record.what)) {
    const bool comes = record.what == Happening::kArrived || record.what == Happening::kLate;
    refuse_unless(is_world(record.peer) || (comes && record.peer == kernel::kExternalSource),
                  "tells of world " + std::to_string(kernel::index_of(record.peer)));
    refuse_unless(record.kind < models::message_kinds().size(),
                  "tells of a message of kind " + std::to_string(record.kind));
  }
  if (record.what == Happening::kLate) {
    refuse_unless(record.note.size() % 4 == 0, "names half a body");
    for (const std::uint32_t body : noted_bodies(record))
      refuse_unless(body < bodies, "tells of body id " + std::to_string(body));
  }
  if (record.what == Happening::kRewound) {
    refuse_unless(record.note.size() == sizeof(std::uint32_t) + 2 * sizeof(std::uint64_t),
                  "tells of a rollback without its reason");
    refuse_unless(noted_refusal(record).code < models::kRefusals, "tells of a reason that is none");
  }
}

// The chunks of every worker, and each when it is asked for.
class ChunkedTrace {
 public:
  ChunkedTrace(LogReader& log, std::uint32_t worlds) : log_(log), worlds_(worlds) {
    if (log.options().level != LogLevel::kTrace)
      throw UsageError(log.file() + ": has no trace; soda run --log-level trace writes it");
    for (std::size_t i = 0; i < log.traces(); ++i) {
      const kernel::Bytes bytes = log.read_trace(i);
      const std::uint32_t worker = kernel::TraceChunk(bytes).worker();
      naming(i, [worker] {
        refuse_unless(worker < kMostWorkers, "tells of worker " + std::to_string(worker));
      });
      chunks_[worker].push_back(i);
    }
  }

  // By worker, in order.
  const std::map<std::uint32_t, std::vector<std::size_t>>& chunks() const { return chunks_; }

  // Calls `on_record` for each; DecodeErrors of it, too, are told with the block.
  template <class Function>
  void read(std::size_t place, const kernel::Bytes& bytes, Function on_record) const {
    naming(place, [&] {
      kernel::TraceChunk chunk(bytes);
      for (TraceRecord record; chunk.next(record);) {
        check(record, worlds_, log_.labels().size());
        on_record(record);
      }
      refuse_unless(chunk.is_sound(), "ends inside a record");
    });
  }
  kernel::Bytes bytes(std::size_t place) const { return log_.read_trace(place); }

 private:
  template <class Function>
  void naming(std::size_t place, Function function) const {
    try {
      function();
    } catch (const DecodeError& fault) {
      throw scenarios::FileError(log_.file() + ": trace block " + std::to_string(place) + ": " +
                                 fault.what());
    }
  }

  LogReader& log_;
  const std::uint32_t worlds_;
  std::map<std::uint32_t, std::vector<std::size_t>> chunks_;
};

// Of one worker, by its clock. A recorder ends no chunk inside an execution, so it is enough to
// sort within one.
class WorkerRecords {
 public:
  WorkerRecords(const ChunkedTrace& trace, std::span<const std::size_t> chunks)
      : trace_(trace), left_(chunks) {
    read_on();
  }

  bool has_more() const { return next_ < records_.size(); }
  const TraceRecord& next() const { return records_[next_]; }
  void pop() {
    if (++next_ == records_.size()) read_on();
  }

 private:
  void read_on() {
    next_ = 0;
    records_.clear();
    while (records_.empty() && !left_.empty()) {
      bytes_ = trace_.bytes(left_.front());
      trace_.read(left_.front(), bytes_,
                  [this](const TraceRecord& record) { records_.push_back(record); });
      left_ = left_.subspan(1);
    }
    std::ranges::stable_sort(records_, {}, &TraceRecord::clock_ns);
  }

  const ChunkedTrace& trace_;
  std::span<const std::size_t> left_;
  kernel::Bytes bytes_;  // in which notes of records_ lie
  std::vector<TraceRecord> records_;
  std::size_t next_ = 0;
};

// Merges the workers.
class MergedRecords {
 public:
  MergedRecords(const ChunkedTrace& trace, bool by_cause) : by_cause_(by_cause) {
    for (const auto& [worker, chunks] : trace.chunks()) {
      workers_.emplace(worker, WorkerRecords(trace, chunks));
      offer(worker);
    }
  }

  void read(const OnRecord& on_record) {
    for (;;) {
      if (heads_.empty() && !release_one()) return;
      const std::uint32_t worker = heads_.top().second;
      heads_.pop();
      WorkerRecords& records = workers_.at(worker);
      const TraceRecord& record = records.next();
      if (by_cause_ && record.what == Happening::kSent) was_sent({record.lp, record.version});
      if (by_cause_ && record.what == Happening::kArrived)
        sent_.erase({record.peer, record.version});
      on_record(worker, record);
      records.pop();
      offer(worker);
    }
  }

 private:
  using MessageName = std::pair<kernel::LpId, std::uint64_t>;

  // Its next record; but not what cannot have arrived yet.
  void offer(std::uint32_t worker) {
    const WorkerRecords& records = workers_.at(worker);
    if (!records.has_more()) return;
    const TraceRecord& record = records.next();
    const MessageName name{record.peer, record.version};
    const bool waits = by_cause_ && record.what == Happening::kArrived &&
                       record.peer != kernel::kExternalSource && !sent_.contains(name);
    if (waits)
      waiting_.emplace(name, worker);
    else
      heads_.emplace(record.clock_ns, worker);
  }

  void was_sent(const MessageName& name) {
    sent_.insert(name);
    const auto [first, last] = waiting_.equal_range(name);
    for (auto waits = first; waits != last; ++waits)
      heads_.emplace(workers_.at(waits->second).next().clock_ns, waits->second);
    waiting_.erase(first, last);
  }

  // When all wait for what is sent nowhere: the one that came first.
  bool release_one() {
    const auto first = std::ranges::min_element(waiting_, {}, [this](const auto& waits) {
      return std::pair(workers_.at(waits.second).next().clock_ns, waits.second);
    });
    if (first == waiting_.end()) return false;
    heads_.emplace(workers_.at(first->second).next().clock_ns, first->second);
    waiting_.erase(first);
    return true;
  }

  using Head = std::pair<std::int64_t, std::uint32_t>;  // clock, worker
  const bool by_cause_;
  std::map<std::uint32_t, WorkerRecords> workers_;
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::multimap<MessageName, std::uint32_t> waiting_;  // for what has not been sent
  std::set<MessageName> sent_;                         // and not arrived
};

}  // namespace

std::vector<std::uint32_t> noted_bodies(const TraceRecord& record) {
  std::vector<std::uint32_t> bodies;
  for (std::span<const std::byte> left = record.note; left.size() >= sizeof(std::uint32_t);)
    bodies.push_back(kernel::take_number<std::uint32_t>(left));
  return bodies;
}

kernel::Refusal noted_refusal(const TraceRecord& record) {
  std::span<const std::byte> left = record.note;
  kernel::Refusal refusal;
  refusal.code = kernel::take_number<std::uint32_t>(left);
  refusal.subject = kernel::take_number<std::uint64_t>(left);
  refusal.other = kernel::take_number<std::uint64_t>(left);
  return refusal;
}

void read_records(LogReader& log, std::uint32_t worlds, const OnRecord& on_record) {
  const ChunkedTrace trace(log, worlds);
  for (const auto& [worker, places] : trace.chunks())
    for (const std::size_t place : places) {
      const kernel::Bytes bytes = trace.bytes(place);
      trace.read(place, bytes, [&](const TraceRecord& record) { on_record(worker, record); });
    }
}

void read_records_by_clock(LogReader& log, std::uint32_t worlds, const OnRecord& on_record) {
  const ChunkedTrace trace(log, worlds);
  MergedRecords(trace, false).read(on_record);
}

void read_records_by_cause(LogReader& log, std::uint32_t worlds, const OnRecord& on_record) {
  const ChunkedTrace trace(log, worlds);
  MergedRecords(trace, true).read(on_record);
}

}  // namespace soda::analysis
