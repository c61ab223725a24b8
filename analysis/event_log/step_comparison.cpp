#include "analysis/event_log/step_comparison.hpp"

#include "analysis/text/text_table.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

std::string value(double number) { return format_exact(number) + " (" + format_bits(number) + ")"; }

std::string body_divergence(const physics::BodyState& logged, const physics::BodyState& replayed) {
  const physics::FieldDifference difference = physics::first_difference(logged, replayed);
  return std::string("field ") + difference.field + ": logged " + value(difference.a) +
         ", replayed " + value(difference.b);
}

}  // namespace

std::string divergence(const LoggedStep& logged, std::span<const physics::BodyId> ids,
                       std::span<const physics::BodyState> replayed,
                       std::span<const std::uint32_t> labels) {
  const std::string at_step = "step " + std::to_string(logged.step) + ": ";
  if (!logged.has_states) {
    const std::uint64_t digest = physics::digest(ids, replayed);
    if (digest == logged.digest) return {};
    return at_step + "digest " + format_digest(digest) + ", logged " +
           format_digest(logged.digest) + "; the log has no states of the step";
  }
  if (logged.states.size() != replayed.size()) {
    return at_step + std::to_string(logged.states.size()) + " bodies logged, " +
           std::to_string(replayed.size()) + " replayed";
  }
  const auto label = [&](physics::BodyId id) {
    return std::to_string(labels[physics::index_of(id)]);
  };
  for (std::size_t i = 0; i < replayed.size(); ++i) {
    if (logged.ids[i] != ids[i])
      return at_step + "body " + label(logged.ids[i]) + " logged, body " + label(ids[i]) +
             " replayed";
    if (physics::identical(logged.states[i], replayed[i])) continue;
    return at_step + "body " + label(ids[i]) + ", " +
           body_divergence(logged.states[i], replayed[i]);
  }
  const std::uint64_t digest = physics::digest(ids, replayed);
  if (digest == logged.digest) return {};
  return at_step + "every field agrees, but the logged digest is " + format_digest(logged.digest) +
         " and that of the logged and replayed states " + format_digest(digest) +
         ": the digest in the log was altered";
}

}  // namespace soda::analysis
