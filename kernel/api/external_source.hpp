// Messages from outside the logical processes: from a user, or from whoever steers the run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "kernel/api/message.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// Their source: no LP. So in a bag they come after all messages of LPs.
inline constexpr LpId kExternalSource{0xffff'ffffu};

// What an executor asks while it runs, one call at a time, from one thread at a time (not always
// the same one). Both may wait for nothing: the whole run would.
//
// Which messages come is up to the source and its clock. What is committed is a function of the
// messages, their times and slots: given the same, every executor commits the same. So who wants to
// repeat a run writes them down as they are taken.
class ExternalSource {
 public:
  virtual ~ExternalSource() = default;

  // GVT never passes it: a message at this time or later comes in time, whenever it is sent. Never
  // decreases. Asked anew in every GVT round. As long as it is before the end, the run goes on.
  // kNever: holds nothing back; what it sends then, it sends at the earliest time there is.
  virtual VirtualTime floor() = 0;

  // What it has to send now that everything before `gvt` is irrevocable: appends to `out`, of each
  // message the time, which must be >= `earliest`, destination, kind, slot and payload; the rest is
  // filled in by the executor. In a bag, messages of one kind are in the order of their slots; no
  // two to one destination for one time have the same. `earliest` >= gvt is the least time that is
  // still allowed, and <= floor(); kBeginning never is. Messages at the end of the run or later are
  // dropped. Called in every GVT round but the last; run_sequential, where nothing runs ahead,
  // calls it before each new t.
  virtual void take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) = 0;
};

// Several as one: the earliest floor, and the messages of all in the order of the list.
class ExternalSourceList final : public ExternalSource {
 public:
  // All must outlive this object.
  explicit ExternalSourceList(std::vector<ExternalSource*> all) : all_(std::move(all)) {}

  VirtualTime floor() override;
  void take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) override;

 private:
  const std::vector<ExternalSource*> all_;
};

// An executor's side of an ExternalSource: checks its messages.
class ExternalSourceDoor {
 public:
  // `external` may be null: nothing ever comes. If not, it must outlive this object.
  ExternalSourceDoor(ExternalSource* external, std::size_t lp_count, VirtualTime end)
      : external_(external), lp_count_(lp_count), end_(end) {}

  bool exists() const { return external_ != nullptr; }

  // The earlier of `floor` and the floor of the external source.
  VirtualTime hold(VirtualTime floor) const;

  // Appends what is to be sent, ready to be delivered.
  void take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out);

 private:
  ExternalSource* const external_;
  const std::size_t lp_count_;
  const VirtualTime end_;
  std::set<OutputId> sent_;  // for what is not before GVT
  std::uint64_t next_version_ = 1;
  std::vector<Message> taken_;  // scratch
};

// A short sleep of a thread that an external source holds up.
void wait_for_external();

}  // namespace soda::kernel
