#include "physics/constraints/joint_elimination.hpp"

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>

#include "physics/math/disjoint_sets.hpp"

namespace soda::physics {
namespace {

// What is eliminated at once: all joints between two bodies, or between one and the world or a hub
// whose arms they are; or a hub.
struct Bundle {
  JointEnds ends{kImmovable, kImmovable};
  std::uint32_t arms_of = kImmovable, is_hub = kImmovable;  // indices of hubs
  std::uint32_t hangs_on = 0, rows = 0;
  std::vector<std::uint32_t> nodes;
};

// A body, or several that have become one as what was between them was eliminated.
struct Element {
  std::vector<std::array<std::uint32_t, 2>> bundles;  // other end and number; ascending
  std::uint32_t rows = 0;                             // of those
  std::uint32_t joins_hub = kImmovable;               // with which they are coupled, too
};

auto find_end(std::vector<std::array<std::uint32_t, 2>>& bundles, std::uint32_t end) {
  return std::ranges::lower_bound(bundles, end, {}, [](const auto& entry) { return entry[0]; });
}

double multiplications_of(double size, double rows_below) {
  return size * (0.2 * size * size + size * rows_below + 0.5 * rows_below * rows_below);
}

// Minimum degree: what has the fewest rows to be changed below it comes next, the first of several.
// W. F. Tinney, J. W. Walker, "Direct solutions of sparse network equations by optimally ordered
// triangular factorization", Proc. IEEE 55 (1967). A joint has two ends, so what is left after each
// elimination is a graph of bodies again, of which two have become one. Everything that hangs on a
// hub goes before it, and what holds it after it: with a body that stands still, joints that are in
// loops or lead to the world could contradict each other.
class Ordering {
 public:
  Ordering(const JointTree& tree, std::span<const JointEnds> ends,
           std::span<const std::uint32_t> first_row)
      : tree_(tree), elements_(tree.hub_of.size()) {
    for (std::uint32_t joint = 0; joint < ends.size(); ++joint) {
      const std::uint32_t hub = tree.hub_of_arm[joint];
      Bundle bundle{ends[joint],
                    hub,
                    kImmovable,
                    tree.hangs_on[joint],
                    first_row[joint + 1] - first_row[joint],
                    {joint}};
      if (hub != kImmovable && bundle.ends[0] == tree.hubs[hub]) bundle.ends[0] = kImmovable;
      if (hub != kImmovable && bundle.ends[1] == tree.hubs[hub]) bundle.ends[1] = kImmovable;
      if (bundle.ends[0] == kImmovable) std::swap(bundle.ends[0], bundle.ends[1]);
      add(std::move(bundle));
    }
    first_hub_ = static_cast<std::uint32_t>(bundles_.size());
    for (std::uint32_t hub = 0; hub < tree.hubs.size(); ++hub) {
      const auto node = static_cast<std::uint32_t>(ends.size()) + hub;
      bundles_.push_back({{kImmovable, kImmovable}, kImmovable, hub, hub, kHubRows, {node}});
    }
    for (std::uint32_t i = 0; i < bundles_.size(); ++i) into_.push_back(i);
    gone_.assign(bundles_.size(), false);
    for (std::uint32_t i = 0; i < bundles_.size(); ++i) offer(i);
  }

  // Whether that takes at most so many multiplications.
  bool eliminate_all(double most_multiplications) {
    while (!offers_.empty()) {
      const Offer offer = offers_.top();
      offers_.pop();
      const std::uint32_t next = std::get<3>(offer);
      if (gone_[next] || into_[next] != next || offer != offer_of(next)) continue;
      multiplications_ += multiplications_of(bundles_[next].rows, rows_below(next));
      if (multiplications_ > most_multiplications) return false;
      eliminate(next);
    }
    return true;
  }

  double multiplications() const { return multiplications_; }
  std::size_t count() const { return order_.size(); }
  const Bundle& at(std::size_t place) const { return bundles_[order_[place]]; }

  LdlPattern pattern() {
    std::vector<std::uint32_t> place(bundles_.size());
    for (std::uint32_t k = 0; k < order_.size(); ++k) place[order_[k]] = k;
    for (std::vector<std::uint32_t>& joined : joined_)
      for (std::uint32_t& bundle : joined) bundle = place[find_root(into_, bundle)];
    return ldl_pattern(joined_);
  }

 private:
  // What hangs on which hub, whether it is that hub, rows below, number.
  using Offer = std::tuple<std::uint32_t, bool, std::uint32_t, std::uint32_t>;

  // Joints of the same two ends make one bundle.
  void add(Bundle bundle) {
    const auto [a, b] = bundle.ends;
    const auto number = static_cast<std::uint32_t>(bundles_.size());
    if (a != kImmovable) {
      elements_[a].rows += bundle.rows;
      if (b != kImmovable) elements_[b].rows += bundle.rows;
      const auto at = find_end(elements_[a].bundles, b);
      if (at != elements_[a].bundles.end() && (*at)[0] == b) {
        Bundle& first = bundles_[(*at)[1]];
        first.rows += bundle.rows;
        first.nodes.push_back(bundle.nodes.front());
        return;
      }
      elements_[a].bundles.insert(at, {b, number});
      if (b != kImmovable)
        elements_[b].bundles.insert(find_end(elements_[b].bundles, a), {a, number});
    }
    bundles_.push_back(std::move(bundle));
  }

  std::uint32_t hub_below(const Bundle& bundle) const {
    std::uint32_t hub = bundle.arms_of;
    for (const std::uint32_t end : bundle.ends)
      if (end != kImmovable && hub == kImmovable) hub = elements_[end].joins_hub;
    return hub;
  }

  std::uint32_t rows_below(std::uint32_t number) const {
    const Bundle& bundle = bundles_[number];
    if (bundle.is_hub != kImmovable) return elements_[tree_.hubs[bundle.is_hub]].rows;
    std::uint32_t rows = hub_below(bundle) != kImmovable ? kHubRows : 0;
    for (const std::uint32_t end : bundle.ends)
      if (end != kImmovable) rows += elements_[end].rows - bundle.rows;
    return rows;
  }

  Offer offer_of(std::uint32_t number) const {
    const Bundle& bundle = bundles_[number];
    return {bundle.hangs_on, bundle.is_hub != kImmovable, rows_below(number), number};
  }
  void offer(std::uint32_t number) { offers_.push(offer_of(number)); }

  void eliminate(std::uint32_t number) {
    const Bundle& bundle = bundles_[number];
    order_.push_back(number);
    gone_[number] = true;
    std::vector<std::uint32_t>& joined = joined_.emplace_back();
    const auto join = [&](std::uint32_t element) {
      for (const auto& [end, other] : elements_[element].bundles)
        if (other != number) joined.push_back(other);
    };
    if (bundle.is_hub != kImmovable) return join(tree_.hubs[bundle.is_hub]);
    const std::uint32_t hub = hub_below(bundle);
    if (hub != kImmovable) joined.push_back(first_hub_ + hub);
    auto [a, b] = bundle.ends;
    if (a == kImmovable) return;
    join(a);
    if (b != kImmovable) join(b);
    take_out(a, b, bundle.rows);
    if (b != kImmovable) {
      take_out(b, a, bundle.rows);
      if (elements_[a].bundles.size() < elements_[b].bundles.size()) std::swap(a, b);
      merge(b, a);
    }
    elements_[a].joins_hub = hub;
    for (const auto& [end, other] : elements_[a].bundles) offer(other);
  }

  void take_out(std::uint32_t element, std::uint32_t end, std::uint32_t rows) {
    elements_[element].bundles.erase(find_end(elements_[element].bundles, end));
    elements_[element].rows -= rows;
  }

  // Two elements become one.
  void merge(std::uint32_t from, std::uint32_t into) {
    std::vector<std::array<std::uint32_t, 2>>& own = elements_[into].bundles;
    for (const auto& [end, number] : elements_[from].bundles) {
      const auto at = find_end(own, end);
      const bool both = at != own.end() && (*at)[0] == end;
      Bundle& moved = bundles_[number];
      if (both) {
        Bundle& first = bundles_[(*at)[1]];
        first.rows += moved.rows;
        first.nodes.insert(first.nodes.end(), moved.nodes.begin(), moved.nodes.end());
        into_[number] = (*at)[1];
      } else {
        own.insert(at, {end, number});
        std::ranges::replace(moved.ends, from, into);
      }
      if (end == kImmovable) continue;
      auto& others = elements_[end].bundles;
      others.erase(find_end(others, from));
      if (!both) others.insert(find_end(others, into), {into, number});
    }
    elements_[into].rows += elements_[from].rows;
    elements_[from] = {};
  }

  const JointTree& tree_;
  std::vector<Bundle> bundles_;
  std::vector<Element> elements_;
  std::vector<std::uint32_t> into_;  // which bundle each has become part of
  std::vector<bool> gone_;
  std::uint32_t first_hub_ = 0;
  std::priority_queue<Offer, std::vector<Offer>, std::greater<>> offers_;
  std::vector<std::uint32_t> order_;
  std::vector<std::vector<std::uint32_t>> joined_;  // of each in the order
  double multiplications_ = 0.0;
};

// Pairs of nodes whose block is not zero.
std::vector<std::array<std::uint32_t, 2>> coupled_nodes(const JointTree& tree,
                                                        std::span<const JointEnds> ends,
                                                        std::span<const JointEnds> coupling) {
  std::vector<std::vector<std::uint32_t>> of_body(tree.hub_of.size());
  std::vector<std::array<std::uint32_t, 2>> pairs;
  const auto joints = static_cast<std::uint32_t>(ends.size());
  for (std::uint32_t joint = 0; joint < joints; ++joint) {
    pairs.push_back({joint, joint});
    for (const std::uint32_t end : coupling[joint]) {
      if (end == kImmovable) continue;
      for (const std::uint32_t other : of_body[end])
        // Two joints can share two bodies: once.
        if (end == coupling[joint][0] ||
            std::ranges::find(coupling[other], coupling[joint][0]) == coupling[other].end() ||
            coupling[joint][0] == kImmovable)
          pairs.push_back({other, joint});
    }
    for (const std::uint32_t end : coupling[joint])
      if (end != kImmovable) of_body[end].push_back(joint);
    for (const std::uint32_t end : ends[joint])
      if (end != kImmovable && tree.hub_of[end] != kImmovable)
        pairs.push_back({joint, joints + tree.hub_of[end]});
  }
  for (std::uint32_t hub = 0; hub < tree.hubs.size(); ++hub)
    pairs.push_back({joints + hub, joints + hub});
  return pairs;
}

std::vector<JointEnds> ends_that_couple(const JointTree& tree, std::span<const JointEnds> ends) {
  std::vector<JointEnds> coupling(ends.begin(), ends.end());
  for (JointEnds& of_joint : coupling)
    for (std::uint32_t& end : of_joint)
      if (end != kImmovable && tree.hub_of[end] != kImmovable) end = kImmovable;
  return coupling;
}

JointElimination of_one_joint(const JointEnds& ends, std::uint32_t rows) {
  return {.pattern = {.column_begin = {0, 1}, .below = {0}},
          .multiplications = multiplications_of(rows, 0.0),
          .entries = {{0, 0, 0, 0}},
          .nodes = {0},
          .group_of = {0},
          .hubs = {},
          .coupling = {ends}};
}

}  // namespace

std::optional<JointElimination> plan_joint_elimination(std::span<const JointEnds> ends,
                                                       std::span<const std::uint32_t> first_row,
                                                       double most_multiplications) {
  if (ends.size() == 1) return of_one_joint(ends.front(), first_row[1]);
  const JointTree tree = joint_tree(ends);
  Ordering order(tree, ends, first_row);
  if (!order.eliminate_all(most_multiplications)) return std::nullopt;
  JointElimination plan{.pattern = order.pattern(),
                        .multiplications = order.multiplications(),
                        .entries = {},
                        .nodes = {},
                        .group_of = std::vector<std::uint32_t>(ends.size() + tree.hubs.size()),
                        .hubs = tree.hubs,
                        .coupling = ends_that_couple(tree, ends)};
  std::vector<std::uint32_t> place(plan.group_of.size());
  for (std::uint32_t group = 0; group < order.count(); ++group)
    for (const std::uint32_t node : order.at(group).nodes) {
      place[node] = static_cast<std::uint32_t>(plan.nodes.size());
      plan.nodes.push_back(node);
      plan.group_of[node] = group;
    }
  for (const auto& [a, b] : coupled_nodes(tree, ends, plan.coupling)) {
    const std::uint32_t later = place[a] >= place[b] ? a : b, earlier = later == a ? b : a;
    const std::uint32_t column = plan.group_of[earlier];
    plan.entries.push_back(
        {later, earlier, plan.pattern.block_of(plan.group_of[later], column), column});
  }
  return plan;
}

}  // namespace soda::physics
