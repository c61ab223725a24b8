// What each LP has executed and not committed, with a value for each: followed through rollbacks.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "kernel/virtual_time.hpp"

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
    entries.erase(first_at_or_after(entries, restart), entries.end());
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
    if (index_of(lp) >= entries_.size()) entries_.resize(index_of(lp) + 1);
    return entries_[index_of(lp)];
  }
  static typename std::vector<Entry>::iterator first_at_or_after(std::vector<Entry>& entries,
                                                                 VirtualTime time) {
    return std::lower_bound(entries.begin(), entries.end(), time,
                            [](const Entry& entry, VirtualTime t) { return entry.time < t; });
  }

  std::vector<std::vector<Entry>> entries_;  // of each LP, ascending
};

}  // namespace soda::kernel
