#include "analysis/commands/plan_command.hpp"

#include <ostream>

#include "analysis/commands/json_output.hpp"
#include "analysis/runs/run_report.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "physics/step/stages.hpp"

namespace soda::analysis {

int plan_command(const PlanRequest& request, std::ostream& out, std::ostream& err) {
  const scenarios::Scenario scenario = load_scenario(request.file, request.overrides);
  const FileWarnings warnings{request.file, scenario.warnings};
  tell_warnings({warnings}, err);
  const std::vector<models::PlanLine> plan =
      models::make_plan(scenario.scene, scenario.territory.worlds, scenario.run);
  if (request.json) {
    out << plan_json(scenario.name, plan, physics::shape_pairs(scenario.scene),
                     joint_island_figures(scenario.scene), warnings);
  } else {
    out << scenario.name << ": " << scenario.initial.size() << " bodies, "
        << scenario.territory.worlds << (scenario.territory.worlds == 1 ? " world" : " worlds")
        << ", " << name_of(scenario.run.executor) << " executor\n\n"
        << plan_text(plan, nullptr) << shape_pairs_text(scenario.scene)
        << joint_costs_text(scenario.scene);
  }
  return kExitOk;
}

}  // namespace soda::analysis
