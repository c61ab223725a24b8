// All JSON that `soda` prints but for what searches find (search_json.hpp). Keys are
// documented in docs/commands.md.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/accuracy_command.hpp"
#include "analysis/commands/phold_command.hpp"
#include "analysis/commands/verify_command.hpp"
#include "analysis/runs/run_report.hpp"
#include "models/run/plan.hpp"
#include "physics/step/stages.hpp"

namespace soda::analysis {

// Each returns one object, indented by two, with a final line break. Doubles read back as the same
// bits; what is not finite becomes null.
std::string run_json(const RunReport& report);
std::string plan_json(const std::string& scenario, const std::vector<models::PlanLine>& plan,
                      const std::vector<physics::ShapePair>& pairs,
                      const JointIslandFigures& joints, const FileWarnings& warnings);
std::string verification_json(const Verification& verification);
std::string accuracy_json(const AccuracyReport& report);
std::string phold_json(const PholdRequest& request, const PholdRun& run);

}  // namespace soda::analysis
