#include "analysis/whole/whole_search.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

namespace soda::analysis {
namespace {

class WholeShrinking {
 public:
  WholeShrinking(ShrunkWhole& smallest, const ShrinkLimits& limits, const TryWhole& attempt)
      : smallest_(smallest), limits_(limits), try_(attempt), kind_(smallest.outcome.kind) {}

  void run() {
    find_repeats();
    bool smaller = true;
    while (smaller) {
      smaller = shrink_steps();
      smaller = drop_objects() || smaller;
      smaller = drop_options() || smaller;
      smaller = drop_keys() || smaller;
    }
  }

 private:
  // A failure that needs a race is not there in each run: so many tries make it likely.
  void find_repeats() {
    constexpr unsigned kProbes = 4, kMostRepeats = 6;
    unsigned failed = 0;
    for (unsigned i = 0; i < kProbes && !limits_.reached(smallest_.tried); ++i) {
      ++smallest_.tried;
      failed += try_(smallest_.trial).kind == kind_;
    }
    repeats_ = failed == kProbes ? 1 : (failed >= kProbes / 2 ? kMostRepeats / 2 : kMostRepeats);
  }

  bool still_fails(WholeTrial trial) {
    drop_dangling(trial.scene);
    for (unsigned i = 0; i < repeats_; ++i) {
      if (limits_.reached(smallest_.tried)) return false;
      ++smallest_.tried;
      WholeOutcome outcome = try_(trial);
      if (outcome.kind != kind_) {
        if (outcome.kind == WholeFailureKind::kRefused) return false;
        continue;
      }
      trial.scene.head.drop("duration_s");
      trial.scene.head.set("steps", json_of(outcome.steps));
      smallest_.trial = std::move(trial);
      smallest_.outcome = std::move(outcome);
      return true;
    }
    return false;
  }

  bool shrink_steps() {
    bool smaller = false;
    for (bool found = true; found;) {
      const std::string* const text = smallest_.trial.scene.head.find("steps");
      std::int64_t now = 1;
      if (text != nullptr) std::from_chars(text->data(), text->data() + text->size(), now);
      found = false;
      for (const std::int64_t next : {std::int64_t{1}, now / 4, now / 2, now * 3 / 4, now - 1}) {
        if (found || next < 1 || next >= now) continue;
        WholeTrial trial = smallest_.trial;
        trial.scene.head.set("steps", json_of(next));
        found = still_fails(std::move(trial));
      }
      smaller = smaller || found;
    }
    return smaller;
  }

  // Leaves out ever smaller parts of a list (delta debugging, Zeller and Hildebrandt 2002).
  template <class List>
  bool drop_parts(const List& list_of) {
    bool smaller = false;
    for (std::size_t part = list_of(smallest_.trial).size(); part > 0; part /= 2)
      for (std::size_t first = 0; first < list_of(smallest_.trial).size();) {
        WholeTrial trial = smallest_.trial;
        auto& list = list_of(trial);
        const auto begin = list.begin() + static_cast<std::ptrdiff_t>(first);
        list.erase(begin, begin + static_cast<std::ptrdiff_t>(std::min(part, list.size() - first)));
        if (still_fails(std::move(trial)))
          smaller = true;
        else
          first += part;
      }
    return smaller;
  }

  bool drop_objects() {
    bool smaller = false;
    for (const ScenePart part : {ScenePart::kInputs, ScenePart::kJoints, ScenePart::kGenerators,
                                 ScenePart::kBodies, ScenePart::kStatics, ScenePart::kDrives})
      smaller =
          drop_parts([part](WholeTrial & trial) -> auto& { return trial.scene[part]; }) || smaller;
    return smaller;
  }

  bool drop_options() {
    bool smaller = drop_parts([](WholeTrial & trial) -> auto& { return trial.run.options; });
    smaller =
        drop_parts([](WholeTrial & trial) -> auto& { return trial.run.replay_options; }) || smaller;
    if (!smallest_.trial.run.logged || kind_ == WholeFailureKind::kReplay) return smaller;
    WholeTrial trial = smallest_.trial;
    trial.run.logged = false;
    return still_fails(std::move(trial)) || smaller;
  }

  // Of the file's own keys and of the objects; those that must be there lead to a refusal.
  bool drop_keys() {
    bool smaller = drop_fields([](WholeTrial& trial) -> JsonObject& { return trial.scene.head; });
    for (std::size_t part = 0; part < kSceneParts; ++part)
      for (std::size_t i = 0; i < smallest_.trial.scene.lists[part].size(); ++i)
        smaller = drop_fields([part, i](WholeTrial& trial) -> JsonObject& {
                    return trial.scene.lists[part][i];
                  }) ||
                  smaller;
    return smaller;
  }

  template <class Object>
  bool drop_fields(const Object& object_of) {
    static constexpr const char* kNeeded[] = {
        "format",   "description", "gravity_m_s2", "time_step_s", "steps", "id",      "shape",
        "material", "position_m",  "name",         "type",        "body",  "anchor_m"};
    bool smaller = false;
    for (std::size_t i = object_of(smallest_.trial).fields.size(); i-- > 0;) {
      const std::string key = object_of(smallest_.trial).fields[i].first;
      if (std::ranges::find(kNeeded, key) != std::end(kNeeded)) continue;
      WholeTrial trial = smallest_.trial;
      object_of(trial).drop(key);
      smaller = still_fails(std::move(trial)) || smaller;
    }
    return smaller;
  }

  ShrunkWhole& smallest_;
  const ShrinkLimits& limits_;
  const TryWhole& try_;
  const WholeFailureKind kind_;
  unsigned repeats_ = 1;
};

}  // namespace

ShrunkWhole shrink(const WholeTrial& failing, const WholeOutcome& how, const ShrinkLimits& limits,
                   const TryWhole& attempt) {
  ShrunkWhole smallest{failing, how, 0};
  if (how.steps > 0) smallest.trial.scene.head.set("steps", json_of(how.steps));
  WholeShrinking(smallest, limits, attempt).run();
  return smallest;
}

}  // namespace soda::analysis
