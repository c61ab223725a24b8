// What the worlds of a run have done, counted.
#pragma once

#include <cstdint>

namespace soda::models {

// Work that only divided scenes have; sums over all worlds, speculative work included.
struct WorldCounters {
  std::uint64_t border_tests = 0;    // own bodies tested against the territory map
  std::uint64_t ghosts_sent = 0;     // body copies
  std::uint64_t fragments_sent = 0;  // cross-owner contacts sent to an owner
  std::uint64_t records_sent = 0;    // island records sent in merge rounds
  std::uint64_t merge_rounds = 0;    // sync executions that received records
  std::uint64_t migrations = 0;      // bodies sent to a new owner
  std::uint64_t mixed_islands = 0;   // solves (or shares) of islands with several owners
  std::uint64_t islands_reused = 0;  // mixed islands taken from another world's solve
  // Large ones among the mixed islands of which this world has solved a part or none, and received
  // how its bodies ended; and those that it had to solve whole, for others did not send.
  std::uint64_t islands_split = 0, splits_given_up = 0;
  // Solves that counted: for each committed step and world, the islands with one of its bodies.
  std::uint64_t solves_committed = 0;
  std::uint64_t entries_saved = 0;  // transform-buffer entries kept for rollback
  std::uint64_t bytes_sent = 0;     // payload bytes
  std::uint64_t inputs = 0;         // messages with user input that were taken in
  // What storing entries has taken from the heap, and what their states would take if none were
  // shared: sizeof a state and a contact impulse, without an allocator's own.
  std::uint64_t entries_stored = 0, bodies_stored = 0;
  std::uint64_t state_bytes_stored = 0, state_bytes_whole = 0;
  std::uint64_t memo_bytes_stored = 0;  // what a repetition of the step may take over
  // Of steps that were executed again: islands (bodies without contact count as one each) and their
  // bodies, computed again or taken over.
  std::uint64_t steps_repeated = 0;
  std::uint64_t steps_put_back = 0;  // stale entries that were valid as they stood
  // Late ghosts that made no difference: bags, and bodies looked at to find that out.
  std::uint64_t bags_absorbed = 0, absorption_looks = 0;
  std::uint64_t islands_repeated = 0, islands_taken = 0;
  std::uint64_t islands_warm = 0;  // of the repeated ones: solved from earlier multipliers
  std::uint64_t bodies_repeated = 0, bodies_taken = 0;
  // Bodies extrapolated, each time a step was executed with the extrapolated ghost. What a
  // neighbour sent for a step that had been executed with an extrapolation (the last one counts):
  // messages, and those that were as extrapolated, bit for bit; the bodies extrapolated, and those
  // that came just so.
  std::uint64_t ghosts_guessed = 0;
  std::uint64_t guesses_answered = 0, guesses_confirmed = 0;
  std::uint64_t ghosts_answered = 0, ghosts_confirmed = 0;
  // Contacts of two owners: found by some execution of a step whose committed execution does not
  // have them; and not found by some execution, though the committed one has them. Counted on the
  // virtual cluster, and where ghosts are extrapolated.
  std::uint64_t contacts_false = 0, contacts_missed = 0;
  std::uint64_t bodies_sampled = 0;  // for load balancing
  // Events that an undivided run has, too: the beginnings, pairs and ends of steps, of the first
  // world.
  std::uint64_t events_alone = 0;
};
WorldCounters& operator+=(WorldCounters& sum, const WorldCounters& more);

}  // namespace soda::models
