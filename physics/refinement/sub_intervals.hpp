// A part of a step that is refined: trials over it, and what becomes of them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "physics/model/contact_manifold.hpp"
#include "physics/refinement/error_budget.hpp"
#include "physics/refinement/step_doubling.hpp"

namespace soda::physics {

struct SubInterval {
  double time_s = 0.0;
  int depth = 0;
  double bend = 0.0;  // widths, of the part that this is the first half of
};

// Such a part where it begins: from these states, with the contacts there.
struct StartedSubInterval : SubInterval {
  std::span<const BodyState> from;
  std::span<const ContactManifold> start;
};

struct SubIntervalResult {
  Trial trial;
  StepError error;
  bool is_limit = false;
};

// Where a part is cut in two: the first one's share of its time, and how many cuts that counts for.
struct Bisection {
  double share = 0.5;
  int halvings = 1;
  double bend = 0.0;  // widths, of the part; 0: not known
};

// A part's result, or the cut to be made.
struct RefinedSubInterval {
  std::optional<SubIntervalResult> result;
  Bisection cut = {};
};

// Whether it is a single body without joints but explicit springs: it is advanced by iterations,
// which leave nothing.
bool is_single_body(const RefinedIsland& island);

// Whether the scene asks for a tolerance.
bool is_asked(const RefinedIsland& island);

// Trials over a part: its result, within the budget if that is possible, or where it is to be cut.
// `known`: the contacts at `from` if they are known, else none. Where springs are explicit and
// their limit cannot be had, the part is one implicit step.
RefinedSubInterval advance_sub_interval(RefinedIsland& island, const SubInterval& part,
                                        std::span<const BodyState> from,
                                        std::span<const ContactManifold> known);

}  // namespace soda::physics
