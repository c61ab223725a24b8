// The execution of a traced run as the page of `soda view` draws it: of bounded size, whatever the
// log holds.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// The most of each that a page holds.
inline constexpr std::size_t kMostBars = 100'000, kMostRollbacks = 20'000, kMostTexts = 5'000;

// Clocks are those of the executor, in ns. Steps are those of events: step k leads from state k to
// state k + 1.
struct Timeline {
  static constexpr std::uint32_t kNobody = 0xffff'ffffu;
  enum class Fate : std::uint8_t {
    kCommitted = 0,
    kCommittedAgain = 1,  // after a rollback had undone it
    kRolledBack = 2,
    kRepeated = 3,  // as it stood: coasts forward
    kOpen = 4,      // the run ended before
  };
  // Executions of one world that follow each other and had the same fate: one, or those of as many
  // steps as `steps_a_bar`.
  struct Bar {
    std::int64_t began_ns = 0, ended_ns = 0, busy_ns = 0;
    std::uint32_t world = 0;
    std::int64_t step = 0, last_step = 0;
    std::uint8_t phase = 0;  // models::Phase of the first
    Fate fate{};
    std::uint32_t rollback = kNobody;  // of `rollbacks`, which undid them
  };
  // A message that came late.
  struct Arrow {
    std::uint32_t from = 0;  // a world, or kNobody: from outside
    std::int64_t sent_ns = 0, arrived_ns = 0;
    double sent_at = 0.0;  // virtual time in steps, with phases as eighths
    bool anti = false;
  };
  struct Rollback {
    std::uint32_t number = 0;  // of the log, from 1, as `soda why --rollback` takes it
    std::uint32_t world = 0;
    std::int64_t at_ns = 0, restart = 0, changed_step = 0;
    double changed_at = 0.0;  // virtual time, as above
    std::uint32_t undone = 0, put_back = 0;
    std::int64_t wasted_ns = 0;
    std::uint32_t because_of = kNobody;  // of `rollbacks`
    std::uint32_t cause = 0;             // of `causes`
    std::vector<std::uint32_t> bodies;   // ids; 24 at most
    std::vector<Arrow> arrows;           // 6 at most
    std::string text;                    // as `soda why` says it; empty beyond kMostTexts
  };
  // What happened between two times on the clock, and how far each world was at the second.
  struct Sample {
    std::uint32_t executed = 0, undone = 0;
    std::int64_t committed = 0;         // steps
    std::vector<std::int64_t> reached;  // step that a world is at, by world
  };
  struct StepCost {
    std::int64_t kept_ns = 0, in_vain_ns = 0;
  };
  struct Commit {
    std::int64_t steps = 0, at_ns = 0;  // so many steps are committed from then on
  };

  std::uint32_t worlds = 0;
  std::int64_t buffer = 0;   // entries
  bool is_modelled = false;  // the clock
  std::uint64_t all_executions = 0, all_rollbacks = 0;
  std::int64_t steps_a_bar = 0;  // 0: each bar is one execution
  std::int64_t end_ns = 0;       // from 0 on
  std::vector<Bar> bars;         // by world, then time
  std::vector<std::string> causes;
  std::vector<Rollback> rollbacks;  // by time; the costliest
  std::vector<Sample> samples;      // equally far apart
  std::int64_t steps_a_cost = 1;
  std::vector<StepCost> costs;  // of so many steps each, from the log's first on
  std::vector<Commit> commits;  // ascending in both
};

// Nothing if the log has no trace. Throws FileError as read_trace().
std::optional<Timeline> timeline_of(LogReader& log, const scenarios::Scenario& scenario);

}  // namespace soda::analysis
