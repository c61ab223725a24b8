// Ascending lists that share with an older version of themselves what did not change.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "models/transform_buffer/shared_array.hpp"

namespace soda::models {

// To be specialised for what is listed:
//   static Key key(const T&);  // an integer or an enumeration
//   static bool same(const T&, const T&);  // bit for bit; no, of equal items, costs memory only
template <class T>
struct ListItem;

// An immutable list, ascending by key, in chunks of 16 keys on average. A chunk that is equal in
// the older version is the same memory, and so is the table of chunks if all are. Where a chunk
// begins is a function of its first key only: what comes or goes changes one chunk, not all that
// follow.
template <class T>
class SharedList {
 public:
  using Key = decltype(ListItem<T>::key(std::declval<const T&>()));

  SharedList() = default;
  // `items` ascending by key; several may have one key.
  SharedList(SharedMemory& memory, std::span<const T> items, const SharedList& older);
  // Of items that are nowhere yet, source.size() of them: source.key_at(i) ascends;
  // source.is_at(item, i) says whether an item of an older list is the one to come at i;
  // source.make(first, last) makes the chunk of items first to last, without last, in ascending
  // order of chunks. `older` and `other` are looked into.
  template <class Source>
  SharedList(SharedMemory& memory, Source&& source, const SharedList& older,
             const SharedList& other);

  // Adds up chunks.
  std::size_t size() const {
    std::size_t size = 0;
    for (const Chunk& chunk : table_.items()) size += chunk.items().size();
    return size;
  }
  // Calls do_with(item) in order.
  template <class Do>
  void for_each(Do do_with) const {
    for (const Chunk& chunk : table_.items())
      for (const T& item : chunk.items()) do_with(item);
  }
  // Walks once through the list.
  class Cursor {
   public:
    explicit Cursor(const SharedList& list) : chunks_(list.table_.items()) {}
    // The first item with this key, or null. Keys asked for must not descend.
    const T* advance_to(Key key);

   private:
    std::span<const SharedArray<T>> chunks_;
    std::size_t item_ = 0;  // of the first chunk
  };
  // All items with this key.
  std::span<const T> range(Key key) const;
  // The first of them, or null.
  const T* find(Key key) const {
    const std::span<const T> found = range(key);
    return found.empty() ? nullptr : found.data();
  }

 private:
  using Chunk = SharedArray<T>;

  // Items that are there.
  struct Items {
    SharedMemory& memory;
    std::span<const T> items;

    std::size_t size() const { return items.size(); }
    Key key_at(std::size_t i) const { return key_of(items[i]); }
    bool is_at(const T& item, std::size_t i) const { return ListItem<T>::same(item, items[i]); }
    Chunk make(std::size_t first, std::size_t last) const {
      return Chunk(memory, items.subspan(first, last - first));
    }
  };

  static Key key_of(const T& item) { return ListItem<T>::key(item); }
  static bool begins_chunk(Key key) {
    return kernel::mix64(static_cast<std::uint64_t>(key) + 1) % 16 == 0;
  }
  static bool before(const T& item, Key key) { return key_of(item) < key; }
  // The chunk that begins with this key, or null; `chunks` loses those before it.
  static const Chunk* chunk_from(std::span<const Chunk>& chunks, Key key) {
    while (!chunks.empty() && before(chunks.front().items().front(), key))
      chunks = chunks.subspan(1);
    const bool found = !chunks.empty() && key_of(chunks.front().items().front()) == key;
    return found ? &chunks.front() : nullptr;
  }

  SharedArray<Chunk> table_;
};

template <class T>
SharedList<T>::SharedList(SharedMemory& memory, std::span<const T> items, const SharedList& older)
    : SharedList(memory, Items{memory, items}, older, {}) {}

template <class T>
template <class Source>
SharedList<T>::SharedList(SharedMemory& memory, Source&& source, const SharedList& older,
                          const SharedList& other) {
  const std::size_t size = source.size();
  const auto key_at = [&source](std::size_t i) { return source.key_at(i); };
  std::vector<Chunk> chunks;
  std::span<const Chunk> rest = older.table_.items(), other_rest = other.table_.items();
  for (std::size_t first = 0, last = 0; first < size; first = last) {
    last = first + 1;
    while (last < size && (key_at(last) == key_at(last - 1) || !begins_chunk(key_at(last)))) ++last;
    const auto is_here = [&](const Chunk* chunk) {
      if (chunk == nullptr || chunk->items().size() != last - first) return false;
      std::size_t i = first;
      return std::ranges::all_of(chunk->items(),
                                 [&](const T& item) { return source.is_at(item, i++); });
    };
    const Chunk* const old = chunk_from(rest, key_at(first));
    const Chunk* const instead = chunk_from(other_rest, key_at(first));
    if (is_here(old))
      chunks.push_back(*old);
    else if (is_here(instead))
      chunks.push_back(*instead);
    else
      chunks.push_back(source.make(first, last));
  }
  for (const SharedList* list : {&older, &other})
    if (std::ranges::equal(chunks, list->table_.items())) table_ = list->table_;
  if (table_.items().size() != chunks.size()) table_ = SharedArray<Chunk>(memory, chunks);
}

template <class T>
const T* SharedList<T>::Cursor::advance_to(Key key) {
  while (!chunks_.empty()) {
    const std::span<const T> items = chunks_.front().items();
    for (; item_ < items.size(); ++item_)
      if (key_of(items[item_]) >= key) return key_of(items[item_]) == key ? &items[item_] : nullptr;
    chunks_ = chunks_.subspan(1);
    item_ = 0;
  }
  return nullptr;
}

template <class T>
std::span<const T> SharedList<T>::range(Key key) const {
  const std::span<const Chunk> chunks = table_.items();
  auto place = std::upper_bound(chunks.begin(), chunks.end(), key, [](Key k, const Chunk& chunk) {
    return k < key_of(chunk.items().front());
  });
  if (place == chunks.begin()) return {};
  const std::span<const T> items = (--place)->items();
  const auto first = std::lower_bound(items.begin(), items.end(), key, before);
  auto last = first;
  while (last != items.end() && key_of(*last) == key) ++last;
  return {first, last};
}

}  // namespace soda::models
