#include "analysis/event_log/checkpoint.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "analysis/event_log/log_writer.hpp"
#include "models/user_input/input_feed.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {

std::vector<models::UserInput> still_to_come(std::span<const models::UserInput> script,
                                             std::span<const models::CommittedInput> acted) {
  std::vector<std::uint32_t> ids;
  for (const models::CommittedInput& committed : acted) ids.push_back(committed.input.id);
  std::ranges::sort(ids);
  std::vector<models::UserInput> left;
  for (const models::UserInput& input : script)
    if (!std::ranges::binary_search(ids, input.id)) left.push_back(input);
  return left;
}

CheckpointWriter::CheckpointWriter(std::string file, std::int64_t every, bool replaces, Run run)
    : file_(std::move(file)), every_(every), run_(std::move(run)) {
  const OutputFile can_be_written(file_, replaces);
  run_.options.level = LogLevel::kCommits;
  run_.options.every = 1;
}

bool CheckpointWriter::add(const models::CommittedStep& step) {
  std::vector<models::CommittedInput>& acted = run_.inputs.acted;
  acted.insert(acted.end(), step.inputs.begin(), step.inputs.end());
  if (step.step % every_ != 0) return failure_.empty();
  return write(step.step, {step.ids.begin(), step.ids.end()},
               {step.states.begin(), step.states.end()});
}

bool CheckpointWriter::finish(const models::SimulationResult& result) {
  if (result.committed_steps == last_) return failure_.empty();
  std::vector<physics::BodyState> states;
  for (const physics::BodyId id : result.final_ids)
    states.push_back(result.final_states[physics::index_of(id)]);
  return write(result.committed_steps, result.final_ids, std::move(states));
}

bool CheckpointWriter::write(std::int64_t step, std::vector<physics::BodyId> ids,
                             std::vector<physics::BodyState> states) {
  if (!failure_.empty()) return false;
  try {
    run_.options.first_step = step;
    LogWriter log(file_, true, LogWriter::Use::kCheckpoint);
    log.begin(run_.scenario, run_.options, run_.labels, run_.meshes);
    const std::uint64_t digest = physics::digest(ids, states);
    if (log.add_step({step, digest, true, std::move(ids), std::move(states), inputs(step), {}}))
      last_ = step;
    log.finish();
  } catch (const scenarios::FileError& error) {
    failure_ = error.what();
  } catch (const std::bad_alloc&) {
    failure_ = file_ + ": no memory is left to write a checkpoint";
  }
  return failure_.empty();
}

// What is to act as soon as it can acts first when the run goes on.
std::vector<models::CommittedInput> CheckpointWriter::inputs(std::int64_t step) const {
  std::vector<models::CommittedInput> all = run_.inputs.acted;
  for (const models::UserInput& input : still_to_come(run_.inputs.script, run_.inputs.acted))
    all.push_back({input, input.step, false});
  if (run_.inputs.live == nullptr) return all;
  std::vector<models::UserInput> said;
  for (const models::CommittedInput& offered : run_.inputs.live->offered())
    said.push_back(offered.input);
  for (models::UserInput& input : still_to_come(said, run_.inputs.acted)) {
    const std::int64_t asked = input.step;
    input.step = std::max(input.step, step);
    all.push_back({input, asked, false});
  }
  return all;
}

}  // namespace soda::analysis
