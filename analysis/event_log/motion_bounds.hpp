// Where each body is in some steps of a log: what is far from all of it need not be read.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "analysis/text/byte_codec.hpp"
#include "physics/model/body_state.hpp"

namespace soda::analysis {

// So many steps have bounds of their own.
inline constexpr std::int64_t kBoundedSteps = 32;

// Of a body's centre of mass, and of where its velocity would take it in another step.
struct CentreBounds {
  std::array<float, 3> low_m, high_m;  // low > high: the body is not there
};

struct MotionBounds {
  std::int64_t first_step = 0, last_step = 0;  // both are within
  // Of all bodies; infinite if any state was no number.
  double most_speed_m_s = 0.0, most_spin_rad_s = 0.0;
  std::vector<CentreBounds> bodies;  // of the log
};

// Of one step after the other.
class GatheredBounds {
 public:
  // `bodies` of the log; `dt_s`: its step.
  void begin(std::size_t bodies, double dt_s);
  // Ids that the log has not are left out.
  void add(std::int64_t step, std::span<const physics::BodyId> ids,
           std::span<const physics::BodyState> states);
  // Of more than one step, since begin() or the last that was taken; `last` is in the next, too.
  bool any() const { return last_step_ > first_step_; }
  // Bounds rounded outwards, as they stand in a block.
  ByteBuffer encoded() const;
  // Those that follow.
  void restart();

 private:
  struct Bounds {
    std::array<double, 3> low, high;
  };
  double dt_s_ = 0.0;
  std::int64_t first_step_ = -1, last_step_ = -1;
  double speed2_ = 0.0, spin2_ = 0.0;
  bool finite_ = true;
  std::vector<Bounds> bodies_;
};

// Throws DecodeError if the bytes are not those of so many bodies.
MotionBounds decode_bounds(std::span<const unsigned char> bytes, std::size_t bodies);

}  // namespace soda::analysis
