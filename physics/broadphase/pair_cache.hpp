// Which boxes overlap, where most bodies are about where they were some steps before.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// Keeps for each body a fat box in which it may move and turn, with bounds of its speeds, and the
// pairs whose fat boxes overlap. As long as a body is within its bounds, its swept box lies in its
// fat box, so that it need not be made to know that it meets no other. It is no state: the answer
// is the same with and without what is kept, whatever was asked before (other bodies, another
// scene).
class PairCache {
 public:
  // Bodies whose pairs are sought.
  struct Input {
    const SceneDescription& scene;
    const Geometry& geometry;
    std::span<const BodyId> ids;
    std::span<const BodyState> states;
    std::span<const Aabb> given;  // a box for each body; none: the few are made that it takes
  };
  // All pairs of overlapping swept boxes, sorted: those that find_pairs() finds. `pairs` is
  // overwritten.
  void find(const Input& in, std::vector<IndexPair>& pairs, StageCounters& counters);

  // Whether what was kept has served the last time.
  bool served() const { return served_; }
  // Then, or if no boxes were given: what holds a body's swept box, or is that.
  Aabb fat_box(std::uint32_t body) const {
    if (!served_) return boxes_[body];
    const Near& near = near_[body];
    const Vec3 place(near.x, near.y, near.z), reach = Vec3::Constant(near.reach_m);
    return {place - reach, place + reach};
  }

 private:
  // What a body must keep to. Its floats are numbers of their own, so nothing is lost by rounding.
  struct Bounds {
    std::array<float, 3> centre_m{};
    float slack_m = -1.0f;  // the centre of mass is within it of centre_m, along each axis
    float speed2 = 0.0f, angular_speed2 = 0.0f;
    // Then the swept box is within it of the centre of mass.
    float reach_m = std::numeric_limits<float>::infinity();

    bool is_void() const { return slack_m < 0.0f; }
  };
  // Where a body's swept box lies: all within reach_m of a place. Small, as it is read in any
  // order.
  struct Near {
    float x = 0.0f, y = 0.0f, z = 0.0f, reach_m = 0.0f;
  };
  // Along x, and no less than that of the fat box.
  struct Stretch {
    float from = 0.0f, to = 0.0f;
  };

  bool is_for(const Input& in) const;
  bool is_kept(const Input& in);
  bool keep(const Input& in);
  Bounds bounds_of(const Input& in, std::size_t body) const;
  void look(const Input& in);
  void renew(const Input& in);
  void merge_found(std::vector<IndexPair>& pairs);
  static bool keeps_to(const BodyState& state, const Bounds& bounds);
  static Aabb fat_box_of(const Bounds& bounds);
  static Stretch stretch_of(const Aabb& fat_box);
  static Near near_of(const Vec3& position_m, float reach_m);
  void choose_near();
  void make_boxes(const Input& in);
  std::span<const Aabb> boxes_of(const Input& in) const;
  void add_pairs_of_unbounded(const Input& in, std::vector<IndexPair>& pairs);
  void find_anew(const Input& in, std::vector<IndexPair>& pairs, StageCounters& counters);

  // What is kept, and of what.
  std::shared_ptr<const GeometryImpl> geometry_;
  double dt_s_ = 0.0;
  Vec3 gravity_m_s2_ = Vec3::Zero();
  std::vector<BodyId> ids_;
  double usual_speed_m_s_ = 0.0, usual_angular_speed_rad_s_ = 0.0;
  std::vector<Bounds> bounds_;
  std::vector<Stretch> stretches_;
  std::vector<IndexPair> candidates_;  // sorted; of bodies with bounds
  std::vector<std::uint32_t> unbounded_;
  bool served_ = false;
  int age_ = 0;                     // steps
  int pause_ = 0, next_pause_ = 8;  // steps for which keeping is not tried

  // Of one step; memory only.
  std::vector<Near> near_;
  std::vector<std::uint32_t> lost_;  // bodies beyond their bounds
  std::vector<Aabb> boxes_;
  std::vector<std::uint8_t> wanted_, renewed_;
  std::vector<double> speeds_;
  std::vector<IndexPair> found_;
};

}  // namespace soda::physics
