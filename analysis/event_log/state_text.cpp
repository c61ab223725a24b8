#include "analysis/event_log/state_text.hpp"

#include <algorithm>

#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {

std::vector<Column> state_columns() {
  std::vector<Column> columns;
  for (const char* title : {"body", "x m", "y m", "z m", "qw", "qx", "qy", "qz", "vx m/s", "vy m/s",
                            "vz m/s", "wx rad/s", "wy rad/s", "wz rad/s", "impulses"}) {
    columns.push_back({title, Align::kRight});
  }
  return columns;
}

std::vector<std::string> state_cells(std::uint32_t label, const physics::BodyState& state) {
  std::vector<std::string> row = {std::to_string(label)};
  const auto add = [&row](double number) { row.push_back(format_number(number, 9)); };
  for (int i = 0; i < 3; ++i) add(state.position_m[i]);
  add(state.orientation.w());
  add(state.orientation.x());
  add(state.orientation.y());
  add(state.orientation.z());
  for (int i = 0; i < 3; ++i) add(state.linear_velocity_m_s[i]);
  for (int i = 0; i < 3; ++i) add(state.angular_velocity_rad_s[i]);
  row.push_back(std::to_string(state.impulses.size()));
  return row;
}

std::string states_text(const LoggedStep& logged, const std::vector<std::uint32_t>& labels) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < logged.ids.size(); ++i) {
    rows.push_back(state_cells(labels[physics::index_of(logged.ids[i])], logged.states[i]));
  }
  return format_table(state_columns(), rows);
}

std::string state_in_full(const physics::BodyState& state) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&rows](const std::string& name, double number) {
    rows.push_back({name, format_exact(number), format_bits(number)});
  };
  const auto add_vec3 = [&add](const std::string& name, const physics::Vec3& v) {
    add(name + ".x", v.x());
    add(name + ".y", v.y());
    add(name + ".z", v.z());
  };
  add_vec3("position_m", state.position_m);
  add("orientation.w", state.orientation.w());
  add("orientation.x", state.orientation.x());
  add("orientation.y", state.orientation.y());
  add("orientation.z", state.orientation.z());
  add_vec3("linear_velocity_m_s", state.linear_velocity_m_s);
  add_vec3("angular_velocity_rad_s", state.angular_velocity_rad_s);
  for (std::size_t i = 0; i < state.impulses.size(); ++i) {
    const std::string name = "impulses[" + std::to_string(i) + "].";
    add(name + "normal_newton_s", state.impulses[i].normal_newton_s);
    add_vec3(name + "friction_newton_s", state.impulses[i].friction_newton_s);
  }
  return format_table({{"field"}, {"value", Align::kRight}, {"bits"}}, rows);
}

physics::BodyId body_of_label(const std::vector<std::uint32_t>& labels, std::uint32_t label,
                              const std::string& where) {
  const auto found = std::ranges::find(labels, label);
  if (found == labels.end()) throw UsageError(where + " has no body " + std::to_string(label));
  return static_cast<physics::BodyId>(found - labels.begin());
}

}  // namespace soda::analysis
