#include "models/real_time/virtual_playback.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace soda::models {
namespace {

constexpr double kNsPerS = 1e9;
// By so much a frame may come late: what is ready when it is due must count, though times are
// rounded.
constexpr std::int64_t kTolerance_ns = 1000;

}  // namespace

VirtualPlayback::VirtualPlayback(BufferInterface& buffer, const PlaybackOptions& options,
                                 std::int64_t fill, const ArtificialLoad& load,
                                 const kernel::Partition& processors, double step_ns)
    : buffer_(buffer),
      options_(options),
      enough_(std::min(options.first_step + fill, options.steps)),
      load_(load),
      processors_(processors),
      step_ns_(step_ns),
      worlds_(processors.lps, OfWorld{.newest = options.first_step}),
      work_(processors.workers),
      worked_ns_(processors.workers) {}

double VirtualPlayback::since_s() const {
  return playback_ ? static_cast<double>(now_ns_ - first_frame_ns_) / kNsPerS : -1.0;
}

std::optional<std::int64_t> VirtualPlayback::next_ns() {
  if (!playback_) {
    tell_what_is_ready();
    return buffer_.reached() >= enough_ ? std::optional(now_ns_) : std::nullopt;
  }
  if (playback_->finished()) return std::nullopt;
  const double due_s = playback_->next_due_s();
  return first_frame_ns_ + static_cast<std::int64_t>(std::ceil(due_s * kNsPerS)) + kTolerance_ns;
}

// The cluster executes an event when its processor begins to work on it.
void VirtualPlayback::tell_what_is_ready() {
  for (std::uint32_t world = 0; world < worlds_.size(); ++world)
    if (worlds_[world].ready_ns <= now_ns_)
      buffer_.on_newest(WorldId{world}, worlds_[world].newest);
}

void VirtualPlayback::act() {
  tell_what_is_ready();
  if (!playback_) {
    first_frame_ns_ = now_ns_;
    playback_.emplace(buffer_, options_, 0.0);
  } else {
    playback_->show_next();
  }
}

void VirtualPlayback::on_newest(WorldId world, std::int64_t step) {
  OfWorld& of = worlds_[index_of(world)];
  of.has_written = step > of.newest;
  if (of.has_written) {
    of.load_ns = static_cast<std::int64_t>(step_ns_ * load_of(load_, world, since_s()));
    // What is ready is told before it is forgotten.
    if (of.ready_ns <= now_ns_) buffer_.on_newest(world, of.newest);
  } else {
    buffer_.on_newest(world, step);
  }
  of.newest = step;
}

std::int64_t VirtualPlayback::event_cost_ns(WorldId world, std::int64_t own_ns) {
  OfWorld& of = worlds_[index_of(world)];
  const std::int64_t cost_ns = own_ns + std::exchange(of.load_ns, 0);
  const std::size_t processor = processors_.owner_of(kernel::LpId{index_of(world)});
  worked_ns_[processor] += cost_ns;
  if (!std::exchange(of.has_written, false)) return cost_ns;
  of.ready_ns = now_ns_ + cost_ns;
  work_[processor].push_back({since_s(), static_cast<double>(worked_ns_[processor]) / kNsPerS});
  return cost_ns;
}

void VirtualPlayback::finish() {
  if (!playback_) playback_.emplace(buffer_, options_, 0.0);
  while (!playback_->finished()) {
    const std::int64_t before = buffer_.shown();
    if (playback_->show_next().clock == before && before < options_.steps) break;  // ended early
  }
}

}  // namespace soda::models
