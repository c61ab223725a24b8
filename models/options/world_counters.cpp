// Sums of what worlds count.
#include "models/options/world_counters.hpp"

namespace soda::models {

WorldCounters& operator+=(WorldCounters& sum, const WorldCounters& more) {
  sum.border_tests += more.border_tests;
  sum.ghosts_sent += more.ghosts_sent;
  sum.fragments_sent += more.fragments_sent;
  sum.records_sent += more.records_sent;
  sum.merge_rounds += more.merge_rounds;
  sum.migrations += more.migrations;
  sum.mixed_islands += more.mixed_islands;
  sum.islands_reused += more.islands_reused;
  sum.islands_split += more.islands_split;
  sum.splits_given_up += more.splits_given_up;
  sum.solves_committed += more.solves_committed;
  sum.entries_saved += more.entries_saved;
  sum.bytes_sent += more.bytes_sent;
  sum.inputs += more.inputs;
  sum.entries_stored += more.entries_stored;
  sum.bodies_stored += more.bodies_stored;
  sum.state_bytes_stored += more.state_bytes_stored;
  sum.state_bytes_whole += more.state_bytes_whole;
  sum.memo_bytes_stored += more.memo_bytes_stored;
  sum.steps_repeated += more.steps_repeated;
  sum.steps_put_back += more.steps_put_back;
  sum.bags_absorbed += more.bags_absorbed;
  sum.absorption_looks += more.absorption_looks;
  sum.islands_repeated += more.islands_repeated;
  sum.islands_taken += more.islands_taken;
  sum.islands_warm += more.islands_warm;
  sum.bodies_repeated += more.bodies_repeated;
  sum.bodies_taken += more.bodies_taken;
  sum.ghosts_guessed += more.ghosts_guessed;
  sum.guesses_answered += more.guesses_answered;
  sum.guesses_confirmed += more.guesses_confirmed;
  sum.ghosts_answered += more.ghosts_answered;
  sum.ghosts_confirmed += more.ghosts_confirmed;
  sum.contacts_false += more.contacts_false;
  sum.contacts_missed += more.contacts_missed;
  sum.bodies_sampled += more.bodies_sampled;
  sum.events_alone += more.events_alone;
  return sum;
}

}  // namespace soda::models
