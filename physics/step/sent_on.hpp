// What hits send on. A step looks at who meets whom as bodies move when it begins. A hit sends a
// body another way, on which it may meet somebody else. The two are connected then, and the island
// of both is advanced anew from the start of the step: that is the step's next pass. The last pass
// is the one in which nobody comes to anybody new. Most steps have one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/need.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// Of further passes.
Need passes_needed(const SceneDescription& scene);

// Of an island with joints, as it is advanced in one piece, the label: its bodies have been looked
// for at each other all the way (linked_step.hpp). Of others none.
inline constexpr BodyId kNotLinked{0xffffffffu};
BodyId linked_label(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds);

// A body in a pass: how the step began and ended for it, the box of all that it has come to, and
// the linked label of the island that it is in.
struct MovingBody {
  BodyId id{};
  const BodyState& start;
  const BodyState& end;
  const Aabb& box;
  BodyId linked = kNotLinked;
};

// What the passes of one step know of each body, by its place. An island grows from pass to pass,
// so it is known by how many manifolds it has.
class Passes {
 public:
  void start(std::size_t bodies);
  // Whether an island of so many manifolds, in which this body is, has not been advanced yet; and
  // whether it has been in none.
  bool is_new(std::uint32_t place, std::size_t manifolds) const {
    return advanced_with_[place] != manifolds;
  }
  bool is_free(std::uint32_t place) const { return advanced_with_[place] == 0; }
  // The body's island, of this linked label, is about to be advanced: `state` is that of the step's
  // start afterwards.
  void begin(std::uint32_t place, std::size_t manifolds, BodyId linked, BodyState& state);
  BodyId linked_label_of(std::uint32_t place) const { return linked_[place]; }
  // Its island stays as it is.
  void keep(std::uint32_t place, std::size_t manifolds);
  // It has been advanced, and ends in this state. `box`: its swept box of the start; null: to be
  // made where it is needed.
  void end(const SceneDescription& scene, const Geometry& geometry, BodyId id, std::uint32_t place,
           const BodyState& state, const Aabb* box);
  // As the step began; `now` is its present state.
  const BodyState& start_of(std::uint32_t place, const BodyState& now) const {
    return began_[place] ? starts_[place] : now;
  }
  // As this pass ended, without contacts if its island has not been advanced.
  BodyState end_of(const SceneDescription& scene, BodyId id, std::uint32_t place,
                   const BodyState& now) const;

  // Who was sent on in this step and has been advanced in this pass: places, and boxes now. Until
  // the next pass begins.
  struct Sent {
    std::uint32_t place = 0;
    Aabb box;
  };
  const std::vector<Sent>& sent() const { return sent_; }
  // All that were sent on in this step, with their boxes now.
  const std::vector<Sent>& ever_sent() const { return ever_sent_; }
  bool was_sent(std::uint32_t place) const { return sent_as_[place] != 0; }
  const Aabb& box_of_sent(std::uint32_t place) const { return ever_sent_[sent_as_[place] - 1].box; }
  void next_pass() { sent_.clear(); }

 private:
  std::vector<std::uint32_t> advanced_with_;  // manifolds; 0: not yet
  std::vector<BodyId> linked_;
  std::vector<char> began_;
  std::vector<std::uint32_t> sent_as_;  // number in ever_sent_, from 1 on
  std::vector<BodyState> starts_;       // where it began
  std::vector<Sent> sent_, ever_sent_;
};

// Whether two bodies may meet on their paths, and nobody has looked: where they end they do, or
// what parts them when the step begins is closed, on two straight legs each, as of a body that
// turned once at whatever time, and by what a body that turned more often is off those.
bool may_meet(const SceneDescription& scene, const Geometry& geometry, const MovingBody& a,
              const MovingBody& b, StageCounters& counters);

// Connects two bodies, a < b, by a manifold without points, unless they have one or never touch.
// `start_a` is the state of a when the step began. The manifolds stay in canonical order. Returns
// whether it did.
bool connect(const SceneDescription& scene, BodyId a, const BodyState& start_a, BodyId b,
             std::vector<ContactManifold>& manifolds);

}  // namespace soda::physics
