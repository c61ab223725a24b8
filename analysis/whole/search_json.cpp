#include "analysis/whole/search_json.hpp"

#include "analysis/whole/scene_parts.hpp"

namespace soda::analysis {
namespace {

template <class Items, class Text>
std::string list_of(const Items& items, Text text) {
  std::string all = "[";
  for (const auto& item : items) all += (all.size() > 1 ? ",\n    " : "\n    ") + text(item);
  return all + "]";
}

// The object with a line for each key.
std::string lines_of(const SceneObject& object) {
  std::string text;
  for (const auto& [key, value] : object.fields)
    text += (text.empty() ? "{\n  " : ",\n  ") + quoted(key) + ": " + value;
  return text + "\n}\n";
}

}  // namespace

std::string whole_json(const WholeResult& result) {
  const WholeSums& sums = result.sums;
  SceneObject scenes, json;
  for (std::size_t i = 0; i < kRunExecutors; ++i)
    scenes.set(name_of(static_cast<RunExecutor>(i)), json_of(sums.scenes[i]));
  json.set("trials", json_of(result.trials))
      .set("out_of_time", json_of(result.out_of_time))
      .set("wall_s", json_of(result.wall_s))
      .set("scenes", scenes.text())
      .set("left_out", quoted(result.left_out))
      .set("bodies", json_of(sums.bodies))
      .set("steps", json_of(sums.steps))
      .set("executed", json_of(sums.events))
      .set("rolled_back", json_of(sums.rolled_back))
      .set("rollbacks", json_of(sums.rollbacks))
      .set("runs_with_rollbacks", json_of(sums.runs_with_rollbacks))
      .set("migrations", json_of(sums.migrations))
      .set("replays", json_of(sums.replays))
      .set("plain_s", json_of(sums.plain_s))
      .set("program_s", json_of(sums.program_s));
  json.set("numerical_failures", list_of(result.suspicious, [](const SuspiciousScene& scene) {
             SceneObject line;
             return line.set("seed", json_of(scene.seed)).set("what", quoted(scene.what)).text();
           }));
  json.set("failures", list_of(result.failures, [](const WholeFailure& failure) {
             SceneObject line;
             return line.set("seed", json_of(failure.seed))
                 .set("kind", quoted(failure.kind))
                 .set("what", quoted(failure.what))
                 .set("shrunk_what", quoted(failure.shrunk_what))
                 .set("command", quoted(failure.command))
                 .set("file", quoted(failure.file))
                 .set("scenario", quoted(failure.text))
                 .text();
           }));
  return lines_of(json);
}

std::string continuity_json(const ContinuityResult& result) {
  SceneObject changes, json;
  for (std::size_t i = 0; i < kContinuityKinds; ++i) {
    const ContinuityTally& tally = result.tallies[i];
    SceneObject line;
    line.set("scenes", json_of(tally.trials))
        .set("same_bits", json_of(tally.same_bits))
        .set("rounding", json_of(tally.rounding))
        .set("failed", json_of(tally.failed))
        .set("steps", json_of(tally.steps))
        .set("worst_over_allowed", json_of(tally.worst));
    changes.set(name_of(static_cast<ContinuityKind>(i)), line.text());
  }
  json.set("out_of_time", json_of(result.out_of_time))
      .set("wall_s", json_of(result.wall_s))
      .set("changes", changes.text());
  json.set("failures", list_of(result.failures, [](const ContinuityFailure& failure) {
             SceneObject line;
             return line.set("seed", json_of(failure.seed))
                 .set("change", quoted(name_of(failure.kind)))
                 .set("what", quoted(failure.what))
                 .text();
           }));
  return lines_of(json);
}

}  // namespace soda::analysis
