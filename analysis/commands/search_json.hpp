// Results of searches over many scenes or runs, of comparisons and of logs, as JSON: one object,
// keys as in docs/commands.md.
#pragma once

#include <string>

#include "analysis/commands/contacts_command.hpp"
#include "analysis/commands/continuity_command.hpp"
#include "analysis/commands/diff_command.hpp"
#include "analysis/commands/fuzz_command.hpp"
#include "analysis/commands/swarm_command.hpp"
#include "analysis/commands/whole_command.hpp"
#include "analysis/measures/extremes.hpp"

namespace soda::analysis {

// An array of all warnings of the files.
std::string warnings_list(const std::vector<FileWarnings>& files);
std::string contacts_json(const std::vector<StepContacts>& steps, const ContactNames& names);
std::string diff_json(const LogDifference& difference);
std::string swarm_json(const SwarmResult& result);
std::string fuzz_json(const FuzzResult& result);
std::string extremes_json(const ExtremesReport& report);
std::string whole_json(const WholeResult& result);
std::string continuity_json(const ContinuityResult& result);

}  // namespace soda::analysis
