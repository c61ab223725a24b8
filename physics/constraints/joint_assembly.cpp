#include "physics/constraints/joint_assembly.hpp"

#include <cstddef>
#include <cstdint>

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

// What impulses along `y` do to the velocity of `x`, by the ends that both have.
double coupling(const JointRow& x, const JointEnds& of_x, const JointRow& y, const JointEnds& of_y,
                const RowTwist& twist_y, std::span<const SolverBody> bodies) {
  const double along = x.linear.dot(y.linear);
  double sum = 0.0;
  if (of_x[0] != kImmovable) {
    const double linear = bodies[of_x[0]].inverse_mass * along;
    if (of_x[0] == of_y[0]) sum += linear + x.angular_a.dot(twist_y.a);
    if (of_x[0] == of_y[1]) sum -= linear + x.angular_a.dot(twist_y.b);
  }
  if (of_x[1] != kImmovable) {
    const double linear = bodies[of_x[1]].inverse_mass * along;
    if (of_x[1] == of_y[0]) sum -= linear + x.angular_b.dot(twist_y.a);
    if (of_x[1] == of_y[1]) sum += linear + x.angular_b.dot(twist_y.b);
  }
  return sum;
}

void find_twists(std::span<const SolverBody> bodies, JointSystem& system) {
  system.twists.resize(system.rows.size());
  for (std::size_t r = 0; r < system.rows.size(); ++r) {
    const JointRow& row = system.rows[r];
    const SolverBody &a = bodies[row.a], &b = bodies[row.b];
    system.twists[r].a = times(a.inverse_inertia, row.angular_a);
    system.twists[r].b =
        b.inverse_mass > 0.0 ? times(b.inverse_inertia, row.angular_b) : Vec3(Vec3::Zero());
  }
}

// Not the springs that are left out.
bool takes_part(const JointRow& row) {
  return !row.idle && (row.linear != Vec3::Zero() || row.angular_a != Vec3::Zero() ||
                       row.angular_b != Vec3::Zero());
}

class Assembly {
 public:
  Assembly(std::span<const SolverBody> bodies, double regularisation, JointSystem& system)
      : bodies_(bodies),
        regularisation_(regularisation),
        system_(system),
        plan_(*system.elimination) {
    place_rows();
    for (const JointElimination::Entry& entry : plan_.entries) add(entry);
  }

  const ShortList<double, 32>& scales() const { return scales_; }

 private:
  bool is_hub(std::uint32_t node) const { return node >= system_.joints.size(); }
  std::size_t hub_of(std::uint32_t node) const { return node - system_.joints.size(); }

  void place_rows() {
    ShortList<std::uint32_t, 16> sizes(plan_.pattern.count(), 0);
    std::uint32_t next = 0;
    system_.place_of_row.assign(system_.rows.size(), kNoPlace);
    first_of_hub_.resize(plan_.hubs.size());
    for (const std::uint32_t node : plan_.nodes) {
      const std::uint32_t before = next;
      if (is_hub(node)) {
        first_of_hub_[hub_of(node)] = next;
        next += kHubRows;
      } else {
        for (std::uint32_t r = system_.first_row[node]; r < system_.first_row[node + 1]; ++r)
          if (takes_part(system_.rows[r])) system_.place_of_row[r] = next++;
      }
      sizes[plan_.group_of[node]] += next - before;
    }
    system_.matrix.reset(plan_.pattern, as_span(sizes));
    scales_.assign(next, 0.0);
    system_.in_place = next == system_.rows.size();
    for (std::uint32_t r = 0; r < next && system_.in_place; ++r)
      system_.in_place = system_.place_of_row[r] == r;
  }

  struct Block {
    double* values;
    std::uint32_t first_row, first_column, width;

    double& at(std::uint32_t row, std::uint32_t column) const {
      return values[std::size_t{width} * (row - first_row) + column - first_column];
    }
  };

  void add(const JointElimination::Entry& entry) {
    SparseLdl& matrix = system_.matrix;
    const auto& [row, column, index, group] = entry;
    const Block block{matrix.block(index, group), matrix.first_row(plan_.group_of[row]),
                      matrix.first_row(group), matrix.width(group)};
    if (is_hub(row) && is_hub(column))
      add_hub(row, block);
    else if (is_hub(column))
      add_arm(row, column, [&](std::uint32_t r, std::uint32_t of_hub) -> double& {
        return block.at(r, of_hub);
      });
    else if (is_hub(row))
      add_arm(column, row, [&](std::uint32_t r, std::uint32_t of_hub) -> double& {
        return block.at(of_hub, r);
      });
    else
      add_joints(row, column, block);
  }

  template <class Visit>
  void for_each_row(std::uint32_t joint, const Visit& visit) const {
    for (std::uint32_t r = system_.first_row[joint]; r < system_.first_row[joint + 1]; ++r)
      if (system_.place_of_row[r] != kNoPlace) visit(r, system_.place_of_row[r]);
  }

  void add_joints(std::uint32_t later, std::uint32_t earlier, const Block& block) {
    const JointEnds &of_later = plan_.coupling[later], &of_earlier = plan_.coupling[earlier];
    for_each_row(later, [&](std::uint32_t r, std::uint32_t row) {
      for_each_row(earlier, [&](std::uint32_t c, std::uint32_t column) {
        if (column > row) return;
        double& entry = block.at(row, column);
        entry = coupling(system_.rows[r], of_later, system_.rows[c], of_earlier, system_.twists[c],
                         bodies_);
        if (r == c) add_scale(r, row, later, entry);
      });
    });
  }

  // A row's own response, of which hubs do not give their part here, and its softness.
  void add_scale(std::uint32_t r, std::uint32_t place, std::uint32_t joint, double& entry) {
    const JointRow& row = system_.rows[r];
    const JointEnds& ends = system_.ends[joint];
    double whole = entry;
    if (ends != plan_.coupling[joint])
      whole = coupling(row, ends, row, ends, system_.twists[r], bodies_);
    // What has bounds gives way at them: a motor that drives against its stop is to depend on it.
    const double share = is_bounded(row) ? 0.0 : regularisation_;
    const double soft = row.softness_1_kg + share * whole;
    entry += soft;
    scales_[place] = whole + soft;
  }

  // The velocity of a hub gives the rows of its joints theirs.
  template <class At>
  void add_arm(std::uint32_t joint, std::uint32_t node, const At& at) {
    const std::uint32_t body = plan_.hubs[hub_of(node)], first = first_of_hub_[hub_of(node)];
    const auto [a, b] = system_.ends[joint];
    for_each_row(joint, [&](std::uint32_t r, std::uint32_t place) {
      const JointRow& row = system_.rows[r];
      for (std::uint32_t i = 0; i < 3; ++i) {
        double &linear = at(place, first + i), &angular = at(place, first + i + 3);
        if (a == body) linear -= row.linear[i], angular -= row.angular_a[i];
        if (b == body) linear += row.linear[i], angular += row.angular_b[i];
      }
    });
  }

  // Its momentum is what its joints give it.
  void add_hub(std::uint32_t node, const Block& block) {
    const SolverBody& body = bodies_[plan_.hubs[hub_of(node)]];
    const std::uint32_t first = first_of_hub_[hub_of(node)];
    const Mat3 inertia = inverse_of_symmetric(body.inverse_inertia);
    for (std::uint32_t i = 0; i < 3; ++i) {
      block.at(first + i, first + i) = -1.0 / body.inverse_mass;
      for (std::uint32_t k = 0; k <= i; ++k)
        block.at(first + i + 3, first + k + 3) = -inertia(i, k);
    }
    for (std::uint32_t i = first; i < first + kHubRows; ++i) scales_[i] = block.at(i, i);
  }

  std::span<const SolverBody> bodies_;
  double regularisation_;
  JointSystem& system_;
  const JointElimination& plan_;
  ShortList<std::uint32_t, 4> first_of_hub_;
  ShortList<double, 32> scales_;
};

}  // namespace

ShortList<double, 32> assemble_joint_rows(std::span<const SolverBody> bodies, double regularisation,
                                          JointSystem& system) {
  find_twists(bodies, system);
  return Assembly(bodies, regularisation, system).scales();
}

}  // namespace soda::physics
