#include "analysis/runs/run_report.hpp"
#include "analysis/scaling/scaling_report.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

std::string in_seconds(std::int64_t ns) { return json_of(1e-9 * static_cast<double>(ns)); }

std::string point_json(const ScalingPoint& point) {
  JsonObject account, rivals;
  for (const auto& [name, ns] : account_terms(point.cluster.account))
    account.set(name + "_s", in_seconds(ns));
  for (const auto& [rival, ns] : point.rivals_ns)
    rivals.set(name_of(rival), JsonObject()
                                   .set("makespan_s", in_seconds(ns))
                                   .set("speed_up", json_of(point.speed_up_of(ns)))
                                   .text());
  return JsonObject()
      .set("worlds", json_of(point.worlds))
      .set("processors", json_of(point.cluster.processors))
      .set("bodies", json_of(point.bodies))
      .set("one_processor_s", in_seconds(point.one_processor_ns))
      .set("makespan_s", in_seconds(point.cluster.makespan_ns))
      .set("speed_up", json_of(point.speed_up()))
      .set("efficiency", json_of(point.efficiency()))
      .set("messages", json_of(point.cluster.remote_messages))
      .set("account", account.text())
      .set("against", point.rivals_ns.empty() ? "{}" : rivals.text())
      .set("execution_digest", quoted(format_digest(point.cluster.execution_digest)))
      .set("equal", json_of(point.equal))
      .text();
}

std::string curve_json(const ScalingCurve& curve) {
  return JsonObject()
      .set("scenario", quoted(curve.scenario))
      .set("steps", json_of(curve.steps))
      .set("weak", json_of(curve.weak))
      .set("points", list_of(curve.points, point_json))
      .set("left_out", curve.left_out.empty() ? "null" : quoted(curve.left_out))
      .text();
}

}  // namespace

std::string scaling_json(const ScalingReport& report) {
  return JsonObject()
             .set("network", quoted(report.network.name))
             .set("latency_s", json_of(1e-6 * report.latency_us))
             .set("bandwidth_bytes_s", json_of(1e6 * report.bandwidth_mb_s))
             .set("source", quoted(report.network.source))
             .set("curves", list_of(report.curves, curve_json))
             .set("equal", json_of(report.all_equal()))
             .text() +
         "\n";
}

}  // namespace soda::analysis
