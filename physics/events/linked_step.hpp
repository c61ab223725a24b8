// Islands with joints, over a step that may bring them to what was not seen to be on their way.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"

namespace soda::physics {

// Of looking for what joints draw bodies into.
Need linked_impacts_needed(const SceneDescription& scene);

// Contacts are looked for along the motion that a step begins with, but a joint or a motor can draw
// a body along with another within it. Where that takes a body to a static, or to another body of
// the island, that it has no manifold with, the island comes up to there only; then contacts are
// looked for again, among all pairs of the island and with all statics in reach, and the rest of
// the step follows. Where its joints are swept, and a body sinks in or was not seen to be on its
// way, the parts are substeps. The last part takes all that is left, with what it comes to held
// from its beginning on. Nor does a body get deeper into a static by more than half its width in a
// part: shorter parts err less, and where none does, the island stays for the rest of the step.
// Where one sinks in by a thousandth of its width, parts are shorter too, down to a twelfth of the
// step. Counts what it looks at as linked_searches. A function of the arguments only.
IslandReport advance_linked(const IslandStep& step, std::span<BodyState> states,
                            const IslandEffects& effects);

// Whether it is for an island with these manifolds: one of them is a joint.
bool is_linked(std::span<const ContactManifold> manifolds);

}  // namespace soda::physics
