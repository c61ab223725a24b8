#include "analysis/trace/trace_words.hpp"

#include <algorithm>
#include <array>

#include "analysis/text/text_table.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

// By kernel::Happening.
constexpr std::array kHappenings{"sent",   "adopted",   "arrived", "late",        "executed",
                                 "cost",   "absorbed",  "rewound", "rolled_back", "put_back",
                                 "jumped", "committed", "gvt",     "settled"};
static_assert(kHappenings.size() == kernel::kHappenings);

std::string spaced(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

}  // namespace

std::string event_words(kernel::VirtualTime time) {
  const std::size_t kind = models::kind_of(time);
  const auto names = models::event_kinds();
  return kind < names.size() && *names[kind] != '\0' ? spaced(names[kind])
                                                     : "phase " + std::to_string(kind);
}

std::string words_of(kernel::VirtualTime time) {
  std::string text = "step " + std::to_string(time.t);
  const models::Phase phase = models::phase_of(time);
  if (phase == models::Phase::kBegin) return text + ", begin";
  const std::uint32_t pass = models::pass_of(time), round = models::merge_round_of(time);
  if (pass > 0 && phase != models::Phase::kFinish) text += ", pass " + std::to_string(pass);
  text += ", " + event_words(time);
  return round > 0 ? text + ", round " + std::to_string(round) : text;
}

const char* happening_name(kernel::Happening what) {
  return kHappenings[static_cast<std::size_t>(what)];
}

std::string happening_words(kernel::Happening what) { return spaced(happening_name(what)); }

std::string message_words(std::uint32_t kind) { return spaced(models::message_kinds()[kind]); }

std::string milliseconds(std::int64_t ns) {
  return format_number(1e-6 * static_cast<double>(ns)) + " ms";
}

std::string world_words(std::uint32_t world) {
  return world == kernel::index_of(kernel::kExternalSource) ? "outside"
                                                            : "world " + std::to_string(world);
}

std::string message_name(std::uint32_t source, std::uint64_t number) {
  const bool is_external = source == kernel::index_of(kernel::kExternalSource);
  return (is_external ? "outside" : std::to_string(source)) + ":" + std::to_string(number);
}

std::string counted(std::uint64_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace soda::analysis
