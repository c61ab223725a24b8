// The load of a world at a committed step: what load balancing is decided from.
#pragma once

#include <cstdint>
#include <vector>

#include "kernel/api/payload.hpp"
#include "models/transform_buffer/transform_buffer.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::models {

// When samples are taken, and for when.
struct LoadSampling {
  std::int64_t interval = 0;  // every so many steps; 0: never
  // Steps from a sample until what is decided from it begins and ceases to hold: bodies are counted
  // where they will be then if they go on as they do.
  std::int64_t from = 0, until = 0;
  bool splits_islands = false;  // the run solves large islands block by block

  bool takes(std::int64_t step) const { return interval > 0 && step % interval == 0; }
};

struct BodyLoad {
  physics::BodyId id{};
  std::uint32_t cell = 0;    // where it will be at first,
  std::uint32_t later = 0;   // and where at last
  std::int64_t cost_ns = 0;  // modelled, of a step, without the solve of its island
};
struct BodyLink {
  physics::BodyId a{}, b{};  // in contact, a < b, both dynamic; a is a body of the sample
};
struct IslandLoad {
  physics::BodyId label{};
  std::int64_t solve_ns = 0;   // modelled
  bool is_shared_out = false;  // the processors that have a part of it each do a part of the solve
};

struct LoadSample {
  WorldId world{};
  std::int64_t step = 0;
  std::int64_t spent_ns = 0;     // modelled, of all executions of the step before
  std::int64_t entries = 0;      // in store beyond `step`, when GVT passed it
  std::vector<BodyLoad> bodies;  // own; ascending
  std::vector<BodyLink> links;
  std::vector<IslandLoad> islands;  // whose label is an own body
};

// Of the bodies of `entry`, which are about to begin step entry.step. A function of the entry:
// it does not matter who calls it and when. `spent_ns` and `entries` are the caller's.
LoadSample sample_load(WorldId world, const BufferEntry& entry, const physics::Geometry& geometry,
                       const LoadSampling& sampling);

// Who gathers samples, from any thread.
class LoadSink {
 public:
  virtual ~LoadSink() = default;
  virtual void add(LoadSample sample) = 0;
};

kernel::Bytes encode_load(const LoadSample& sample);
LoadSample decode_load(std::span<const std::byte> bytes);

}  // namespace soda::models
