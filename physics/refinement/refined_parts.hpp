// A part of a step that is refined: trials over it, and what becomes of them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "physics/model/contact_manifold.hpp"
#include "physics/refinement/error_budget.hpp"
#include "physics/refinement/refined_trials.hpp"

namespace soda::physics {

struct Part {
  double time_s = 0.0;
  int depth = 0;
  double bend = 0.0;  // widths, of the part that this is the first half of
};

// Such a part where it begins: from these states, with the contacts there.
struct StartedPart : Part {
  std::span<const BodyState> from;
  std::span<const ContactManifold> start;
};

struct PartResult {
  Trial trial;
  StepError error;
  bool is_limit = false;
};

// Where a part is cut in two: the first one's share of its time, and how many cuts that counts for.
struct Cut {
  double share = 0.5;
  int halvings = 1;
  double bend = 0.0;  // widths, of the part; 0: not known
};

// A part's result, or the cut to be made.
struct RefinedPart {
  std::optional<PartResult> result;
  Cut cut = {};
};

// Whether it is a single body without joints but springs that kick: it is advanced by sweeps, which
// leave nothing.
bool is_lone(const RefinedIsland& island);

// Whether the scene asks for a tolerance.
bool is_asked(const RefinedIsland& island);

// Trials over a part: its result, within the budget if that is possible, or where it is to be cut.
// `known`: the contacts at `from` if they are known, else none. Where springs kick and their limit
// cannot be had, the part is one implicit step.
RefinedPart advance_part(RefinedIsland& island, const Part& part, std::span<const BodyState> from,
                         std::span<const ContactManifold> known);

}  // namespace soda::physics
