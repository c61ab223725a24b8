// What a world exchanges with others of contacts between their bodies: fragments, and records in
// merge rounds.
#pragma once

#include <cstdint>
#include <map>

#include "models/world/dependency_waits.hpp"
#include "models/world/outgoing.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// Takes in and sends; what the world knows by that is the merge of the step (island_merge.hpp).
class ContactExchange {
 public:
  ContactExchange(StepInProgress& step, DependencyWaits& waits) : step_(step), waits_(waits) {}

  // Contacts that this world has tested. Those that another one waits for are sent even if they are
  // empty.
  void send_fragments(std::int64_t step, std::map<WorldId, Fragment> fragments, Outgoing& out);
  // One merge round: takes in records, passes on what others lack. Round 0 takes in fragments. In
  // further passes nobody is waited for.
  void merge_round(kernel::VirtualTime now, Bag bag, Outgoing& out);

 private:
  bool has_changed(const Fragment& fragment) const;
  void take_in(kernel::VirtualTime now, const kernel::MessageView& message);
  std::map<WorldId, Records> lacking(std::uint32_t round, std::uint32_t pass);

  StepInProgress& step_;
  DependencyWaits& waits_;
};

}  // namespace soda::models
