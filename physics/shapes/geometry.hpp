// Collision geometry compiled from a scene, shared read-only by all worlds and threads.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

struct GeometryImpl;  // FCL objects; only shape_geometry.cpp and narrowphase.cpp see them

// Built once per run. Immutable: const use from several threads is safe and gives equal bits.
class Geometry {
 public:
  explicit Geometry(const SceneDescription& scene);
  ~Geometry();
  Geometry(Geometry&&) noexcept;
  Geometry& operator=(Geometry&&) noexcept;

  const GeometryImpl& impl() const { return *impl_; }
  // For whoever wants to know it again: no other geometry has its address as long as it is held.
  const std::shared_ptr<const GeometryImpl>& share() const { return impl_; }

 private:
  std::shared_ptr<const GeometryImpl> impl_;
};

// Box around everything the body can touch within the coming step: a pure function of its state
// (and the scene's constants). Tight, with the contact margin included; finite for finite states.
Aabb swept_aabb(const SceneDescription& scene, const Geometry& geometry, BodyId id,
                const BodyState& state);

// Indices into the arrays given, first < second.
struct IndexPair {
  std::uint32_t first = 0, second = 0;
  friend constexpr auto operator<=>(const IndexPair&, const IndexPair&) = default;
};

// All pairs of overlapping boxes, sorted. A function of the boxes only; no history.
// `pairs` is overwritten.
void find_pairs(Broadphase broadphase, std::span<const Aabb> boxes, std::vector<IndexPair>& pairs,
                StageCounters& counters);

// All (box index, static index) whose boxes overlap, sorted. `pairs` is overwritten.
void find_static_pairs(const Geometry& geometry, std::span<const Aabb> boxes,
                       std::vector<IndexPair>& pairs, StageCounters& counters);

// Which kernel collide uses for a pair of shapes, in either order.
ShapeKernel kernel_for(const Shape& a, const Shape& b);
// Whether FCL says along which direction shapes of this kernel meet.
bool is_asked_of_fcl(Narrowphase narrowphase, ShapeKernel kernel);

// Two bodies, or a body and a static, that may meet within dt_s from now on. Refers to what it is
// made of.
struct PairStep {
  const SceneDescription& scene;
  const Geometry& geometry;
  double dt_s;
  BodyId a;  // dynamic, and lower than b
  const BodyState& state_a;
  BodyId b;
  const BodyState* state_b;  // null: b is a static
};

// Appends a pair's manifolds (none if apart by more than the margin; one without points if it would
// meet as soon as a joint stops either). A function of ids, states and the scene only.
// Speculative: never throws or hangs for finite states, however absurd; what FCL returns is
// validated (finite, unit normal) and replaced or dropped otherwise, and counted.
void collide(const PairStep& pair, std::vector<ContactManifold>& out, StageCounters& counters);

}  // namespace soda::physics
