#include "analysis/commands/accuracy_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using Rows = std::vector<std::vector<std::string>>;

constexpr double kErrorRounding = 1e-12;  // errors below are equal, and have no order

std::string fixed_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string bound_text(const std::optional<double>& bound) {
  return bound ? format_number(*bound, 3) : "-";
}

std::string iterations_text(const CaseRun& run) {
  return run.setting.iterations > 0 ? std::to_string(run.setting.iterations) : "own";
}

std::string value_text(const JudgedMeasure* measure) {
  if (measure == nullptr) return "-";
  return format_number(measure->value, 3) + (measure->missed() ? " missed" : "");
}

// Largest and mean violations of the laws of contact.
std::string contacts_text(const CaseRun& run) {
  using Residuals = physics::ContactResiduals;
  if (run.contacts.points == 0) return {};
  const auto law = [&run](const char* name, double Residuals::*member) {
    return std::string(", ") + name + " " + format_number(run.contacts.largest.*member, 2) + " (" +
           format_number(run.contacts.mean(member), 2) + ")";
  };
  return "  contacts of " + run.engine + " at " + setting_text(run.setting) +
         ", largest (mean) in m/s" + law("Signorini", &Residuals::signorini_m_s) +
         law("complementarity", &Residuals::complementarity_m_s) +
         law("cone", &Residuals::cone_m_s) + law("dissipation", &Residuals::dissipation_m_s) + "\n";
}

// What accuracy mode says itself, beside the errors in the table.
std::string estimates_text(const CaseRun& run) {
  if (!run.estimates) return {};
  const ErrorEstimates& e = *run.estimates;
  return "  estimates of " + run.engine + " at " + setting_text(run.setting) +
         ", of a body's width: largest of a step " + format_number(e.largest, 3) + ", sum " +
         format_number(e.sum, 3) + "; " + std::to_string(e.beyond) + " of " +
         std::to_string(e.islands) + " islands beyond\n";
}

std::string tolerance_text(const CaseRun& run) {
  return run.setting.tolerance > 0.0 ? format_number(run.setting.tolerance, 3) : "-";
}

// Cells of a row that does not belong to one run.
std::vector<std::string> settings_cells(const AccuracyReport::Case& one, const char* title) {
  std::vector<std::string> cells(has_tolerances(one) ? 4 : 3);
  cells[0] = title;
  return cells;
}

void add_orders(const AccuracyReport::Case& one, std::size_t run,
                const std::vector<ErrorColumn>& columns, Rows& rows) {
  if (!ends_series(one, run)) return;
  const std::vector<std::optional<double>> orders = observed_orders(one, run, columns);
  if (std::none_of(orders.begin(), orders.end(), [](const auto& order) { return order; })) return;
  std::vector<std::string> row = settings_cells(one, "");
  for (const std::optional<double>& order : orders)
    row.push_back(order ? "order " + fixed_number(*order) : "");
  row.insert(row.end(), 2, "");
  rows.push_back(std::move(row));
}

std::string case_text(const AccuracyReport::Case& one) {
  const std::vector<ErrorColumn> columns = error_columns(one);
  std::vector<Column> titles = {{"engine"}, {"dt s", Align::kRight}, {"sweeps", Align::kRight}};
  if (has_tolerances(one)) titles.push_back({"tolerance", Align::kRight});
  std::vector<std::string> must = settings_cells(one, "must");
  std::vector<std::string> stretch = settings_cells(one, "stretch");
  for (const ErrorColumn& column : columns) {
    titles.push_back({column.title, Align::kRight});
    must.push_back(bound_text(column.must));
    stretch.push_back(bound_text(column.stretch));
  }
  titles.push_back({"CPU s/s", Align::kRight});
  titles.push_back({"step ms", Align::kRight});
  for (auto* row : {&must, &stretch}) row->insert(row->end(), 2, "");
  Rows rows;
  if (std::any_of(columns.begin(), columns.end(), [](const auto& c) { return c.must; }))
    rows.push_back(must);
  if (std::any_of(columns.begin(), columns.end(), [](const auto& c) { return c.stretch; }))
    rows.push_back(stretch);
  std::string faults;
  for (std::size_t i = 0; i < one.runs.size(); ++i) {
    const CaseRun& run = one.runs[i];
    std::vector<std::string> row = {run.engine, step_text(run.setting.dt_s), iterations_text(run)};
    if (has_tolerances(one)) row.push_back(tolerance_text(run));
    for (const ErrorColumn& column : columns) row.push_back(value_text(find_measure(run, column)));
    row.push_back(format_number(run.cpu_per_simulated_s, 3));
    row.push_back(format_number(run.step_ms, 3));
    rows.push_back(std::move(row));
    add_orders(one, i, columns, rows);
    if (!run.fault.empty())
      faults += "  " + run.engine + " at " + setting_text(run.setting) +
                " is no result: " + run.fault + "\n";
  }
  std::string text = one.name + ": " + one.description + "\n" + format_table(titles, rows) + faults;
  for (const CaseRun& run : one.runs) text += estimates_text(run);
  for (const CaseRun& run : one.runs) text += contacts_text(run);
  for (const std::string& what : one.left_out) text += "  left out: " + what + "\n";
  return text + "\n";
}

std::vector<ErrorColumn> bounded_columns(const AccuracyReport::Case& one) {
  std::vector<ErrorColumn> columns = error_columns(one);
  std::erase_if(columns, [](const ErrorColumn& column) {
    return column.measure == "step_ms" || !(column.must || column.stretch);
  });
  return columns;
}

// The largest of a run's errors; none if one is missing or no number.
std::optional<double> largest_error(const CaseRun& run, std::span<const ErrorColumn> columns) {
  std::optional<double> largest;
  for (const ErrorColumn& column : columns) {
    const JudgedMeasure* error = find_measure(run, column);
    if (error == nullptr || !std::isfinite(error->value)) return std::nullopt;
    largest = std::max(largest.value_or(error->value), error->value);
  }
  return largest;
}

bool is_as_near(const CaseRun& run, const CaseRun& other, std::span<const ErrorColumn> columns) {
  return std::all_of(columns.begin(), columns.end(), [&](const ErrorColumn& column) {
    const JudgedMeasure* reached = find_measure(run, column);
    return reached &&
           reached->value <= std::max(find_measure(other, column)->value, kErrorRounding);
  });
}

// Runs of others that no run of soda equals under all of these columns in as little time.
void add_advantages(const AccuracyReport::Case& one, std::span<const ErrorColumn> columns,
                    const std::string& measure, std::vector<Advantage>& all) {
  for (const CaseRun& other : one.runs) {
    const std::optional<double> error = largest_error(other, columns);
    if (is_soda(other.engine) || !error || !(other.cpu_per_simulated_s > 0.0)) continue;
    std::optional<double> least;
    for (const CaseRun& own : one.runs)
      if (own.engine == "soda" && is_as_near(own, other, columns))
        least = std::min(least.value_or(own.cpu_per_simulated_s), own.cpu_per_simulated_s);
    if (least && *least <= other.cpu_per_simulated_s) continue;
    all.push_back({one.name, measure, other.engine, other.setting.dt_s, *error,
                   other.cpu_per_simulated_s, least});
  }
}

void put_small_errors_first(std::vector<Advantage>& all) {
  std::stable_partition(all.begin(), all.end(), [](const Advantage& a) { return a.error < 1e-3; });
}

std::string advantages_text(const char* title, const std::vector<Advantage>& all) {
  std::string text;
  for (const Advantage& a : all) {
    text += "  " + a.scene + (a.measure.empty() ? "" : " " + a.measure) + ": " + a.engine + " at " +
            step_text(a.dt_s) + " s has " + format_number(a.error, 3) + " in " +
            format_number(a.cpu_per_simulated_s, 3) + " s/s, soda ";
    text += a.soda_cpu_per_simulated_s
                ? "needs " + format_number(*a.soda_cpu_per_simulated_s / a.cpu_per_simulated_s, 3) +
                      " times as long\n"
                : "is not as near at any setting\n";
  }
  return text.empty() ? text : title + text;
}

std::string summary_text(const AccuracyReport& report) {
  std::size_t bounds = 0;
  std::string missed;
  for (const AccuracyReport::Case& one : report.cases)
    for (const CaseRun& run : one.runs) {
      if (run.engine != "soda") continue;
      const std::string where = "  " + one.name + " at " + setting_text(run.setting) + ": ";
      if (!run.fault.empty()) missed += where + "no result\n";
      for (const JudgedMeasure& measure : run.measures) {
        bounds += measure.must ? 1 : 0;
        if (!measure.missed()) continue;
        missed += where + measure.measure + " " + format_number(measure.value, 3) + ", must " +
                  format_number(*measure.must, 3) + "\n";
      }
    }
  std::string text = "soda: " + std::to_string(report.missed()) + " missed of " +
                     std::to_string(bounds) + " that it must reach\n" + missed;
  text += advantages_text("faster at equal or smaller error, or nearer:\n",
                          advantages_of_others(report));
  text += advantages_text(
      "and in all measures of a case that have a bound (with the largest of these errors):\n",
      advantages_in_cases(report));
  for (const std::string& what : report.missing_engines) text += "missing engine: " + what + "\n";
  return text;
}

}  // namespace

std::string step_text(double dt_s) {
  const double parts = std::round(1.0 / dt_s);
  const bool whole = dt_s < 1.0 && std::abs(parts * dt_s - 1.0) < 1e-12;
  return whole ? "1/" + format_number(parts, 12) : format_number(dt_s, 12);
}

std::string setting_text(const EngineSetting& setting) {
  const std::string tolerance =
      setting.tolerance > 0.0 ? ", tolerance " + format_number(setting.tolerance, 3) : "";
  return step_text(setting.dt_s) + " s" + tolerance;
}

bool has_tolerances(const AccuracyReport::Case& one) {
  return std::any_of(one.runs.begin(), one.runs.end(),
                     [](const CaseRun& run) { return run.setting.tolerance > 0.0; });
}

std::vector<ErrorColumn> error_columns(const AccuracyReport::Case& one) {
  std::vector<ErrorColumn> columns;
  for (const CaseRun& run : one.runs) {
    for (const JudgedMeasure& measure : run.measures) {
      const bool bare =
          std::none_of(run.measures.begin(), run.measures.end(), [&](const JudgedMeasure& other) {
            return other.form == measure.form && (other.must || other.stretch);
          });
      if (!bare && !measure.must && !measure.stretch) continue;
      const bool known = std::any_of(columns.begin(), columns.end(), [&](const ErrorColumn& c) {
        return c.form == measure.form && c.measure == measure.measure;
      });
      if (!known)
        columns.push_back(
            {measure.form, measure.measure, measure.measure, measure.must, measure.stretch});
    }
  }
  for (ErrorColumn& column : columns) {
    const auto same = std::count_if(columns.begin(), columns.end(), [&](const ErrorColumn& c) {
      return c.measure == column.measure;
    });
    if (same > 1) column.title = column.form + " " + column.measure;
  }
  return columns;
}

bool ends_series(const AccuracyReport::Case& one, std::size_t run) {
  if (run + 1 == one.runs.size() || one.runs[run + 1].engine != one.runs[run].engine) return true;
  const EngineSetting &next = one.runs[run + 1].setting, &last = one.runs[run].setting;
  return next.iterations != last.iterations || (next.tolerance > 0.0) != (last.tolerance > 0.0);
}

std::vector<std::optional<double>> observed_orders(const AccuracyReport::Case& one,
                                                   std::size_t last,
                                                   const std::vector<ErrorColumn>& columns) {
  std::vector<std::optional<double>> orders(columns.size());
  if (last == 0 || ends_series(one, last - 1)) return orders;
  const CaseRun &coarse = one.runs[last - 1], &fine = one.runs[last];
  const double ratio = std::log(coarse.setting.dt_s / fine.setting.dt_s);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const JudgedMeasure* before = find_measure(coarse, columns[i]);
    const JudgedMeasure* after = find_measure(fine, columns[i]);
    if (before == nullptr || after == nullptr || columns[i].measure == "step_ms") continue;
    if (!(before->value > kErrorRounding) || !(after->value > kErrorRounding)) continue;
    if (std::isfinite(before->value) && std::isfinite(after->value) && ratio > 0.0)
      orders[i] = std::log(before->value / after->value) / ratio;
  }
  return orders;
}

std::vector<Advantage> advantages_of_others(const AccuracyReport& report) {
  std::vector<Advantage> all;
  for (const AccuracyReport::Case& one : report.cases)
    for (const ErrorColumn& column : bounded_columns(one))
      add_advantages(one, {&column, 1}, column.title, all);
  put_small_errors_first(all);
  return all;
}

std::vector<Advantage> advantages_in_cases(const AccuracyReport& report) {
  std::vector<Advantage> all;
  for (const AccuracyReport::Case& one : report.cases)
    add_advantages(one, bounded_columns(one), "", all);
  put_small_errors_first(all);
  return all;
}

const JudgedMeasure* find_measure(const CaseRun& run, const ErrorColumn& column) {
  for (const JudgedMeasure& measure : run.measures)
    if (measure.form == column.form && measure.measure == column.measure) return &measure;
  return nullptr;
}

std::string accuracy_text(const AccuracyReport& report) {
  std::string text;
  for (const AccuracyReport::Case& one : report.cases) text += case_text(one);
  return text + summary_text(report);
}

}  // namespace soda::analysis
