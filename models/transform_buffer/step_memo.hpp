// What an execution of a step has met and found out, kept for a repetition of the same step.
#pragma once

#include <cstdint>
#include <vector>

#include "models/messages/messages.hpp"
#include "models/transform_buffer/shared_list.hpp"

namespace soda::models {

template <>
struct ListItem<physics::ContactManifold> {
  static physics::BodyId key(const physics::ContactManifold& manifold) { return manifold.a; }
  static bool same(const physics::ContactManifold& a, const physics::ContactManifold& b);
};

struct StepMemo {
  // The island that an own body was in: its label and how many bodies; 0 bodies if the island had
  // foreign ones, too, or was advanced in a further pass. A body without contact is an island of
  // itself.
  struct Membership {
    physics::BodyId label{};
    std::uint32_t bodies = 0;
  };

  // An own body that covers a cell at the territory's border; for each such cell once.
  struct BorderBody {
    std::uint32_t cell = 0;
    physics::BodyId id{};
    physics::Aabb box;  // swept
  };

  // All ways of a body that an impact has sent on.
  struct SentWay {
    WorldId owner{};
    physics::Aabb box;
  };

  bool valid = false;
  bool connects = false;          // further passes have connected bodies, or were sent to others
  std::vector<Migrant> migrants;  // those that became own bodies; ascending by id
  std::vector<physics::BodyId> touched;         // by user input; ascending
  std::vector<Ghost> ghosts;                    // ascending by id
  SharedList<physics::ContactManifold> tested;  // by this world; canonical order
  std::vector<SentWay> sent;                    // foreign ones, too
  std::vector<BorderBody> border;               // ascending by cell, then by id
  std::vector<Membership> islands;              // of each own body, by id
};

}  // namespace soda::models
