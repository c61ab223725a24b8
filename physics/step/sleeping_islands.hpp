// What a step would find again of islands at rest: a memory that saves work and changes no bit.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// Contacts and steps of islands are functions of states. So what was found of an island that a step
// left as it was (IslandReport::rests) holds for as long as its bodies keep their states: their
// contacts with each other and with statics, and that they have none with other bodies kept here.
//
// In each step: start(), then contacts, then islands, then finish(). When the scene has changed,
// forget() before.
class SleepingIslands {
 public:
  // Compares the bodies that were kept with these. `ids` ascending, states[i] of ids[i]; `ids` must
  // stay as they are until finish().
  void start(std::span<const BodyId> ids, std::span<const BodyState> states);

  // Appends the contacts of a pair whose bodies are as they were; else false. `b` may be static.
  bool take_contacts(BodyId a, BodyId b, std::vector<ContactManifold>& manifolds) const {
    return knows_any() && take_known_contacts(a, b, manifolds);
  }

  // The report of the island of just these bodies if all are as they were, else null: they stay as
  // they are. Valid until finish().
  const IslandReport* take_island(std::span<const BodyId> ids);

  // `report.rests`, of just these arguments.
  void keep(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
            std::span<const BodyState> states, const IslandReport& report);

  // Whether any body is as it was: else there is nothing to take.
  bool knows_any() const { return !held_.empty(); }

  // Islands that were neither taken nor kept since start() are dropped.
  void finish();
  void forget();

 private:
  struct Island {
    std::vector<BodyId> ids;
    std::vector<BodyState> states;
    std::vector<ContactManifold> manifolds;  // canonical order
    std::vector<std::uint32_t> begin;        // of body k as the lower one: begin[k] .. begin[k + 1]
    IslandReport report;
    std::size_t held = 0;  // bodies that are as they were
    bool met = false;      // since start()
  };
  // Of a body of the step: what was kept of it, if it is as it was.
  struct Held {
    Island* island = nullptr;
    std::uint32_t body = 0;
  };

  Held find(BodyId id) const;
  bool take_known_contacts(BodyId a, BodyId b, std::vector<ContactManifold>& manifolds) const;

  std::vector<Island> islands_;
  std::vector<Island> kept_;  // since start()
  std::span<const BodyId> ids_;
  std::vector<Held> held_;  // by place in ids_; empty if nothing was kept
};

}  // namespace soda::physics
