#include "models/world/contact_exchange.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace soda::models {

void ContactExchange::send_fragments(std::int64_t step, std::map<WorldId, Fragment> fragments,
                                     Outgoing& out) {
  WorldCounters& counters = step_.work.worlds;
  for (const WorldId expecting : waits_.expected().fragments_to) fragments[expecting];
  if (!waits_.groups().empty())
    add_group_fragments(
        waits_.groups(), step_.self,
        {step_.known_bodies(), step_.states, step_.merge.nodes, step_.scratch.manifolds},
        fragments);
  for (const auto& [target, fragment] : fragments) {
    note_exchanged(fragment.records, target, step_.merge);
    if (!fragment.records.manifolds.empty()) waits_.note_tested_for(target);
    if (waits_.are_on() && step_.repetition.can_take() && has_changed(fragment))
      out.cancel_eagerly(target);
    counters.fragments_sent += fragment.records.manifolds.size();
    for (const Fragment::OfGroup& group : fragment.groups) {
      note_exchanged(group.records, target, step_.merge);
      counters.records_sent += group.records.nodes.size() + group.records.manifolds.size();
    }
    out.send(target, time_of(step, Phase::kSync), MessageKind::kFragments,
             encode_fragment(fragment));
  }
}

// Whether a repetition has found that a body which this world tests for others moves otherwise.
bool ContactExchange::has_changed(const Fragment& fragment) const {
  const auto& nodes = fragment.records.nodes;
  return std::any_of(nodes.begin(), nodes.end(),
                     [this](const Node& node) { return !step_.repetition.unchanged(node.id); });
}

void ContactExchange::merge_round(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  const std::uint32_t round = merge_round_of(now), pass = pass_of(now);
  for (const kernel::MessageView& message : bag) take_in(now, message);
  step_.work.worlds.merge_rounds += !bag.empty();
  step_.memo.connects = step_.memo.connects || pass > 0;
  std::map<WorldId, Records> outgoing = lacking(round, pass);
  if (pass == 0) {
    for (const auto& [partner, records] : outgoing) waits_.note_records_to(round + 1, partner);
    for (const WorldId partner : waits_.partners_in(round + 1)) outgoing[partner];
  }
  for (const auto& [partner, records] : outgoing) {
    step_.work.worlds.records_sent += records.nodes.size() + records.manifolds.size();
    out.send(partner, time_of(now.t, Phase::kSync, round + 1, pass), MessageKind::kRecords,
             encode_records(records));
  }
}

void ContactExchange::take_in(kernel::VirtualTime now, const kernel::MessageView& message) {
  const WorldId from{kernel::index_of(message.source)};
  const bool is_first_pass = pass_of(now) == 0;
  if (message.kind == static_cast<std::uint32_t>(MessageKind::kFragments)) {
    const Fragment fragment = decode_fragment(message.payload);
    if (is_first_pass && !fragment.records.manifolds.empty()) waits_.note_tester(from);
    return take_fragment(step_.ids, step_.self, {from, fragment}, waits_.groups(), step_.merge,
                         step_.scratch.manifolds);
  }
  const Records records = decode_records(message.payload);
  const bool has_news = !records.nodes.empty() || !records.manifolds.empty();
  if (is_first_pass && has_news) waits_.note_records_from(merge_round_of(now), from);
  add_records(step_.ids, from, records, step_.merge, step_.scratch.manifolds);
}

// Records go as of the start of the step, also in a further pass.
std::map<WorldId, Records> ContactExchange::lacking(std::uint32_t round, std::uint32_t pass) {
  const std::vector<physics::BodyState> started =
      pass > 0 ? step_.states_at_start() : std::vector<physics::BodyState>{};
  return outgoing_records(round, step_.self, step_.known_bodies(),
                          pass > 0 ? started : step_.states, step_.scratch.manifolds, step_.merge);
}

}  // namespace soda::models
