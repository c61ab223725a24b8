// What each LP has executed and not committed, with a value for each: followed through rollbacks.
#pragma once

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

template <class Value>
class ExecutedLog {
 public:
  void execute(LpId lp, VirtualTime now, Value value) { of(lp).push_back({now, std::move(value)}); }

  // Replaces the value of `now`, or puts it in its place among the others.
  void put(LpId lp, VirtualTime now, Value value) {
    std::vector<Entry>& entries = of(lp);
    const auto at = first_at_or_after(entries, now);
    if (at != entries.end() && at->time == now)
      at->value = std::move(value);
    else
      entries.insert(at, {now, std::move(value)});
  }

  void rewind(LpId lp, VirtualTime restart) {
    std::vector<Entry>& entries = of(lp);
    std::vector<Entry>& undone = undone_[index_of(lp)];
    const auto first = first_at_or_after(entries, restart);
    if (first == entries.end()) return;
    const VirtualTime last = entries.back().time;
    const auto later =
        std::upper_bound(undone.begin(), undone.end(), last,
                         [](VirtualTime time, const Entry& entry) { return time < entry.time; });
    std::vector<Entry> all(std::make_move_iterator(first), std::make_move_iterator(entries.end()));
    all.insert(all.end(), std::make_move_iterator(later), std::make_move_iterator(undone.end()));
    undone = std::move(all);
    entries.erase(first, entries.end());
  }

  // What was undone last at each time of [now, resume) is revalidated.
  void restore(LpId lp, VirtualTime now, VirtualTime resume) {
    std::vector<Entry>& entries = of(lp);
    std::vector<Entry>& undone = undone_[index_of(lp)];
    const auto first = first_at_or_after(undone, now);
    const auto last = first_at_or_after(undone, resume);
    entries.insert(entries.end(), std::make_move_iterator(first), std::make_move_iterator(last));
    undone.erase(undone.begin(), last);
  }

  // The value of `now`, and forgets all before it; nothing if that has not been executed, or was
  // undone.
  std::optional<Value> commit(LpId lp, VirtualTime now) {
    std::vector<Entry>& entries = of(lp);
    const auto at = first_at_or_after(entries, now);
    if (at == entries.end() || at->time != now) return std::nullopt;
    std::optional<Value> value = std::move(at->value);
    entries.erase(entries.begin(), at + 1);
    return value;
  }

 private:
  struct Entry {
    VirtualTime time;
    Value value;
  };

  std::vector<Entry>& of(LpId lp) {
    if (index_of(lp) >= entries_.size()) {
      entries_.resize(index_of(lp) + 1);
      undone_.resize(entries_.size());
    }
    return entries_[index_of(lp)];
  }
  static typename std::vector<Entry>::iterator first_at_or_after(std::vector<Entry>& entries,
                                                                 VirtualTime time) {
    return std::lower_bound(entries.begin(), entries.end(), time,
                            [](const Entry& entry, VirtualTime t) { return entry.time < t; });
  }

  std::vector<std::vector<Entry>> entries_;  // of each LP, ascending
  std::vector<std::vector<Entry>> undone_;   // of each LP, ascending; the last of each time
};

}  // namespace soda::kernel
