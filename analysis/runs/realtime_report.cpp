#include <algorithm>
#include <vector>

#include "analysis/runs/realtime.hpp"
#include "analysis/text/text_table.hpp"
#include "models/load_balancing/load_balancer.hpp"

namespace soda::analysis {
namespace {

constexpr std::size_t kColumns = 60, kRows = 6;

// What the worst frame of a stretch of time was like.
struct FrameColumn {
  std::int64_t least_fill = 0;
  models::FrameFate worst = models::FrameFate::kOnTime;
};

std::vector<FrameColumn> stretches(const std::vector<models::ShownFrame>& frames) {
  const std::size_t count = std::min(kColumns, frames.size());
  std::vector<FrameColumn> result(count);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t at = i * count / frames.size();
    const bool is_first = i == 0 || (i - 1) * count / frames.size() != at;
    FrameColumn& stretch = result[at];
    stretch.least_fill = is_first ? frames[i].fill : std::min(stretch.least_fill, frames[i].fill);
    stretch.worst = std::max(stretch.worst, frames[i].fate);
  }
  return result;
}

std::string diagram(const RealTimeReport& report) {
  const std::vector<FrameColumn> columns = stretches(report.frames);
  std::int64_t top = 1;
  for (const FrameColumn& column : columns) top = std::max(top, column.least_fill);
  std::string text =
      "  entries in store over time (least of each column); s: slow motion, L: late\n";
  for (std::size_t row = kRows; row > 0; --row) {
    const double level = static_cast<double>(top) * static_cast<double>(row) / kRows;
    std::string label = format_number(level, 3);
    label.insert(0, label.size() < 6 ? 6 - label.size() : 0, ' ');
    text += label + " |";
    for (const FrameColumn& column : columns)
      text +=
          static_cast<double>(column.least_fill) >= level - 0.5 * static_cast<double>(top) / kRows
              ? '#'
              : ' ';
    text += "\n";
  }
  text += "       +";
  for (const FrameColumn& column : columns)
    text += column.worst == models::FrameFate::kLate   ? 'L'
            : column.worst == models::FrameFate::kSlow ? 's'
                                                       : '-';
  return text + "\n        0 s" + std::string(columns.size() > 12 ? columns.size() - 10 : 2, ' ') +
         format_number(report.frames.back().due_s, 3) + " s\n";
}

}  // namespace

std::string real_time_text(const RealTimeReport& report) {
  const models::PlaybackSummary& sum = report.summary;
  std::string text =
      "real time: " + format_number(report.request.frames_per_s) + " frames/s, speed " +
      format_number(report.request.speed) + "; buffer of " + std::to_string(report.buffer) +
      " entries, GVT up to " + std::to_string(report.most_lead) + " beyond what is shown\n  " +
      std::to_string(sum.frames) + " frames: " + std::to_string(sum.on_time) + " on time, " +
      std::to_string(sum.slow) + " in slow motion, " + std::to_string(sum.late) + " late; " +
      format_number(sum.slow_motion_s, 3) + " s behind real time at the end\n  least in store " +
      std::to_string(sum.least_fill) + " entries; the renderer woke up to " +
      format_number(1e3 * report.worst_wake_s, 3) + " ms late\n";
  const RealTimeRequest& asked = report.request;
  if (asked.peak > 1.0) {
    text +=
        "  peak of load " + format_number(asked.peak) + " for " +
        format_number(asked.peak_for_s * asked.frames_per_s) +
        " frames; a full buffer lasts B r / (r - 1) = " +
        format_number(models::anticipation_steps(static_cast<double>(report.buffer), asked.peak)) +
        " steps\n";
  }
  return report.frames.empty() ? text : text + diagram(report);
}

}  // namespace soda::analysis
