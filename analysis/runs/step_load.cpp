#include "analysis/runs/step_load.hpp"

#include <bit>
#include <chrono>
#include <utility>

#include "analysis/text/stopwatch.hpp"
#include "kernel/api/wire.hpp"

namespace soda::analysis {
namespace {

// Of a world, as it travels to the root. That frames begin is told by a record without any.
struct EntryNews {
  std::int64_t step = 0;
  std::uint32_t world = 0;
  std::uint32_t is_written = 0;    // else gone back to, and the rest says nothing
  std::uint64_t since_s_bits = 0;  // of its worker's mark
  std::uint64_t worked_s_bits = 0;
};

void spend(double cpu_s) {
  if (cpu_s <= 0.0) return;
  const double end_s = thread_cpu_s() + cpu_s;
  while (thread_cpu_s() < end_s) {
  }
}

std::int64_t clock_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

}  // namespace

StepLoad::StepLoad(const models::ArtificialLoad& load, double share_s,
                   const kernel::Partition& workers, const Next& next, bool is_root)
    : load_(load),
      share_s_(share_s),
      workers_(workers),
      next_(next.observer),
      is_root_(is_root),
      last_(workers.lps, next.first_step),
      work_(workers.workers) {}

void StepLoad::on_newest(models::WorldId world, std::int64_t step) {
  std::int64_t& last = last_[models::index_of(world)];
  const bool is_written = step > last;
  last = step;
  models::WorkMark mark;
  if (is_written) {
    spend(share_s_ * models::load_of(load_, world, since_s()));
    mark = {since_s(), thread_cpu_s()};
    work_[workers_.owner_of(kernel::LpId{models::index_of(world)})].push_back(mark);
  }
  next_.on_newest(world, step);
  if (!is_root_) tell(world, step, is_written ? &mark : nullptr);
}

void StepLoad::tell(models::WorldId world, std::int64_t step, const models::WorkMark* mark) {
  EntryNews news{.step = step, .world = models::index_of(world)};
  if (mark != nullptr) {
    news.is_written = 1;
    news.since_s_bits = std::bit_cast<std::uint64_t>(mark->since_s);
    news.worked_s_bits = std::bit_cast<std::uint64_t>(mark->worked_s);
  }
  const std::lock_guard lock(mutex_);
  kernel::append_plain(news_, news);
}

std::vector<kernel::Bytes> StepLoad::take_news() {
  if (is_root_) {
    if (has_sent_begin_ || first_frame_ns_.load() == 0) return {};
    has_sent_begin_ = true;
    return {{}};
  }
  const std::lock_guard lock(mutex_);
  if (news_.empty()) return {};
  return {std::exchange(news_, {})};
}

void StepLoad::receive(std::span<const std::byte> bytes) {
  if (!is_root_) return first_frame_follows();
  while (!bytes.empty()) {
    const auto news = kernel::take_plain<EntryNews>(bytes);
    if (news.is_written != 0)
      work_[workers_.owner_of(kernel::LpId{news.world})].push_back(
          {std::bit_cast<double>(news.since_s_bits), std::bit_cast<double>(news.worked_s_bits)});
    next_.on_newest(models::WorldId{news.world}, news.step);
  }
}

void StepLoad::first_frame_follows() { first_frame_ns_.store(clock_ns()); }

double StepLoad::since_s() const {
  const std::int64_t first = first_frame_ns_.load();
  return first > 0 ? 1e-9 * static_cast<double>(clock_ns() - first) : -1.0;
}

}  // namespace soda::analysis
