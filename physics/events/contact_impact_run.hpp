// The run of an island through a step, from hit to hit.
#pragma once

#include <span>
#include <vector>

#include "physics/events/impacting_contacts.hpp"
#include "physics/events/meeting_pairs.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// An island on its way through a step. Its bodies are in sets that contacts hold together, each at
// its own time. A set is advanced when a pair of it is to be looked at, which is before the pair
// can hit; so all times are at most that of the pair that is next.
class ContactImpactRun {
 public:
  // `apart`: contacts that hold nothing make no set. Adds to the report.
  ContactImpactRun(const ContactImpactIsland& island, bool apart, std::span<BodyState> states,
                   IslandReport& report, const IslandEffects& effects);
  // Whether there is work enough for the hits that are known to come.
  bool is_affordable();
  // Whether something came near enough to be looked at again.
  bool run();
  // Afterwards: whether contacts that make no set have kept their gaps.
  bool stayed_apart() const;

 private:
  struct Look {  // at a pair
    std::vector<ContactManifold> found;
    double time_s = -1.0;
    bool held = false;   // the pair is in one set
    bool comes = false;  // for a hit that was known at the start
  };
  using Bodies = std::vector<std::uint32_t>;

  std::span<const BodyState> states() const { return states_; }
  bool is_at(const MeetingPair& pair, double now_s) const {
    return since_s_[pair.a] == now_s && (pair.fixed || since_s_[pair.b] == now_s);
  }
  BodyId other(const MeetingPair& pair) const {
    return pair.fixed ? static_id(pair.b) : island_.ids[pair.b];
  }
  ContactManifold link_of(std::uint32_t pair) const {
    ContactManifold link;
    link.a = island_.ids[pairs_[pair].a];
    link.b = other(pairs_[pair]);
    return link;
  }
  void expect(std::uint32_t pair, double ahead_s);
  bool is_held(const Look& look, double now_s) const;
  std::size_t work_of(const Bodies& set) const;
  double work() const;  // of the step until now
  void look(std::uint32_t pair, double now_s);
  bool makes_a_set(std::uint32_t pair, bool all) const;
  Bodies set_of(std::uint32_t body, bool all);
  void advance_set(const Bodies& set, double to_s, bool all);
  void bring(std::uint32_t body, double to_s);
  void look_after(const Bodies& set, std::span<const BodyState> before, double from_s,
                  double now_s);
  void redirect(std::uint32_t body, double now_s);
  Bodies bodies_of_impact(std::uint32_t pair, double now_s, std::vector<ContactManifold>& touching);
  bool resolve_impact_at(std::uint32_t pair, double now_s);
  void finish(double now_s);

  ContactImpactIsland island_;
  bool apart_;
  std::span<BodyState> states_;
  IslandReport& report_;
  IslandEffects effects_;
  MeetingPairs pairs_;
  NextPair next_;
  std::vector<Look> looks_;
  std::vector<double> since_s_, errors_;
  std::vector<char> taken_, in_impact_, taken_pairs_;  // scratch
  std::size_t events_ = 0;
};

}  // namespace soda::physics
