#include "analysis/search/swarm_search.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

class SwarmShrinking {
 public:
  SwarmShrinking(const SwarmSubject& subject, ShrunkTrial& smallest, const ShrinkLimits& limits)
      : subject_(subject), smallest_(smallest), limits_(limits) {}

  void run() {
    shrink_size();
    const ShrunkTrial without_list = smallest_;
    if (!record_decisions()) return;
    shrink_decisions();
    shrink_size();
    // A list that fills a page helps nobody: then the seed says it shorter.
    constexpr std::size_t kLongestList = 100;
    if (smallest_.trial.decisions->size() <= kLongestList) return;
    const unsigned tried = smallest_.tried;
    smallest_ = without_list;
    smallest_.tried = tried;
  }

 private:
  // Takes the trial over if it fails, too.
  bool still_fails(Trial trial) {
    if (limits_.reached(smallest_.tried)) return false;
    ++smallest_.tried;
    TrialOutcome outcome = run_isolated(subject_, trial);
    if (!outcome.failed) return false;
    smallest_.trial = std::move(trial);
    smallest_.what = std::move(outcome.what);
    return true;
  }

  void shrink_size() {
    while (shrink_number(&TrialSize::lps) | shrink_number(&TrialSize::end) |
           shrink_number(&TrialSize::window) | shrink_number(&TrialSize::processors)) {
    }
  }

  // To one, by half, by one less. True if it got smaller.
  template <class T>
  bool shrink_number(T TrialSize::*number) {
    constexpr T least = 1;
    bool smaller = false;
    while (smallest_.trial.size.*number > least) {
      const T now = smallest_.trial.size.*number;
      bool found = false;
      for (const T next : {least, static_cast<T>((now + least) / 2), static_cast<T>(now - 1)}) {
        Trial trial = smallest_.trial;
        trial.size.*number = next;
        trial.size.processors = std::min(trial.size.processors, trial.size.lps);
        found = next < now && still_fails(std::move(trial));
        if (found) break;
      }
      if (!found) return smaller;
      smaller = true;
    }
    return smaller;
  }

  bool record_decisions() {
    Trial trial = smallest_.trial;
    if (trial.decisions) return true;
    if (limits_.reached(smallest_.tried)) return false;
    trial.decisions = run_isolated(subject_, trial, true).decisions;
    return still_fails(std::move(trial));
  }

  // Leaves out ever smaller parts of the list (delta debugging, Zeller and Hildebrandt 2002).
  void shrink_decisions() {
    std::vector<kernel::Decision> list = *smallest_.trial.decisions;
    for (std::size_t part = list.size(); part > 0; part /= 2) {
      for (std::size_t first = 0; first < list.size();) {
        std::vector<kernel::Decision> rest = list;
        const auto begin = rest.begin() + static_cast<std::ptrdiff_t>(first);
        rest.erase(begin, begin + static_cast<std::ptrdiff_t>(std::min(part, list.size() - first)));
        Trial trial = smallest_.trial;
        trial.decisions = rest;
        if (still_fails(std::move(trial)))
          list = std::move(rest);
        else
          first += part;
      }
    }
  }

  const SwarmSubject& subject_;
  ShrunkTrial& smallest_;
  const ShrinkLimits& limits_;
};

std::uint64_t parse_number(const std::string& text, const std::string& whole) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size())
    throw UsageError("--decisions: found " + whole + "; allowed: none, or a list POINT:VALUE,...");
  return number;
}

}  // namespace

ShrunkTrial shrink(const SwarmSubject& subject, const Trial& failing, std::string what,
                   const ShrinkLimits& limits) {
  ShrunkTrial smallest{failing, std::move(what), 0};
  SwarmShrinking(subject, smallest, limits).run();
  return smallest;
}

std::string reproducing_command(const SwarmSubject& subject, const Trial& trial) {
  const std::string seed = std::to_string(trial.seed);
  std::string command = "soda swarm ";
  if (!subject.file().empty()) command += subject.file() + " ";
  command += "--seeds " + seed + ".." + seed;
  command += " --lps " + std::to_string(trial.size.lps);
  command += " --end " + std::to_string(trial.size.end);
  command += " --window " + std::to_string(trial.size.window);
  command += " --processors " + std::to_string(trial.size.processors);
  if (trial.decisions) command += " --decisions " + format_decisions(*trial.decisions);
  return command;
}

std::string format_decisions(const std::vector<kernel::Decision>& decisions) {
  if (decisions.empty()) return "none";
  std::string text;
  for (const kernel::Decision& decision : decisions)
    text += (text.empty() ? "" : ",") + std::to_string(decision.point) + ":" +
            std::to_string(decision.value);
  return text;
}

std::vector<kernel::Decision> parse_decisions(const std::string& text) {
  std::vector<kernel::Decision> decisions;
  if (text == "none") return decisions;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::size_t colon = text.find(':', begin);
    if (colon >= end) parse_number("", text);
    decisions.push_back(
        {parse_number(text.substr(begin, colon - begin), text),
         static_cast<std::uint32_t>(parse_number(text.substr(colon + 1, end - colon - 1), text))});
    begin = end + 1;
  }
  return decisions;
}

}  // namespace soda::analysis
