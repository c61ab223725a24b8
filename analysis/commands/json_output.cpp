#include "analysis/commands/json_output.hpp"

#include <nlohmann/json.hpp>

#include "analysis/commands/accuracy_report.hpp"
#include "analysis/process/stop_signals.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/runs/undivided_run.hpp"
#include "analysis/text/text_table.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json plan_lines(const std::vector<models::PlanLine>& plan,
                const std::vector<std::uint64_t>* counters) {
  Json lines = Json::array();
  for (std::size_t i = 0; i < plan.size(); ++i) {
    Json line = {{"stage", plan[i].stage}, {"needed", plan[i].needed}, {"reason", plan[i].reason}};
    if (counters != nullptr) line["counted"] = (*counters)[i];
    lines.push_back(std::move(line));
  }
  return lines;
}

Json object_of(const std::vector<std::pair<std::string, std::uint64_t>>& counts) {
  Json object = Json::object();
  for (const auto& [name, count] : counts) object[name] = count;
  return object;
}

Json events(const kernel::Counters& counters) {
  Json paths = Json::object();
  for (const auto& [name, count] : kernel::kernel_paths()) paths[name] = counters.*count;
  return {{"executed", counters.executed},           {"rolled_back", counters.rolled_back},
          {"committed", counters.committed},         {"rollbacks", counters.rollbacks},
          {"stragglers", counters.stragglers},       {"messages", counters.messages},
          {"anti_messages", counters.anti_messages}, {"adopted", counters.adopted},
          {"absorbed", counters.absorbed},           {"jumps", counters.jumps},
          {"gvt_rounds", counters.gvt_rounds},       {"history_max", counters.history_max},
          {"efficiency", efficiency(counters)},      {"paths", paths}};
}

// Of kinds that nothing was counted of: nothing.
Json kinds_json(const kernel::EventCounts& kinds, bool of_messages) {
  Json json = Json::object();
  const auto names = of_messages ? models::message_kinds() : models::event_kinds();
  for (std::size_t kind = 0; kind < names.size(); ++kind) {
    const auto& [executed, rolled_back, committed] = kinds.executions[kind];
    const auto& [sent, late, anti] = kinds.messages[kind];
    if (of_messages && sent + late + anti > 0)
      json[names[kind]] = {{"sent", sent}, {"late", late}, {"anti", anti}};
    if (!of_messages && executed > 0)
      json[names[kind]] = {
          {"executed", executed}, {"rolled_back", rolled_back}, {"committed", committed}};
  }
  return json;
}

Json errors(const ErrorMeasures& error) {
  return {{"energy_drift_rel", error.energy_drift_rel},
          {"momentum_drift_rel", error.momentum_drift_rel},
          {"max_penetration_m", error.max_penetration_m},
          {"constraint_residual", error.constraint_residual_m_s},
          {"joint_error", error.joint_error},
          {"push_out_work_joule", error.push_out_work_joule}};
}

Json estimates_json(const std::optional<ErrorEstimates>& estimates) {
  if (!estimates) return nullptr;
  const bool any = estimates->step > 0;
  return {{"tolerance", estimates->tolerance},
          {"largest", estimates->largest},
          {"step", any ? Json(estimates->step) : Json()},
          {"island", any ? Json(estimates->island) : Json()},
          {"body", any ? Json(estimates->body) : Json()},
          {"sum", estimates->sum},
          {"islands", estimates->islands},
          {"beyond_tolerance", estimates->beyond}};
}

Json account_json(const kernel::TimeAccount& account) {
  Json json = Json::object();
  for (const auto& [name, ns] : account_terms(account))
    json[name + "_s"] = 1e-9 * static_cast<double>(ns);
  return json;
}

Json cluster_json(const kernel::VirtualReport& cluster, std::optional<std::int64_t> alone_ns) {
  const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
  return {{"processors", cluster.processors},
          {"makespan_s", seconds(cluster.makespan_ns)},
          {"one_processor_s", alone_ns ? Json(seconds(*alone_ns)) : Json()},
          {"speed_up", or_null(speed_up(alone_ns, cluster))},
          {"utilisation", cluster_utilisation(cluster)},
          {"account", account_json(cluster.account)},
          {"messages", cluster.remote_messages},
          {"bytes", cluster.remote_bytes},
          {"barriers", cluster.barriers},
          {"most_history", cluster.most_history},
          {"execution_digest", format_digest(cluster.execution_digest)}};
}

Json inputs_json(const RunReport& report) {
  Json lines = Json::array();
  for (const models::CommittedInput& committed : report.run.result.inputs) {
    const models::UserInput& input = committed.input;
    Json line = {{"id", input.id},
                 {"type", name_of(input.kind)},
                 {"body", report.labels[physics::index_of(input.body)]},
                 {"step", input.step}};
    if (committed.asked_step < input.step)
      line["asked_step"] = committed.asked_step < 0 ? Json(nullptr) : Json(committed.asked_step);
    line["had_effect"] = committed.had_effect;
    lines.push_back(std::move(line));
  }
  return lines;
}

Json real_time_json(const RealTimeReport& report) {
  Json clocks = Json::array(), fills = Json::array(), fates = Json::array();
  for (const models::ShownFrame& frame : report.frames) {
    clocks.push_back(frame.clock);
    fills.push_back(frame.fill);
    constexpr const char* kNames[] = {"on time", "slow", "late"};
    fates.push_back(kNames[static_cast<int>(frame.fate)]);
  }
  const models::PlaybackSummary& sum = report.summary;
  return {{"frames_per_s", report.request.frames_per_s},
          {"speed", report.request.speed},
          {"lead_steps", report.most_lead},
          {"frames", sum.frames},
          {"on_time", sum.on_time},
          {"slow", sum.slow},
          {"late", sum.late},
          {"slow_motion_s", sum.slow_motion_s},
          {"least_fill", sum.least_fill},
          {"worst_wake_s", report.worst_wake_s},
          {"clock", clocks},
          {"fill", fills},
          {"fate", fates}};
}

// Text from a file may hold anything: bytes that are not UTF-8 are replaced, not thrown upon.
std::string dumped(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json contacts_json(const physics::ContactQuality& contacts) {
  using Residuals = physics::ContactResiduals;
  if (contacts.points == 0) return nullptr;
  const auto law = [&contacts](double Residuals::*member) -> Json {
    return {{"largest", contacts.largest.*member}, {"mean", contacts.mean(member)}};
  };
  return {{"points", contacts.points},
          {"signorini_m_s", law(&Residuals::signorini_m_s)},
          {"complementarity_m_s", law(&Residuals::complementarity_m_s)},
          {"cone_m_s", law(&Residuals::cone_m_s)},
          {"dissipation_m_s", law(&Residuals::dissipation_m_s)}};
}

Json warnings_json(const std::vector<FileWarnings>& files) {
  Json list = Json::array();
  for (const auto& [file, warnings] : files)
    for (const auto& [kind, line, column, pointer, found, likely, more] : warnings)
      list.push_back({{"kind", kind},
                      {"file", file},
                      {"line", line},
                      {"column", column},
                      {"pointer", pointer},
                      {"found", found},
                      {"likely", likely},
                      {"more", more}});
  return list;
}

Json advantages_json(const std::vector<Advantage>& all) {
  Json list = Json::array();
  for (const Advantage& a : all)
    list.push_back({{"case", a.scene},
                    {"measure", a.measure.empty() ? Json() : Json(a.measure)},
                    {"engine", a.engine},
                    {"dt_s", a.dt_s},
                    {"error", a.error},
                    {"cpu_s_per_simulated_s", a.cpu_per_simulated_s},
                    {"soda_cpu_s_per_simulated_s", or_null(a.soda_cpu_per_simulated_s)}});
  return list;
}

}  // namespace

std::string run_json(const RunReport& report) {
  const MeasuredRun& run = report.run;
  const models::SimulationResult& result = run.result;
  const bool threads = report.options.executor == models::ExecutorKind::kThreads ||
                       report.options.executor == models::ExecutorKind::kMpi;
  Json json = {{"scenario", report.scenario},
               {"digest", format_digest(run.digest)},
               {"first_step", report.options.first_step},
               {"steps", result.committed_steps},
               {"ended_early", result.stopped != 0 ? Json(name_of_stop(result.stopped)) : Json()},
               {"bodies", report.bodies},
               {"worlds", report.worlds},
               {"executor", name_of(report.options.executor)},
               {"threads", threads ? report.options.threads : 1u},
               {"ranks", report.options.transport ? report.options.transport->size() : 1u},
               {"buffer", report.options.buffer},
               {"policy", name_of(report.options.synchronisation)},
               {"rollback", name_of(report.options.rollback)},
               {"gating", report.options.gating},
               {"split_islands", report.options.split_islands},
               {"ghosts", name_of(report.options.ghosts)},
               {"balancing", name_of(report.options.balancing.policy)},
               {"dt_s", report.dt_s},
               {"wall_s", run.cost.wall_s},
               {"cpu_s", run.cost.cpu_s},
               {"steps_per_s", steps_per_second(run)},
               {"real_time_factor", real_time_factor(run, report.dt_s)}};
  json["events"] = events(result.events);
  json["events"]["by_kind"] = kinds_json(result.kinds, false);
  json["events"]["messages_by_kind"] = kinds_json(result.kinds, true);
  json["islands"] = object_of(island_counts(result));
  json["lead"] = {{"mean_steps", mean_lead_steps(result.events)},
                  {"max_steps", result.events.lead_max}};
  if (result.cluster) json["virtual"] = cluster_json(*result.cluster, report.one_processor_ns);
  if (result.account) json["account"] = account_json(*result.account);
  if (report.real_time) json["real_time"] = real_time_json(*report.real_time);
  json["error"] = errors(run.error);
  if (run.estimates) json["accuracy"] = estimates_json(run.estimates);
  if (report.options.inputs.any()) {
    json["inputs"] = inputs_json(report);
    json["inputs_too_late"] = result.inputs_too_late;
  }
  json["warnings"] = warnings_json({report.warnings});
  json["stages"] = object_of(stage_counts(result));
  json["broken_joints"] = broken_joints(result);
  json["plan"] = plan_lines(run.plan, &run.plan_counters);
  Json& changes = json["territory_changes"] = Json::array();
  for (const auto& [step, cell, from, to] : result.territory_changes)
    changes.push_back(
        {{"step", step}, {"cell", cell}, {"from", index_of(from)}, {"to", index_of(to)}});
  if (report.with_step_digests) json["step_digests"] = Json::array();
  for (const std::uint64_t digest : report.step_digests)
    json["step_digests"].push_back(format_digest(digest));
  if (report.replay) json["log"] = report.replay->log;
  if (report.replay) json["divergence"] = or_null(report.replay->divergence);
  return dumped(json);
}

std::string plan_json(const std::string& scenario, const std::vector<models::PlanLine>& plan,
                      const std::vector<physics::ShapePair>& pairs,
                      const JointIslandFigures& joints, const FileWarnings& warnings) {
  Json shapes = Json::array();
  for (const physics::ShapePair& pair : pairs)
    shapes.push_back({{"shapes", {pair.first, pair.second}},
                      {"kernel", physics::name_of(pair.kernel)},
                      {"routine", pair.by_fcl ? "fcl" : "own"}});
  return dumped({{"scenario", scenario},
                 {"warnings", warnings_json({warnings})},
                 {"plan", plan_lines(plan, nullptr)},
                 {"shape_pairs", shapes},
                 {"joint_islands", joints.counts},
                 {"joint_costs", joints.words}});
}

std::string verification_json(const Verification& verification) {
  Json runs = Json::array();
  for (const VerifiedRun& run : verification.runs) {
    Json line = {{"executor", name_of(run.executor)},
                 {"ranks", run.ranks},
                 {"threads", run.threads},
                 {"worlds", run.worlds},
                 {"buffer", run.buffer},
                 {"scheduling_seed", run.scheduling_seed},
                 {"rollback", name_of(run.rollback)},
                 {"gating", run.gating},
                 {"ghosts", name_of(run.ghosts)},
                 {"balancing", name_of(run.balancing)},
                 {"territory_changes", run.territory_changes},
                 {"events", events(run.events)},
                 {"equal", !run.divergence.has_value()}};
    if (run.divergence) {
      line["divergence"] = {{"step", run.divergence->step},
                            {"body", run.divergence->body_label},
                            {"field", run.divergence->field},
                            {"expected", run.divergence->expected},
                            {"expected_bits", format_bits(run.divergence->expected)},
                            {"found", run.divergence->found},
                            {"found_bits", format_bits(run.divergence->found)}};
    }
    runs.push_back(std::move(line));
  }
  return dumped({{"scenario", verification.scenario},
                 {"steps", verification.steps},
                 {"digest", format_digest(verification.digest)},
                 {"rollbacks", verification.rollbacks()},
                 {"equal", !verification.diverged()},
                 {"warnings", warnings_json({verification.warnings})},
                 {"runs", runs}});
}

std::string accuracy_json(const AccuracyReport& report) {
  Json cases = Json::array();
  for (const AccuracyReport::Case& one : report.cases) {
    Json runs = Json::array();
    for (const CaseRun& run : one.runs) {
      Json errors = Json::array();
      for (const JudgedMeasure& m : run.measures)
        errors.push_back({{"reference", m.form},
                          {"measure", m.measure},
                          {"value", m.value},
                          {"must", or_null(m.must)},
                          {"stretch", or_null(m.stretch)},
                          {"missed", m.missed()}});
      runs.push_back(
          {{"engine", run.engine},
           {"dt_s", run.setting.dt_s},
           {"iterations", run.setting.iterations},
           {"tolerance", run.setting.tolerance > 0.0 ? Json(run.setting.tolerance) : Json()},
           {"steps", run.steps},
           {"cpu_s_per_simulated_s", run.cpu_per_simulated_s},
           {"step_ms", run.step_ms},
           {"errors", std::move(errors)},
           {"contacts", contacts_json(run.contacts)},
           {"estimates", estimates_json(run.estimates)},
           {"fault", run.fault.empty() ? Json() : Json(run.fault)}});
    }
    cases.push_back({{"case", one.name}, {"runs", std::move(runs)}, {"left_out", one.left_out}});
  }
  return dumped({{"cases", std::move(cases)},
                 {"advantages_of_others", advantages_json(advantages_of_others(report))},
                 {"advantages_in_cases", advantages_json(advantages_in_cases(report))},
                 {"missed", report.missed()},
                 {"missing_engines", report.missing_engines},
                 {"warnings", warnings_json(report.warnings)}});
}

std::string phold_json(const PholdRequest& request, const PholdRun& run) {
  Json json = {{"executor", request.executor},
               {"ranks", request.transport ? request.transport->size() : 1},
               {"threads", request.threads},
               {"policy", name_of(request.policy.value_or(kernel::Synchronisation::kOptimistic))},
               {"lps", request.model.lps},
               {"start_events", request.model.start_events_per_lp},
               {"remote", request.model.remote},
               {"least_delay", request.model.least_delay},
               {"end", request.end_units},
               {"seed", request.model.seed},
               {"committed_events", run.result.events},
               {"wall_s", run.wall_s},
               {"events_per_s", run.events_per_s()},
               {"digest", format_digest(run.result.digest)},
               {"events", events(run.counters)}};
  if (run.cluster) json["virtual"] = cluster_json(*run.cluster, run.one_processor_ns());
  return dumped(json);
}

}  // namespace soda::analysis
