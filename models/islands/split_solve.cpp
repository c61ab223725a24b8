#include "models/islands/split_solve.hpp"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>
#include <map>
#include <utility>

#include "kernel/api/hash_mix.hpp"
#include "physics/model/body_places.hpp"

namespace soda::models {
namespace {

using physics::BorderBody;

// Bit for bit.
bool same(std::span<const BorderBody> a, std::span<const BorderBody> b) {
  static_assert(sizeof(BorderBody) == 12 * sizeof(double));
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

IslandName name_of(const SplitIsland& island) {
  const XXH128_hash_t hash = XXH3_128bits(island.input.data(), island.input.size());
  return {island.ids.front(), {hash.high64, hash.low64}};
}

bool is_from(const kernel::MessageView& message, WorldId world, MessageKind kind) {
  return kernel::index_of(message.source) == index_of(world) &&
         message.kind == static_cast<std::uint32_t>(kind);
}

}  // namespace

SplitSolve::SplitSolve(SplitIsland island, SplitPlan plan, WorldId self)
    : island_(std::move(island)),
      plan_(std::move(plan)),
      self_(self),
      name_(name_of(island_)),
      iterations_(
          physics::BlockSolver::stages({*island_.scene, island_.scene->dt_s, island_.ids,
                                        std::span<const physics::BodyState>(island_.states)})) {
  for (std::size_t i = 0; i < plan_.solvers.size(); ++i) {
    if (plan_.solvers[i].world != self_) continue;
    range_ = &plan_.solvers[i];
    before_ = i > 0 ? range_ - 1 : nullptr;
    behind_ = i + 1 < plan_.solvers.size() ? range_ + 1 : nullptr;
  }
}

// What the solver beside this one sends of the border between them.
std::optional<std::vector<BorderBody>> SplitSolve::receive(const SolverRange* from, Bag bag) const {
  if (from == nullptr) return std::vector<BorderBody>{};
  const bool is_before = from == before_;
  for (const kernel::MessageView& message : bag) {
    if (!is_from(message, from->world, MessageKind::kBorders) ||
        island_named_in(message.payload) != name_)
      continue;
    BorderNews news = decode_border_news(message.payload);
    const std::uint32_t border = (is_before ? range_->first : range_->last) - 1;
    if (news.border == border && news.from_before == is_before) return std::move(news.bodies);
  }
  return std::nullopt;
}

// That of all blocks, in their order.
std::optional<physics::StepWork> SplitSolve::receive_work(Bag bag) const {
  physics::StepWork sum;
  for (const SolverRange& range : plan_.solvers) {
    std::optional<std::vector<physics::StepWork>> work;
    if (&range == range_) work = work_;
    for (const kernel::MessageView& message : bag)
      if (is_from(message, range.world, MessageKind::kWork) &&
          island_named_in(message.payload) == name_)
        work = decode_work_news(message.payload).work;
    if (!work) return std::nullopt;
    for (const physics::StepWork& of_block : *work) sum.add(of_block);
  }
  return sum;
}

bool SplitSolve::lacks_news(Bag bag) const {
  if (!solves() || is_done()) return false;
  return work_.empty() ? !receive(before_, bag) || !receive(behind_, bag) : !receive_work(bag);
}

void SplitSolve::round(std::int64_t step, std::uint32_t round, Bag bag, SolveShare& memory,
                       physics::StageCounters& counters, std::vector<Letter>& letters) {
  if (!solves() || is_done()) return;
  if (round == 0) {
    known_ = memory.find_blocks(island_.input, {range_->first, range_->last});
    if (!known_) solve_stages(0, counters);
    return send_borders(letters);
  }
  if (round > iterations_) {
    const std::optional<physics::StepWork> work = receive_work(bag);
    gave_up_ = !work;
    if (work) conclude(step, physics::allowed_share(*work), memory, counters);
    return;
  }
  receive_borders(round, bag, counters);
  if (gave_up_) return;
  if (round < iterations_) return send_borders(letters);
  send_work(letters);
}

void SplitSolve::receive_borders(std::uint32_t round, Bag bag, physics::StageCounters& counters) {
  auto before = receive(before_, bag), behind = receive(behind_, bag);
  gave_up_ = !before || !behind;
  if (gave_up_) return;
  SolvedBlocks::Stage& stage = stages_[round - 1];
  stage.from_before = std::move(*before);
  stage.from_behind = std::move(*behind);
  if (known_) {
    const SolvedBlocks::Stage& then = known_->stages[round - 1];
    if (!same(stage.from_before, then.from_before) || !same(stage.from_behind, then.from_behind)) {
      known_ = nullptr;
      solve_stages(round, counters);
    }
  } else {
    solve_stages(round, counters);
  }
}

// The borders of stage - 1 and the blocks of `stage`; all before that, too, if nothing has been
// computed in this execution yet.
void SplitSolve::solve_stages(std::uint32_t stage, physics::StageCounters& counters) {
  std::uint32_t next = stage;
  if (!solver_) {
    const physics::LargeIsland large{*island_.scene,    island_.scene->dt_s, island_.ids,
                                     island_.manifolds, island_.states,      plan_.blocks};
    solver_ = std::make_unique<physics::BlockSolver>(large, range_->first, range_->last, counters);
    next = 0;
  }
  for (; next <= stage; ++next) {
    if (next > 0) {
      const SolvedBlocks::Stage& received = stages_[next - 1];
      gave_up_ =
          !solver_->take_lower(received.from_before) || !solver_->take_upper(received.from_behind);
      if (gave_up_) return;
      solver_->solve_borders(next - 1, counters);
    }
    if (next < iterations_) solver_->solve_blocks(next, counters);
  }
}

void SplitSolve::send_borders(std::vector<Letter>& letters) {
  SolvedBlocks::Stage stage;
  if (known_) {
    stage.to_before = known_->stages[stages_.size()].to_before;
    stage.to_behind = known_->stages[stages_.size()].to_behind;
  } else {
    if (before_ != nullptr)
      stage.to_before = encode_border_news({name_, range_->first - 1, false, solver_->at_lower()});
    if (behind_ != nullptr)
      stage.to_behind = encode_border_news({name_, range_->last - 1, true, solver_->at_upper()});
  }
  if (before_ != nullptr)
    letters.push_back({before_->world, MessageKind::kBorders, stage.to_before});
  if (behind_ != nullptr)
    letters.push_back({behind_->world, MessageKind::kBorders, stage.to_behind});
  stages_.push_back(std::move(stage));
}

void SplitSolve::send_work(std::vector<Letter>& letters) {
  if (known_) {
    work_ = known_->work;
  } else {
    for (std::uint32_t block = range_->first; block < range_->last; ++block)
      work_.push_back(solver_->report(block).work);
  }
  const kernel::Payload news = encode_work_news({name_, range_->first, work_});
  for (const SolverRange& range : plan_.solvers)
    if (&range != range_) letters.push_back({range.world, MessageKind::kWork, news});
}

void SplitSolve::conclude(std::int64_t step, double share, SolveShare& memory,
                          physics::StageCounters& counters) {
  if (known_ && known_->share == share) {
    outcome_ = known_;
    return;
  }
  known_ = nullptr;
  if (!solver_) solve_stages(iterations_, counters);
  if (gave_up_) return;
  if (share != 1.0) solver_->take_share(share);
  auto solved = std::make_shared<SolvedBlocks>();
  solved->work = work_;
  solved->share = share;
  for (std::uint32_t block = range_->first; block < range_->last; ++block) {
    solved->reports.push_back(solver_->report(block));
    solver_->move(block, solved->moved.emplace_back(), solved->faults);
  }
  solved->stages = stages_;
  outcome_ = solved;
  memory.store_blocks(step, island_.input, {range_->first, range_->last}, std::move(solved));
}

BlockNews SplitSolve::news_for(WorldId world) const {
  BlockNews news{name_, range_->first, range_->last, {}, {}, {}};
  for (std::size_t i = 0; i < island_.ids.size(); ++i) {
    const std::uint32_t block = plan_.blocks.block_of[i];
    if (island_.owners[i] != world || block < range_->first || block >= range_->last) continue;
    news.bodies.push_back(
        {island_.ids[i], outcome_->moved[block - range_->first][plan_.blocks.place_in[i]]});
  }
  for (const physics::AdvanceFault& fault : outcome_->faults) {
    if (island_.owners[physics::place_of(island_.ids, fault.body)] == world)
      news.faults.push_back(fault);
  }
  news.reports = outcome_->reports;
  return news;
}

std::vector<SplitSolve::Letter> SplitSolve::outcome_letters() const {
  std::vector<WorldId> worlds = island_.owners;
  std::sort(worlds.begin(), worlds.end());
  worlds.erase(std::unique(worlds.begin(), worlds.end()), worlds.end());
  std::vector<Letter> letters;
  for (const WorldId world : worlds)
    if (world != self_)
      letters.push_back({world, MessageKind::kBlocks, encode_block_news(news_for(world))});
  return letters;
}

bool SplitSolve::lacks_outcome(Bag bag) const {
  if (gave_up_) return false;
  return std::any_of(plan_.solvers.begin(), plan_.solvers.end(), [&](const SolverRange& range) {
    return range.world != self_ &&
           std::none_of(bag.begin(), bag.end(), [&](const kernel::MessageView& message) {
             return is_from(message, range.world, MessageKind::kBlocks) &&
                    island_named_in(message.payload) == name_;
           });
  });
}

std::optional<SplitSolve::Received> SplitSolve::outcome(Bag bag) const {
  std::map<std::uint32_t, BlockNews> ranges;  // by first block
  if (is_done()) ranges.emplace(range_->first, news_for(self_));
  for (const kernel::MessageView& message : bag) {
    if (message.kind != static_cast<std::uint32_t>(MessageKind::kBlocks)) continue;
    if (island_named_in(message.payload) != name_) continue;
    BlockNews news = decode_block_news(message.payload);
    ranges.emplace(news.first, std::move(news));
  }
  Received received;
  std::vector<physics::BlockReport> reports;
  physics::IslandReport& report = received.report.emplace();
  report.label = island_.ids.front();
  report.bodies = static_cast<std::uint32_t>(island_.ids.size());
  for (const physics::ContactManifold& m : island_.manifolds) report.contact_points += m.count;
  report.iterations = iterations_;
  for (auto& [first, news] : ranges) {
    std::move(news.bodies.begin(), news.bodies.end(), std::back_inserter(received.bodies));
    received.faults.insert(received.faults.end(), news.faults.begin(), news.faults.end());
    if (first == reports.size())
      reports.insert(reports.end(), news.reports.begin(), news.reports.end());
  }
  const auto own = std::count(island_.owners.begin(), island_.owners.end(), self_);
  if (static_cast<std::ptrdiff_t>(received.bodies.size()) != own) return std::nullopt;
  if (reports.size() != plan_.blocks.count()) return std::nullopt;
  for (const physics::BlockReport& block : reports) add(block, report);
  if (island_.owners.front() != self_) received.report.reset();
  return received;
}

std::uint64_t SplitSolve::digest() const {
  std::uint64_t digest = name_.content[0];
  digest = kernel::append(digest, stages_.size());
  digest = kernel::append(digest, gave_up_);
  for (const physics::StepWork& work : work_)
    digest = kernel::append(digest, std::bit_cast<std::uint64_t>(work.after.sum));
  if (outcome_) digest = kernel::append(digest, std::bit_cast<std::uint64_t>(outcome_->share));
  for (const SolvedBlocks::Stage& stage : stages_) {
    for (const auto* received : {&stage.from_before, &stage.from_behind})
      digest = kernel::append(digest,
                              XXH3_64bits(received->data(), received->size() * sizeof(BorderBody)));
    for (const auto* said : {&stage.to_before, &stage.to_behind}) {
      const std::span<const std::byte> bytes = said->bytes();
      digest = kernel::append(digest, XXH3_64bits(bytes.data(), bytes.size()));
    }
  }
  return digest;
}

}  // namespace soda::models
