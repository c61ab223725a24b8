#include "kernel/api/event_recorder.hpp"

#include <algorithm>
#include <utility>

#include "kernel/api/wire.hpp"

namespace soda::kernel {
namespace {

// A chunk is handed over at a GVT when it has so many bytes: then a block of a log is worth its
// header; and at once when it has so many: a run without GVT must not fill the memory.
constexpr std::size_t kWorthHandingOver = 64 << 10;
constexpr std::size_t kMostInChunk = 4 << 20;

constexpr std::uint8_t kAntiBit = 0x40, kAnewBit = 0x80;

bool has_other(Happening what) {
  return what == Happening::kSent || what == Happening::kAdopted || what == Happening::kRewound;
}
bool has_cost(Happening what) { return what == Happening::kExecuted || what == Happening::kCost; }
bool has_note(Happening what) { return what == Happening::kLate || what == Happening::kRewound; }

constexpr std::uint64_t zigzag(std::int64_t number) {
  return (static_cast<std::uint64_t>(number) << 1) ^ static_cast<std::uint64_t>(number >> 63);
}

std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
std::int64_t sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

}  // namespace

EventCounts& operator+=(EventCounts& sum, const EventCounts& more) {
  for (std::size_t kind = 0; kind < EventCounts::kMostKinds; ++kind) {
    EventCounts::OfExecutions& executions = sum.executions[kind];
    executions.executed += more.executions[kind].executed;
    executions.rolled_back += more.executions[kind].rolled_back;
    executions.committed += more.executions[kind].committed;
    EventCounts::OfMessages& messages = sum.messages[kind];
    messages.sent += more.messages[kind].sent;
    messages.late += more.messages[kind].late;
    messages.anti += more.messages[kind].anti;
  }
  return sum;
}

EventRecorder::EventRecorder(const Recording& recording, std::uint32_t worker)
    : recording_(recording), worker_(worker) {
  begin_chunk();
}

std::int64_t EventRecorder::now_ns() const {
  if (models_clock_ || (!traces() && !recording_.accounts)) return clock_ns_;
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() -
                                                              start_)
      .count();
}

EventCounts::OfExecutions& EventRecorder::of(VirtualTime time) {
  const std::size_t kind = recording_.kind_of(time);
  return counts_.executions[std::min(kind, EventCounts::kMostKinds - 1)];
}

EventCounts::OfMessages& EventRecorder::of(const Message& message) {
  return counts_.messages[std::min<std::size_t>(message.kind, EventCounts::kMostKinds - 1)];
}

void EventRecorder::sent(const Message& message, VirtualTime at) {
  ++(message.anti ? of(message).anti : of(message).sent);
  if (traces()) message_record(Happening::kSent, message, at, {});
}

void EventRecorder::adopted(const Message& message, VirtualTime at) {
  if (traces()) message_record(Happening::kAdopted, message, at, {});
}

void EventRecorder::arrived(const Message& message) {
  if (traces()) message_record(Happening::kArrived, message, kBeginning, {});
}

void EventRecorder::late(const Message& message) {
  ++of(message).late;
  if (!traces()) return;
  Bytes note;
  if (recording_.describe != nullptr)
    recording_.describe(message.kind, message.payload.bytes(), note);
  message_record(Happening::kLate, message, kBeginning, note);
}

void EventRecorder::executed(LpId lp, VirtualTime time, std::int64_t began_ns, bool anew) {
  ++of(time).executed;
  if (recording_.accounts) times_.executed(lp, time, now_ns() - began_ns);
  if (!traces()) return;
  TraceRecord record = about(Happening::kExecuted, lp, time);
  record.took_ns = models_clock_ ? 0 : now_ns() - began_ns;
  record.clock_ns = began_ns;
  record.anew = anew;
  write(record);
}

void EventRecorder::cost(LpId lp, std::int64_t took_ns) {
  if (!traces()) return;
  TraceRecord record = about(Happening::kCost, lp, {});
  record.took_ns = took_ns;
  write(record);
}

void EventRecorder::settled(LpId lp) {
  if (traces()) write(about(Happening::kSettled, lp, last_time_));
}

void EventRecorder::absorbed(LpId lp, VirtualTime time, bool counts) {
  of(time).executed += counts;
  if (!traces()) return;
  TraceRecord record = about(Happening::kAbsorbed, lp, time);
  record.anew = counts;
  write(record);
}

void EventRecorder::rewound(LpId lp, VirtualTime restart, VirtualTime changed,
                            const Refusal& refusal) {
  if (!traces()) return;
  TraceRecord record = about(Happening::kRewound, lp, restart);
  record.other = changed;
  Bytes note;
  append_number(note, refusal.code);
  append_number(note, refusal.subject);
  append_number(note, refusal.other);
  record.note = note;
  write(record);
}

void EventRecorder::rolled_back(LpId lp, VirtualTime time) {
  ++of(time).rolled_back;
  if (recording_.accounts) times_.rolled_back(lp, time);
  if (traces()) write(about(Happening::kRolledBack, lp, time));
}

void EventRecorder::put_back(LpId lp, VirtualTime time) {
  --of(time).rolled_back;
  if (recording_.accounts) times_.put_back(lp, time);
  if (traces()) write(about(Happening::kPutBack, lp, time));
}

void EventRecorder::jumped(LpId lp, VirtualTime resume) {
  if (traces()) write(about(Happening::kJumped, lp, resume));
}

void EventRecorder::committed(LpId lp, VirtualTime time) {
  ++of(time).committed;
  if (recording_.accounts) times_.committed(lp, time);
  if (traces()) write(about(Happening::kCommitted, lp, time));
}

void EventRecorder::gvt(VirtualTime gvt) {
  if (!traces()) return;
  write(about(Happening::kGvt, LpId{}, gvt));
  flush(false);
}

void EventRecorder::flush(bool all) {
  if (!traces() || (!all && chunk_.size() < kWorthHandingOver)) return;
  recording_.trace->take(std::exchange(chunk_, {}));
  begin_chunk();
}

TraceRecord EventRecorder::about(Happening what, LpId lp, VirtualTime time) const {
  TraceRecord record;
  record.clock_ns = now_ns();
  record.time = time;
  record.lp = lp;
  record.what = what;
  return record;
}

void EventRecorder::message_record(Happening what, const Message& message, VirtualTime at,
                                   std::span<const std::byte> note) {
  const bool leaves = has_other(what);
  TraceRecord record = about(what, leaves ? message.source : message.destination, message.time);
  record.peer = leaves ? message.destination : message.source;
  record.other = at;
  record.kind = message.kind;
  record.slot = message.slot;
  record.version = message.version;
  record.anti = message.anti;
  record.note = note;
  write(record);
}

// Numbers are written in as few groups of seven bits as they need, times and clocks as differences
// to those of the record before.
void EventRecorder::write(const TraceRecord& record) {
  const auto what = static_cast<std::uint8_t>(record.what);
  chunk_.push_back(std::byte(what | (record.anti ? kAntiBit : 0) | (record.anew ? kAnewBit : 0)));
  put_signed(difference(record.clock_ns, last_clock_ns_));
  last_clock_ns_ = record.clock_ns;
  put_time(record.time);
  put_number(index_of(record.lp));
  if (has_other(record.what)) put_time(record.other);
  if (has_cost(record.what)) put_signed(record.took_ns);
  if (is_of_message(record.what)) {
    put_number(index_of(record.peer));
    put_number(record.kind);
    put_number(record.slot);
    put_number(record.version);
  }
  if (has_note(record.what)) {
    put_number(record.note.size());
    chunk_.insert(chunk_.end(), record.note.begin(), record.note.end());
  }
  if (chunk_.size() > kMostInChunk) flush(true);
}

void EventRecorder::begin_chunk() {
  last_clock_ns_ = 0;
  last_time_ = {};
  if (traces()) put_number(worker_);
}

void EventRecorder::put_number(std::uint64_t number) {
  for (; number >= 0x80; number >>= 7) chunk_.push_back(std::byte((number & 0x7f) | 0x80));
  chunk_.push_back(std::byte(number));
}

void EventRecorder::put_signed(std::int64_t number) { put_number(zigzag(number)); }

void EventRecorder::put_time(VirtualTime time) {
  put_signed(difference(time.t, last_time_.t));
  put_signed(std::int64_t{time.round} - std::int64_t{last_time_.round});
  last_time_ = time;
}

TraceChunk::TraceChunk(std::span<const std::byte> bytes) : left_(bytes) {
  const std::uint64_t worker = take_number();
  if (worker > std::numeric_limits<std::uint32_t>::max()) sound_ = false;
  worker_ = static_cast<std::uint32_t>(worker);
}

bool TraceChunk::next(TraceRecord& record) {
  if (!sound_ || left_.empty()) return false;
  const auto head = std::to_integer<std::uint8_t>(left_.front());
  left_ = left_.subspan(1);
  const auto what = static_cast<std::uint8_t>(head & ~(kAntiBit | kAnewBit));
  if (what >= kHappenings) sound_ = false;
  record = {};
  record.what = Happening{what};
  record.anti = (head & kAntiBit) != 0;
  record.anew = (head & kAnewBit) != 0;
  record.clock_ns = clock_ns_ = sum(clock_ns_, take_signed());
  record.time = take_time();
  const auto take_32 = [this] {
    const std::uint64_t number = take_number();
    sound_ = sound_ && number <= std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(number);
  };
  record.lp = LpId{take_32()};
  if (has_other(record.what)) record.other = take_time();
  if (has_cost(record.what)) record.took_ns = take_signed();
  if (is_of_message(record.what)) {
    record.peer = LpId{take_32()};
    record.kind = take_32();
    record.slot = take_32();
    record.version = take_number();
  }
  if (has_note(record.what)) {
    const std::uint64_t bytes = take_number();
    sound_ = sound_ && bytes <= left_.size();
    if (!sound_) return false;
    record.note = left_.first(bytes);
    left_ = left_.subspan(bytes);
  }
  return sound_;
}

std::uint64_t TraceChunk::take_number() {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    if (left_.empty()) break;
    const auto group = std::to_integer<std::uint64_t>(left_.front());
    left_ = left_.subspan(1);
    if (shift == 63 && group > 1) break;
    number |= (group & 0x7f) << shift;
    if ((group & 0x80) == 0) return number;
  }
  sound_ = false;
  return 0;
}

std::int64_t TraceChunk::take_signed() {
  const std::uint64_t number = take_number();
  return static_cast<std::int64_t>((number >> 1) ^ (~(number & 1) + 1));
}

VirtualTime TraceChunk::take_time() {
  time_.t = sum(time_.t, take_signed());
  const std::int64_t round = sum(time_.round, take_signed());
  if (round < 0 || round > std::numeric_limits<std::uint32_t>::max()) sound_ = false;
  time_.round = static_cast<std::uint32_t>(round);
  return time_;
}

}  // namespace soda::kernel
