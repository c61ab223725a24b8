#include "models/world/step_recorder.hpp"

#include <algorithm>
#include <utility>

namespace soda::models {

using physics::BodyId;
using physics::ContactManifold;

void StepRecorder::start(std::int64_t step, std::vector<Migrant> migrants) {
  const StoredEntry* const replaced = step_.propagates() ? buffer_.stale_next() : nullptr;
  step_.repetition.start(buffer_.differs(step), replaced, *step_.rules.map);
  step_.repetition.note_own(step_.ids, migrants);
  step_.memo.valid = step_.remembers;
  step_.memo.connects = false;
  step_.memo.sent.clear();
  if (step_.remembers) std::swap(step_.memo.migrants, migrants);
  step_.work.worlds.steps_repeated += step_.repetition.repeats();
}

void StepRecorder::note_inputs(std::vector<BodyId> touched) {
  // Of what was computed with other materials, nothing can be taken.
  if (step_.repetition.repeats())
    step_.repetition.note_constants(rules_of(*buffer_.stale_next()).scene == step_.rules.scene);
  step_.repetition.note_touched(touched);
  if (step_.remembers) std::swap(step_.memo.touched, touched);
}

void StepRecorder::remember_contacts(std::int64_t step,
                                     std::span<const ContactManifold> for_others) {
  if (!step_.remembers) return;
  step_.memo.ghosts = step_.ghosts;
  std::vector<ContactManifold> merged;
  std::span<const ContactManifold> tested = step_.scratch.manifolds;
  if (!for_others.empty()) {
    merged.assign(tested.begin(), tested.end());
    merged.insert(merged.end(), for_others.begin(), for_others.end());
    std::sort(merged.begin(), merged.end(), canonical_before);
    tested = merged;
  }
  const std::uint64_t before = buffer_.memory().taken_bytes;
  step_.memo.tested = {buffer_.memory(), tested, buffer_.stored(step)->tested};
  step_.work.worlds.memo_bytes_stored += buffer_.memory().taken_bytes - before;
}

void StepRecorder::write_entry(std::int64_t step, bool somebody_leaves, bool keeps_history,
                               Outgoing& out) {
  std::vector<BodyId> differs = step_.repetition.differences(step_.ids, step_.states);
  for (const WorldId partner : waits_.concerned(differs)) out.cancel_eagerly(partner);
  step_.memo.valid = step_.memo.valid && step_.report.faults.empty();
  const StoredEntry* const stale = buffer_.stale_next();
  const bool differs_now = stale != nullptr && differs_from(*stale);
  const std::int64_t spent_before = stale != nullptr ? stale->spent_ns : 0;
  buffer_.differs(step).clear();
  buffer_.frame_differs(step) = false;
  BufferEntry& entry = buffer_.append();
  entry.frame_differs = differs_now || (stale != nullptr && !buffer_.has_stale());
  if (step_.around.sampling.interval > 0) entry.spent_ns = spent_since_last_entry() + spent_before;
  std::swap(entry.ids, step_.ids);
  std::swap(entry.states, step_.states);
  std::swap(entry.islands, step_.report.islands);
  std::swap(entry.memo, step_.memo);
  entry.solves = step_.solves;
  std::swap(entry.dependencies, waits_.next());
  std::swap(entry.view, extrapolation_.view());
  entry.rules = step_.rules;
  entry.may_leave = somebody_leaves;
  std::swap(entry.differs, differs);
  // Now, while the states are in the cache: before the next step others are executed.
  if (keeps_history) buffer_.store_open(step_.work.worlds);
}

// In anything but the states of bodies.
bool StepRecorder::differs_from(const StoredEntry& stale) {
  return stale.frame_differs || !has_ids(stale, step_.ids) ||
         stale.dependencies.items().front() != waits_.next() || rules_of(stale) != step_.rules ||
         !(view_of(stale) == extrapolation_.view());
}

std::int64_t StepRecorder::spent_since_last_entry() {
  const WorkReading before = std::exchange(work_at_entry_, step_.work);
  return work_cost(before, work_at_entry_, kernel::Synchronisation::kOptimistic).sum_ns();
}

}  // namespace soda::models
