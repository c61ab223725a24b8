// What `soda scaling` has measured, as tables, pictures and JSON.
#pragma once

#include <string>

#include "analysis/scaling/scaling_run.hpp"

namespace soda::analysis {

// One table for each scene; of several scenes with one point each, one table for all.
std::string scaling_text(const ScalingReport& report);
std::string scaling_csv(const ScalingReport& report);
std::string scaling_json(const ScalingReport& report);
// Self-contained. `command`: as it was typed.
std::string scaling_html(const ScalingReport& report, const std::string& command);

}  // namespace soda::analysis
