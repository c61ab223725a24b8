// A process under Time Warp on a bench: driven by hand, one call after the other.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "kernel/time_warp/time_warp_process.hpp"
#include "tests/kernel/scripted_process.hpp"

namespace soda::kernel::bench {

using Times = std::vector<VirtualTime>;
inline constexpr VirtualTime kEnd{100, 0};
inline constexpr LpId kSelf{0};
inline constexpr LpId kPeer{1};

constexpr VirtualTime at(std::int64_t t, std::uint32_t round = 0) { return {t, round}; }

// A process with what drives it. Messages come from LpId 2, with ids (2, t, kind 7, slot).
template <class Process>
struct BenchOf {
  explicit BenchOf(typename Process::Script script)
      : lp(std::move(script)), process(kSelf, 3, lp, kEnd, pool, journal) {}

  void deliver(VirtualTime time, std::uint64_t value, std::uint64_t version,
               std::uint32_t slot = 0) {
    process.deliver({{time, kSelf, 7, slot}, LpId{2}, version, false, number(value)}, effects);
    process.settle(effects);
  }
  void deliver_anti(VirtualTime time, std::uint64_t version, std::uint32_t slot = 0) {
    process.deliver({{time, kSelf, 7, slot}, LpId{2}, version, true, {}}, effects);
    process.settle(effects);
  }
  void execute_all() {
    while (process.next_time() < kEnd) process.execute(effects);
  }
  void advance_gvt(VirtualTime gvt) {
    process.commit(gvt, effects);
    process.forget(gvt);
  }
  // As "+(5, 0) k1=9" or "-(5, 0) k1", in the order of sending.
  std::vector<std::string> take_outgoing() {
    std::vector<std::string> texts;
    for (const Message& m : effects.outgoing) {
      std::string text = describe(m.anti ? '-' : '+', m.time, " k", m.kind);
      if (m.slot > 0) text += describe(".", m.slot);
      if (!m.anti) text += describe("=", number_in(m.payload.bytes()));
      texts.push_back(text);
    }
    effects.outgoing.clear();
    return texts;
  }

  Process lp;
  MessagePool pool;
  Journal journal;
  TimeWarpProcess process;
  WorkerEffects effects;
};
using Bench = BenchOf<ScriptedProcess>;

}  // namespace soda::kernel::bench
