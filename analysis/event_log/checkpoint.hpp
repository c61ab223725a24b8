// Checkpoints of a run: files from which it can go on.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "analysis/event_log/log_format.hpp"
#include "models/commit/commit.hpp"
#include "models/run/simulation.hpp"

namespace soda::analysis {

// Those of `script` that have not acted: ids are unique over a run.
std::vector<models::UserInput> still_to_come(std::span<const models::UserInput> script,
                                             std::span<const models::CommittedInput> acted);

// A checkpoint is an event log (docs/log-format.md) of no steps: with all that a run needs, it
// has the states before one step, the inputs that had acted then, and those of its scenario, of a
// file, or said by a stream so far, that had not. So what reads logs reads checkpoints, and a run
// goes on from either (logged_run.hpp).
class CheckpointWriter {
 public:
  // What all checkpoints of a run have in common.
  struct Run {
    LoggedScenario scenario;
    LoggedOptions options;
    std::vector<std::uint32_t> labels;
    std::vector<scenarios::MeshFile> meshes;
    models::InputOptions inputs;  // of the run, before it begins
  };
  // A checkpoint is due when `every` (>= 1) divides a step. Throws FileError if `file` exists and
  // `replaces` is not set, or cannot be written.
  CheckpointWriter(std::string file, std::int64_t every, bool replaces, Run run);

  // Of every committed step, in order, with states if it is due. What `file` held is replaced in
  // one act by what is whole on the disk. False if that fails, now or before: `file` is what it was
  // then, and takes no more. Does not throw.
  bool add(const models::CommittedStep& step);
  // The run has ended: so that nothing is lost, a checkpoint of its last step, if it was not due.
  bool finish(const models::SimulationResult& result);
  // What went wrong; empty if nothing did.
  const std::string& failure() const { return failure_; }

  std::int64_t every() const { return every_; }

 private:
  bool write(std::int64_t step, std::vector<physics::BodyId> ids,
             std::vector<physics::BodyState> states);
  std::vector<models::CommittedInput> inputs(std::int64_t step) const;

  const std::string file_;
  const std::int64_t every_;
  Run run_;
  std::int64_t last_ = -1;  // step of the last one
  std::string failure_;
};

}  // namespace soda::analysis
