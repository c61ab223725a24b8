// A timeline as bytes of a page.
#include <algorithm>

#include "analysis/viewer/page_bytes.hpp"

namespace soda::analysis {
namespace {

using Bar = Timeline::Bar;

// Times as 32 bits: units of `unit_ns` from 0 on.
std::uint32_t in_units(std::int64_t ns, std::int64_t unit_ns) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(ns / unit_ns, 0, 0xffff'ffff));
}

std::uint32_t shown_step(std::int64_t step) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(step, 0, 0xffff'ffff));
}

std::uint8_t busy_share(const Bar& bar) {
  const std::int64_t length = bar.ended_ns - bar.began_ns;
  if (length <= 0) return 255;
  return static_cast<std::uint8_t>(std::min<double>(
      255.0, 255.0 * static_cast<double>(bar.busy_ns) / static_cast<double>(length)));
}

void put_bars(ByteBuffer& out, const std::vector<Bar>& bars, std::int64_t unit_ns) {
  put_column(out, bars, [=](const Bar& bar) { return in_units(bar.began_ns, unit_ns); });
  put_column(out, bars, [=](const Bar& bar) { return in_units(bar.ended_ns, unit_ns); });
  put_column(out, bars, [](const Bar& bar) { return bar.world; });
  put_column(out, bars, [](const Bar& bar) { return shown_step(bar.step); });
  put_column(out, bars, [](const Bar& bar) { return shown_step(bar.last_step); });
  put_column(out, bars, [](const Bar& bar) { return bar.rollback; });
  put_column(out, bars, [](const Bar& bar) { return bar.phase; });
  put_column(out, bars, [](const Bar& bar) { return static_cast<std::uint8_t>(bar.fate); });
  put_column(out, bars, busy_share);
}

void put_rollback(ByteBuffer& out, const Timeline::Rollback& rollback) {
  put(out, rollback.number);
  put(out, rollback.world);
  put(out, rollback.at_ns);
  put(out, rollback.restart);
  put(out, rollback.changed_step);
  put(out, rollback.changed_at);
  put(out, rollback.undone);
  put(out, rollback.put_back);
  put(out, rollback.wasted_ns);
  put(out, rollback.because_of);
  put(out, rollback.cause);
  put_integers(out, rollback.bodies);
  put_list<Timeline::Arrow>(out, rollback.arrows, [&out](const Timeline::Arrow& arrow) {
    put(out, arrow.from);
    put(out, arrow.sent_ns);
    put(out, arrow.arrived_ns);
    put(out, arrow.sent_at);
    put(out, static_cast<std::uint8_t>(arrow.anti));
  });
  put(out, rollback.text);
}

void put_samples(ByteBuffer& out, const Timeline& timeline) {
  put_column(out, timeline.samples, [](const Timeline::Sample& sample) { return sample.executed; });
  put_column(out, timeline.samples, [](const Timeline::Sample& sample) { return sample.undone; });
  put_column(out, timeline.samples,
             [](const Timeline::Sample& sample) { return shown_step(sample.committed); });
  std::vector<std::uint32_t> reached;  // by sample, then world
  for (const Timeline::Sample& sample : timeline.samples)
    for (const std::int64_t step : sample.reached) reached.push_back(shown_step(step));
  put_integers(out, reached);
}

}  // namespace

ByteBuffer encoded(const std::optional<Timeline>& shown) {
  ByteBuffer out;
  put(out, static_cast<std::uint8_t>(shown.has_value()));
  if (!shown) return out;
  const Timeline& timeline = *shown;
  const std::int64_t unit_ns = 1 + timeline.end_ns / 0xffff'ffff;
  put(out, timeline.worlds);
  put(out, timeline.buffer);
  put(out, static_cast<std::uint8_t>(timeline.is_modelled));
  put(out, timeline.all_executions);
  put(out, timeline.all_rollbacks);
  put(out, timeline.steps_a_bar);
  put(out, timeline.end_ns);
  put(out, unit_ns);
  put_bars(out, timeline.bars, unit_ns);
  put_list<std::string>(out, timeline.causes,
                        [&out](const std::string& cause) { put(out, cause); });
  put_list<Timeline::Rollback>(out, timeline.rollbacks, [&out](const Timeline::Rollback& rollback) {
    put_rollback(out, rollback);
  });
  put_samples(out, timeline);
  put(out, timeline.steps_a_cost);
  put_column(out, timeline.costs, [](const Timeline::StepCost& cost) { return cost.kept_ns; });
  put_column(out, timeline.costs, [](const Timeline::StepCost& cost) { return cost.in_vain_ns; });
  put_column(out, timeline.commits, [](const Timeline::Commit& commit) { return commit.steps; });
  put_column(out, timeline.commits, [](const Timeline::Commit& commit) { return commit.at_ns; });
  return out;
}

}  // namespace soda::analysis
