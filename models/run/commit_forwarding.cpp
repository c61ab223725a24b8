#include "models/run/commit_forwarding.hpp"

#include <algorithm>
#include <utility>

#include "models/messages/codec.hpp"

namespace soda::models {
namespace {

void write_bodies(Writer& writer, const BufferEntry& entry) {
  writer.number(static_cast<std::uint32_t>(entry.ids.size()));
  for (std::size_t i = 0; i < entry.ids.size(); ++i) {
    writer.id(entry.ids[i]);
    writer.state(entry.states[i]);
  }
}

void read_bodies(Reader& reader, BufferEntry& entry) {
  for (auto left = reader.number<std::uint32_t>(); left > 0; --left) {
    entry.ids.push_back(reader.id());
    entry.states.push_back(reader.state());
  }
}

// What a record holds: its first byte.
enum class RecordKind : std::uint8_t { kCommit, kLoad, kTrace, kNews };

kernel::Bytes record_of(RecordKind kind, std::span<const std::byte> bytes) {
  kernel::Bytes record(1 + bytes.size(), static_cast<std::byte>(kind));
  std::ranges::copy(bytes, record.begin() + 1);
  return record;
}

void join(std::span<const std::byte> record, const RecordSinks& sinks) {
  const auto kind = static_cast<RecordKind>(record.front());
  const std::span<const std::byte> bytes = record.subspan(1);
  if (kind == RecordKind::kLoad) return sinks.loads->add(decode_load(bytes));
  if (kind == RecordKind::kTrace) return sinks.trace->take({bytes.begin(), bytes.end()});
  if (kind == RecordKind::kNews) return sinks.entries->receive(bytes);
  Reader reader(bytes);
  const WorldId world = reader.world();
  BufferEntry entry;
  entry.step = reader.number<std::int64_t>();
  read_bodies(reader, entry);
  while (!reader.at_end()) entry.islands.push_back(reader.island());
  sinks.commits.add(world, entry);
}

}  // namespace

void CommitForwarding::add(LoadSample sample) {
  kernel::Bytes record = record_of(RecordKind::kLoad, encode_load(sample));
  const std::lock_guard lock(mutex_);
  records_.push_back(std::move(record));
}

void CommitForwarding::take(kernel::Bytes trace) {
  trace.insert(trace.begin(), static_cast<std::byte>(RecordKind::kTrace));
  const std::lock_guard lock(mutex_);
  records_.push_back(std::move(trace));
}

void CommitForwarding::add(WorldId world, const BufferEntry& entry) {
  kernel::Bytes record;
  Writer writer(record);
  writer.number(static_cast<std::uint8_t>(RecordKind::kCommit));
  writer.world(world);
  writer.number(entry.step);
  if (wants_states(entry.step))
    write_bodies(writer, entry);
  else
    writer.number(std::uint32_t{0});
  for (const physics::IslandReport& island : entry.islands) writer.island(island);
  const std::lock_guard lock(mutex_);
  records_.push_back(std::move(record));
}

std::vector<kernel::Bytes> CommitForwarding::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(records_, {});
}

kernel::RecordHooks record_hooks(CommitForwarding& forwarding, const RecordSinks& sinks) {
  kernel::RecordHooks hooks;
  hooks.take = [&forwarding, entries = sinks.entries] {
    std::vector<kernel::Bytes> records = forwarding.take();
    if (entries == nullptr) return records;
    for (const kernel::Bytes& news : entries->take_news())
      records.push_back(record_of(RecordKind::kNews, news));
    return records;
  };
  hooks.receive = [&sinks](std::span<const std::byte> record) { join(record, sinks); };
  return hooks;
}

kernel::Bytes encode_outcome(std::span<const std::unique_ptr<kernel::LogicalProcess>> worlds) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  for (const std::unique_ptr<kernel::LogicalProcess>& process : worlds) {
    if (!process) continue;
    const World& world = static_cast<const World&>(*process);
    writer.plain(world.stages());
    writer.plain(world.counters());
    writer.plain(world.work().replicated);
    BufferEntry copy;
    write_bodies(writer, world.newest_entry(copy));
  }
  return bytes;
}

void add_outcome(World& world, std::size_t bodies, SimulationResult& result) {
  result.stages += world.stages();
  result.worlds += world.counters();
  result.replicated += world.work().replicated;
  BufferEntry entry = world.release_newest_entry();
  if (entry.ids.size() == bodies) {
    result.final_states = std::move(entry.states);
  } else {
    result.final_states.resize(bodies);
    for (std::size_t i = 0; i < entry.ids.size(); ++i)
      result.final_states[physics::index_of(entry.ids[i])] = std::move(entry.states[i]);
  }
  result.final_ids.insert(result.final_ids.end(), entry.ids.begin(), entry.ids.end());
}

void add_outcome(std::span<const std::byte> outcome, SimulationResult& result) {
  for (Reader reader(outcome); !reader.at_end();) {
    result.stages += reader.plain<physics::StageCounters>();
    result.worlds += reader.plain<WorldCounters>();
    result.replicated += reader.plain<physics::StageCounters>();
    BufferEntry entry;
    read_bodies(reader, entry);
    for (std::size_t i = 0; i < entry.ids.size(); ++i)
      result.final_states[physics::index_of(entry.ids[i])] = std::move(entry.states[i]);
    result.final_ids.insert(result.final_ids.end(), entry.ids.begin(), entry.ids.end());
  }
}

}  // namespace soda::models
