// Further passes of a step: bodies that impacts have sent on, sent to the worlds where they come to
// something new.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "models/world/outgoing.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// A world that owns a body decides whether what is sent on meets it: it alone knows how the step
// ends for its body. It hears of what comes into its cells from the owner, and of what comes to its
// body elsewhere from the world that would test that pair in the first pass (border_contacts.hpp).
class LaterPasses {
 public:
  explicit LaterPasses(StepInProgress& step) : step_(step) {}

  void start() { sent_.clear(); }
  // Whether bodies have been sent on in this step, here or elsewhere.
  bool any_sent() const { return !step_.scratch.passes.ever_sent().empty() || !sent_.empty(); }
  // Foreign ones; ascending by id.
  const std::vector<SentBody>& foreign_sent() const { return sent_; }

  // Own bodies that were sent on in the pass of `now` go where their boxes lead, in time for the
  // next one.
  void send(kernel::VirtualTime now, Outgoing& out);
  // Those of other worlds that come into own cells; passed on to whom they come to there.
  void receive(kernel::VirtualTime now, Bag bag, Outgoing& out);
  // All bodies that are sent on, and own bodies that they may come to: they are connected, and the
  // owner receives the contact. Whether there are such.
  bool connect(kernel::VirtualTime now, Bag bag, Outgoing& out);

 private:
  SentBody own(std::uint32_t place) const;
  void pass_on(const SentBody& sent, kernel::VirtualTime when, Outgoing& out);
  bool connect(const SentBody& sent, std::uint32_t own, std::map<WorldId, Fragment>& fragments);

  StepInProgress& step_;
  std::vector<SentBody> sent_;
};

}  // namespace soda::models
