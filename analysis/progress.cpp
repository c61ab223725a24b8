#include "analysis/progress.hpp"

#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>

#include "analysis/text_table.hpp"

namespace soda::analysis {
namespace {

using Clock = std::chrono::steady_clock;

struct ProgressLine {
  Clock::time_point start = Clock::now();
  Clock::time_point shown = start;

  ~ProgressLine() {
    if (shown != start) std::cerr << "\r\x1b[K" << std::flush;
  }
};

void show(ProgressLine& line, std::int64_t steps, const models::Progress& progress) {
  const Clock::time_point now = Clock::now();
  if (now - line.shown < std::chrono::milliseconds(200)) return;
  line.shown = now;
  const double elapsed_s = std::chrono::duration<double>(now - line.start).count();
  const double rate = static_cast<double>(progress.committed_step) / elapsed_s;
  std::string text = "step " + std::to_string(progress.committed_step) + " of " +
                     std::to_string(steps) + ", " + format_number(rate, 3) + " steps/s" +
                     ", efficiency " + format_number(100.0 * progress.efficiency, 3) + " %";
  if (rate > 0.0) {
    const double left_s = static_cast<double>(steps - progress.committed_step) / rate;
    text += ", " + format_number(left_s, 2) + " s left";
  }
  std::cerr << "\r\x1b[K" << text << std::flush;
}

}  // namespace

std::function<void(const models::Progress&)> terminal_progress(std::int64_t steps, bool quiet) {
  if (quiet || isatty(STDERR_FILENO) == 0) return {};
  const auto line = std::make_shared<ProgressLine>();
  return [line, steps](const models::Progress& progress) { show(*line, steps, progress); };
}

}  // namespace soda::analysis
