#include "analysis/trace/recorded_walk.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "models/messages/schedule.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;
using kernel::VirtualTime;

// How many steps are over when `time` is.
std::int64_t steps_with(VirtualTime time) {
  return models::phase_of(time) == models::Phase::kFinish ? time.t + 1 : time.t;
}

// Follows the worlds as far as the walk has gone.
class Standing {
 public:
  Standing(std::uint32_t worlds, std::int64_t first_step, bool in_sequence)
      : first_step_(first_step), in_sequence_(in_sequence), worlds_(worlds) {
    situation_.worlds.resize(worlds);
  }

  void add(const TraceRecord& record) {
    if (record.what == Happening::kGvt) return gvt(record.time);
    const std::uint32_t id = kernel::index_of(record.lp);
    World& world = worlds_[id];
    WorldSituation& told = situation_.worlds[id];
    switch (record.what) {
      case Happening::kSent:
        if (in_sequence_)
          arrived(worlds_[kernel::index_of(record.peer)], record.lp, record);
        else
          in_flight_.emplace(std::pair(id, record.version), kernel::index_of(record.peer));
        return;
      case Happening::kArrived:
        in_flight_.erase({kernel::index_of(record.peer), record.version});
        return arrived(world, record.peer, record);
      case Happening::kExecuted:
        ++told.executions;
        if (in_sequence_) gvt(record.time);
        world.standing.insert(record.time);
        return;
      case Happening::kAbsorbed:
        if (record.anew) world.standing.insert(record.time);
        return;
      case Happening::kRewound:
        ++told.rollbacks;
        world.standing.erase(world.standing.lower_bound(record.other), world.standing.end());
        return;
      case Happening::kRolledBack:
        world.standing.erase(record.time);
        return;
      case Happening::kPutBack:
        world.standing.insert(record.time);
        return;
      case Happening::kCommitted:
        // What lies before and is not committed stands no more: its bag has become empty.
        world.standing.erase(world.standing.begin(), world.standing.upper_bound(record.time));
        told.committed = record.time;
        return;
      case Happening::kAdopted:
      case Happening::kLate:
      case Happening::kCost:
      case Happening::kJumped:
      case Happening::kSettled:
      case Happening::kGvt:
        return;
    }
  }

  Situation finish() {
    for (const auto& [name, to] : in_flight_)
      if (to < worlds_.size()) ++situation_.worlds[to].in_flight;
    for (std::size_t id = 0; id < worlds_.size(); ++id) tell(worlds_[id], situation_.worlds[id]);
    return std::move(situation_);
  }

 private:
  // Of a message what its newest version replaces: time, source, kind and slot.
  using MessageId = std::tuple<VirtualTime, std::uint32_t, std::uint32_t, std::uint64_t>;
  struct Version {
    std::uint64_t version = 0;
    bool anti = false;
  };
  struct World {
    std::set<VirtualTime> standing;  // and not committed
    std::map<MessageId, Version> arrived;
  };

  // In sequence, each message is a version of its own.
  void arrived(World& world, kernel::LpId from, const TraceRecord& record) {
    const std::uint64_t slot = in_sequence_ ? record.version : record.slot;
    Version& version = world.arrived[{record.time, kernel::index_of(from), record.kind, slot}];
    if (version.version <= record.version) version = {record.version, record.anti};
  }

  void gvt(VirtualTime time) {
    if (time <= situation_.gvt) return;
    situation_.gvt = time;
    for (World& world : worlds_)
      world.arrived.erase(world.arrived.begin(),
                          world.arrived.lower_bound({situation_.gvt, 0, 0, 0}));
  }

  void tell(const World& world, WorldSituation& told) const {
    told.ahead = world.standing.size();
    told.executed = told.committed;
    if (!world.standing.empty()) told.executed = *world.standing.rbegin();
    if (told.executed)
      told.entries =
          steps_with(*told.executed) - (told.committed ? steps_with(*told.committed) : first_step_);
    for (const auto& [name, version] : world.arrived)
      told.waiting += !version.anti && (!told.executed || std::get<0>(name) > *told.executed);
  }

  const std::int64_t first_step_;
  const bool in_sequence_;
  std::vector<World> worlds_;
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint32_t> in_flight_;
  Situation situation_;
};

}  // namespace

RecordedWalk recorded_walk(LogReader& log, std::uint32_t worlds) {
  RecordedWalk walk;
  read_records_by_cause(log, worlds, [&walk](std::uint32_t worker, const TraceRecord& record) {
    walk.push_back({record, worker});
    walk.back().record.note = {};
  });
  return walk;
}

RecordedWalk committed_walk(const LogReader& log) {
  RecordedWalk walk;
  for (std::int64_t step = log.first_step() + 1; step <= log.last_step(); ++step) {
    WalkedHappening happening;
    happening.record.what = Happening::kGvt;
    happening.record.time = models::time_of(step, models::Phase::kBegin);
    walk.push_back(happening);
  }
  return walk;
}

bool is_in_sequence(const RecordedWalk& walk) {
  return std::ranges::none_of(walk, [](const WalkedHappening& happening) {
    return happening.record.what == Happening::kArrived || happening.record.what == Happening::kGvt;
  });
}

Situation situation_after(const RecordedWalk& walk, std::size_t number, std::uint32_t worlds,
                          std::int64_t first_step) {
  Standing standing(worlds, first_step, is_in_sequence(walk));
  for (std::size_t i = 0; i < number; ++i) standing.add(walk[i].record);
  return standing.finish();
}

VirtualTime gvt_after(const RecordedWalk& walk, std::size_t number) {
  const Happening tells = is_in_sequence(walk) ? Happening::kExecuted : Happening::kGvt;
  for (std::size_t i = number; i > 0; --i)
    if (walk[i - 1].record.what == tells) return walk[i - 1].record.time;
  return kernel::kBeginning;
}

// Those of a world are in the same order here and there; over all worlds they need not be.
std::optional<RollbackNumber> last_rollback(const RecordedWalk& walk, std::size_t number,
                                            const ExecutionTrace& trace) {
  while (number > 0 && walk[number - 1].record.what != Happening::kRewound) --number;
  if (number == 0) return std::nullopt;
  const kernel::LpId world = walk[number - 1].record.lp;
  auto left = std::count_if(walk.begin(), walk.begin() + static_cast<std::ptrdiff_t>(number),
                            [world](const WalkedHappening& happening) {
                              return happening.record.what == Happening::kRewound &&
                                     happening.record.lp == world;
                            });
  for (RollbackNumber rollback = 0; rollback < trace.rollbacks.size(); ++rollback)
    if (trace.rollbacks[rollback].world == kernel::index_of(world) && --left == 0) return rollback;
  return std::nullopt;
}

}  // namespace soda::analysis
