#include <limits>
#include <type_traits>

#include "analysis/event_log/log_format.hpp"
#include "analysis/text/text_table.hpp"
#include "scenarios/format.hpp"

namespace soda::analysis {
namespace {

// Writes and reads the same fields in the same order, so that these are listed once.
class Writing {
 public:
  explicit Writing(ByteBuffer& out) : out_(out) {}

  template <class T>
  void number(const std::optional<T>& value, const char*, std::uint64_t, std::uint64_t) {
    put(out_, static_cast<std::uint8_t>(value.has_value()));
    put(out_, value ? static_cast<std::uint64_t>(*value) : std::uint64_t{0});
  }
  void real(const std::optional<double>& value, const char*, double, double) {
    put(out_, static_cast<std::uint8_t>(value.has_value()));
    put(out_, value.value_or(0.0));
  }
  void flag(bool value, const char*) { put(out_, static_cast<std::uint8_t>(value)); }
  void count(std::uint32_t value) { put(out_, value); }
  void log(LogLevel level, std::int64_t every, std::int64_t first_step) {
    put(out_, static_cast<std::uint8_t>(level));
    put(out_, every);
    put(out_, first_step);
  }

 private:
  ByteBuffer& out_;
};

class Reading {
 public:
  explicit Reading(ByteReader& in) : in_(in) {}

  template <class T>
  void number(std::optional<T>& value, const char* name, std::uint64_t least, std::uint64_t most) {
    const bool given = in_.take_flag();
    const auto bits = in_.take<std::uint64_t>();
    if (!given) return;
    if (bits < least || bits > most)
      throw DecodeError("holds " + std::to_string(bits) + " for the " + name +
                        "; allowed: " + std::to_string(least) + " to " + std::to_string(most));
    value = static_cast<T>(bits);
  }
  void real(std::optional<double>& value, const char* name, double least, double most) {
    const bool given = in_.take_flag();
    const double found = in_.take_double();
    if (!given) return;
    if (!(found >= least && found <= most))
      throw DecodeError("holds " + std::to_string(found) + " for the " + name);
    value = found;
  }
  void flag(bool& value, const char*) { value = in_.take_flag(); }
  void count(std::uint32_t& value) { value = in_.take<std::uint32_t>(); }
  void log(LogLevel& level, std::int64_t& every, std::int64_t& first_step) {
    const auto bits = in_.take<std::uint8_t>();
    if (bits >= kLogLevels.size()) throw DecodeError("holds log level " + std::to_string(bits));
    level = LogLevel{bits};
    every = in_.take<std::int64_t>();
    if (every < 1) throw DecodeError("holds states of every " + std::to_string(every) + "th step");
    first_step = in_.take<std::int64_t>();
    if (first_step < 0 || first_step > scenarios::kMaxSteps)
      throw DecodeError("begins before step " + std::to_string(first_step));
  }

 private:
  ByteReader& in_;
};

class Telling {
 public:
  explicit Telling(std::vector<OptionText>& out) : out_(out) {}

  template <class T>
  void number(const std::optional<T>& value, const char* name, std::uint64_t, std::uint64_t) {
    out_.push_back({name, value ? text(*value) : kNotGiven});
  }
  void real(const std::optional<double>& value, const char* name, double, double) {
    out_.push_back({name, value ? format_number(*value) : kNotGiven});
  }
  void flag(bool value, const char* name) { out_.push_back({name, text(value)}); }
  void count(std::uint32_t value) { out_.push_back({"ranks", text(value)}); }
  void log(LogLevel level, std::int64_t every, std::int64_t first_step) {
    out_.push_back({"first step", text(first_step)});
    out_.push_back({"log level", kLogLevels[static_cast<std::size_t>(level)]});
    out_.push_back({"states of every", text(every)});
  }

 private:
  static constexpr const char* kNotGiven = "not given";

  template <class T>
  static std::string text(T value) {
    if constexpr (std::is_same_v<T, bool>)
      return value ? "on" : "off";
    else if constexpr (std::is_enum_v<T>)
      return name_of(value);
    else
      return std::to_string(value);
  }

  std::vector<OptionText>& out_;
};

// What no run has is refused: warm rollbacks leave no log.
template <class Pass, class Options>
void pass_options(Pass& pass, Options& options) {
  constexpr std::uint64_t kAny = ~std::uint64_t{0};
  constexpr std::uint64_t kMostNumber = std::numeric_limits<unsigned>::max();
  constexpr double kMost_us = 1e12;
  auto& o = options.overrides;
  pass.number(o.executor, "executor", 0, static_cast<std::uint64_t>(models::ExecutorKind::kMpi));
  pass.number(o.threads, "threads", 1, kMostNumber);
  pass.number(o.worlds, "worlds", 1, scenarios::kMaxCells);
  pass.number(o.buffer, "buffer", 1, scenarios::kMaxBufferEntries);
  pass.number(o.steps, "steps", 0, scenarios::kMaxSteps);
  pass.number(o.seed, "seed", 0, kAny);
  pass.number(o.scheduling_seed, "scheduling seed", 0, kAny);
  pass.number(o.policy, "policy", 0,
              static_cast<std::uint64_t>(kernel::Synchronisation::kLockstep));
  pass.number(o.rollback, "rollback mode", 0,
              static_cast<std::uint64_t>(models::RollbackMode::kInvalidate));
  pass.number(o.gating, "gating", 0, 1);
  pass.number(o.split_islands, "splitting of islands", 0, 1);
  pass.number(o.ghosts, "ghosts", 0, static_cast<std::uint64_t>(models::GhostMode::kPredicted));
  pass.number(o.balancing, "balancing policy", 0,
              static_cast<std::uint64_t>(models::BalancingPolicy::kRandom));
  pass.number(o.balancing_interval, "balancing interval", 1, scenarios::kMaxBalancingInterval);
  pass.number(o.balancing_seed, "balancing seed", 0, kAny);
  auto& cluster = o.cluster;
  pass.number(cluster.processors, "processors", 1, kMostNumber);
  pass.real(cluster.latency_us, "latency", 0.0, kMost_us);
  pass.real(cluster.jitter_us, "jitter", 0.0, kMost_us);
  pass.real(cluster.cost_us, "cost of an event", 0.0, kMost_us);
  pass.real(cluster.bandwidth_mb_s, "bandwidth", 1e-3, 1e9);
  pass.real(cluster.gvt_interval_us, "interval of GVT", 0.0, kMost_us);
  pass.number(cluster.execution_seed, "execution seed", 0, kAny);
  pass.flag(cluster.check_purity, "check of purity");
  pass.flag(o.strict, "warnings are errors");
  pass.count(options.ranks);
  pass.log(options.level, options.every, options.first_step);
}

}  // namespace

ByteBuffer encode(const LoggedOptions& options) {
  ByteBuffer out;
  Writing writing(out);
  pass_options(writing, options);
  return out;
}

std::vector<OptionText> in_words(const LoggedOptions& options) {
  std::vector<OptionText> out;
  Telling telling(out);
  pass_options(telling, options);
  return out;
}

LoggedOptions decode_options(std::span<const unsigned char> bytes) {
  ByteReader in(bytes);
  LoggedOptions options;
  Reading reading(in);
  pass_options(reading, options);
  in.expect_end();
  if (options.ranks == 0 && options.overrides.executor == models::ExecutorKind::kMpi)
    throw DecodeError("holds the executor of ranks, but none");
  return options;
}

}  // namespace soda::analysis
