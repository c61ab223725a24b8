// Pairs of an island that may meet within a step, by body, and which of them is next.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "physics/broadphase/box_tree.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// A time that does not come.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

// Two bodies of the island, a < b, or one and a static. Places among its ids.
struct MeetingPair {
  std::uint32_t a = 0, b = 0;  // b: of a static its index, when `fixed`
  bool fixed = false;

  std::uint32_t other(std::uint32_t body) const { return body == a ? b : a; }
};

// Which pairs there are: those whose boxes have overlapped since the step began. An event changes
// who moves how, so boxes are those of the paths that bodies are on, and follow them.
class MeetingPairs {
 public:
  MeetingPairs(const SceneDescription& scene, const Geometry& geometry, std::span<const BodyId> ids,
               std::span<const BodyState> states, StageCounters& counters);

  std::size_t size() const { return pairs_.size(); }
  const MeetingPair& operator[](std::uint32_t pair) const { return pairs_[pair]; }
  // Those of a body, with bodies before statics, ascending.
  std::span<const std::uint32_t> of(std::uint32_t body) const { return of_[body]; }
  // Whether the two can meet on the paths that they are on.
  bool are_near(std::uint32_t pair) const;
  // The body is on another path for this share of the scene's step; pairs that it comes to are the
  // last ones then.
  void redirect(std::uint32_t body, const BodyState& state, double share, StageCounters& counters);
  // A pair that is known to meet; its number, old or new.
  std::uint32_t add(const MeetingPair& pair);

 private:
  Aabb box_of(std::uint32_t body, const BodyState& state) const;
  void add_statics_of(std::uint32_t body, StageCounters& counters);

  const SceneDescription& scene_;
  const Geometry& geometry_;
  std::span<const BodyId> ids_;
  BoxTree boxes_;
  std::vector<MeetingPair> pairs_;
  std::vector<std::vector<std::uint32_t>> of_;
  std::vector<std::uint32_t> found_;  // scratch
  std::vector<IndexPair> statics_;    // scratch
};

// The next pair, by its time; of equal times that of two bodies before that with a static, and the
// first of them. A function of the times only.
class NextPair {
 public:
  // From now on, instead of what was known. `time_s` infinite: never.
  void set(const MeetingPairs& pairs, std::uint32_t pair, double time_s);
  double time_s(std::uint32_t pair) const;  // infinite if never
  // None: infinite.
  double first_s();
  // There is one. It has no time then.
  std::uint32_t take_first();

 private:
  struct Entry {
    double time_s;
    MeetingPair of;
    std::uint32_t pair;
    bool operator<(const Entry& e) const;  // later, for the heap
  };
  std::vector<Entry> heap_;  // some are out of date
  std::vector<double> times_;
};

}  // namespace soda::physics
