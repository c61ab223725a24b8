#include "analysis/trace/message_life.hpp"

#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/trace_words.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

// The happenings of one message, found one after the other.
class Life {
 public:
  Life(std::uint32_t source, std::uint64_t version) : source_(source), version_(version) {}

  // Whether the message has to do with it.
  bool concerns(const TraceRecord& record) {
    if (is_of_message(record.what)) {
      const bool is_sent = record.what == Happening::kSent || record.what == Happening::kAdopted;
      const kernel::LpId from = is_sent ? record.lp : record.peer;
      if (kernel::index_of(from) != source_) return false;
      if (record.version == version_) {
        message_ = record;
        is_known_ = true;
        receiver_ = is_sent ? record.peer : record.lp;
        has_arrived_ = has_arrived_ || record.what == Happening::kArrived;
        return true;
      }
      return is_known_ && record.what == Happening::kSent && replaces(record);
    }
    return has_arrived_ && record.lp == receiver_ && record.time == message_.time &&
           (record.what == Happening::kExecuted || record.what == Happening::kAbsorbed ||
            record.what == Happening::kRolledBack || record.what == Happening::kPutBack ||
            record.what == Happening::kCommitted);
  }
  bool is_known() const { return is_known_; }

 private:
  bool replaces(const TraceRecord& record) const {
    return record.version > version_ && record.peer == receiver_ && record.time == message_.time &&
           record.kind == message_.kind && record.slot == message_.slot;
  }

  const std::uint32_t source_;
  const std::uint64_t version_;
  TraceRecord message_;
  kernel::LpId receiver_{};
  bool is_known_ = false;
  bool has_arrived_ = false;
};

}  // namespace

std::string message_life(const RecordedWalk& walk, std::size_t number, std::uint32_t source,
                         std::uint64_t version) {
  Life life(source, version);
  std::string text;
  for (std::size_t i = 0; i < walk.size(); ++i) {
    if (!life.concerns(walk[i].record)) continue;
    text += i < number ? "  " : "  still to come: ";
    text += place_text(walk, i + 1) + "\n";
  }
  if (!life.is_known())
    throw UsageError("the log tells of no message " + message_name(source, version));
  return text;
}

}  // namespace soda::analysis
