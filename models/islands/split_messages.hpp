// What solvers of a large island send each other, and the owners of its bodies.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "physics/solvers/split_solver.hpp"

namespace soda::models {

// An island as two worlds name it to each other: its smallest id and a hash of all of its content.
// Worlds that know an island otherwise have nothing to send each other.
struct IslandName {
  physics::BodyId label{};
  std::array<std::uint64_t, 2> content{};

  friend bool operator==(const IslandName&, const IslandName&) = default;
};

// Velocities at a border of a block, from the solver of the block before it or behind it.
struct BorderNews {
  IslandName island;
  std::uint32_t border = 0;
  bool from_before = false;
  std::vector<physics::BorderBody> bodies;
};

// What the impulses in a range of blocks do, all of them.
struct WorkNews {
  IslandName island;
  std::uint32_t first = 0;
  std::vector<physics::StepWork> work;  // of each block
};

// How a range of blocks ended.
struct BlockNews {
  struct Moved {
    physics::BodyId id{};
    physics::BodyState state;
  };
  IslandName island;
  std::uint32_t first = 0, last = 0;
  std::vector<Moved> bodies;                  // those of the receiver; ascending
  std::vector<physics::AdvanceFault> faults;  // of these
  std::vector<physics::BlockReport> reports;  // of each block; without the work
};

kernel::Payload encode_border_news(const BorderNews& news);
BorderNews decode_border_news(std::span<const std::byte> payload);
kernel::Payload encode_work_news(const WorkNews& news);
WorkNews decode_work_news(std::span<const std::byte> payload);
kernel::Payload encode_block_news(const BlockNews& news);
BlockNews decode_block_news(std::span<const std::byte> payload);
// Of any of these.
IslandName island_named_in(std::span<const std::byte> payload);

}  // namespace soda::models
