#include "models/load_balancing/load_sample.hpp"

#include <algorithm>

#include "models/cost/work_cost.hpp"
#include "models/messages/codec.hpp"
#include "physics/events/sleeping.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/solvers/island_blocks.hpp"
#include "physics/step/step.hpp"

namespace soda::models {
namespace {

using physics::BodyId;

// Straight on: what falls or is pushed will not get far in the steps that a buffer holds, and what
// is carried or driven keeps its velocity.
std::uint32_t predicted_cell(const Rules& rules, const physics::BodyState& state,
                             std::int64_t ahead) {
  const Grid& grid = rules.map->grid();
  const double time_s = static_cast<double>(ahead) * rules.scene->dt_s;
  return static_cast<std::uint32_t>(
      grid.index_of_cell(grid.cell_of(state.position_m + time_s * state.linear_velocity_m_s)));
}

std::int64_t cost_of_tests(const physics::SceneDescription& scene, const physics::Shape& a,
                           const physics::Shape& b) {
  const physics::KernelCounts tests = physics::most_tests(scene, a, b);
  std::int64_t cost = 0;
  for (std::size_t kernel = 0; kernel < tests.size(); ++kernel)
    if (tests[kernel] > 0)
      cost += tests[kernel] * test_cost_ns(static_cast<physics::ShapeKernel>(kernel));
  return cost;
}

// The tests of each body's pairs, half a pair for each of two own bodies. What two bodies without
// velocity have in contact is known from the step before, as a rule.
void add_pair_costs(const BufferEntry& entry, const physics::Geometry& geometry,
                    std::vector<BodyLoad>& bodies) {
  const physics::SceneDescription& scene = *entry.rules.scene;
  physics::StageCounters uncounted;
  physics::StepScratch scratch;
  physics::compute_boxes(scene, geometry, entry.ids, entry.states, scratch.boxes, uncounted);
  const auto stands = [&](std::uint32_t body) {
    return physics::has_no_velocity(entry.states[body]);
  };
  const auto shape = [&](std::uint32_t body) -> const physics::Shape& {
    return scene.shapes[scene.bodies[physics::index_of(entry.ids[body])].shape];
  };
  physics::find_pairs(scene.broadphase, scratch.boxes, scratch.pairs, uncounted);
  for (const physics::IndexPair pair : scratch.pairs) {
    if (stands(pair.first) && stands(pair.second)) continue;
    const std::int64_t cost = cost_of_tests(scene, shape(pair.first), shape(pair.second));
    bodies[pair.first].cost_ns += cost / 2;
    bodies[pair.second].cost_ns += cost / 2;
  }
  physics::find_static_pairs(geometry, scratch.boxes, scratch.static_pairs, uncounted);
  for (const physics::IndexPair pair : scratch.static_pairs) {
    if (stands(pair.first)) continue;
    bodies[pair.first].cost_ns +=
        cost_of_tests(scene, shape(pair.first), scene.shapes[scene.statics[pair.second].shape]);
  }
}

void add_islands(const BufferEntry& entry, bool splits, std::vector<IslandLoad>& islands) {
  for (const physics::IslandReport& island : entry.islands) {
    if (island.rests) continue;
    const bool is_large = island.contact_points >= physics::kLargeIslandPoints && !island.direct;
    islands.push_back(
        {island.label,
         solve_cost_ns(island.contact_points, island.iterations, island.multiplications),
         splits && is_large});
  }
}

}  // namespace

LoadSample sample_load(WorldId world, const BufferEntry& entry, const physics::Geometry& geometry,
                       const LoadSampling& sampling) {
  LoadSample sample;
  sample.world = world;
  sample.step = entry.step;
  for (std::size_t i = 0; i < entry.ids.size(); ++i) {
    const physics::BodyState& state = entry.states[i];
    const std::size_t solved = physics::has_no_velocity(state) ? 0 : state.impulses.size();
    const std::int64_t points = static_cast<std::int64_t>(solved) * point_cost_ns();
    sample.bodies.push_back({entry.ids[i], predicted_cell(entry.rules, state, sampling.from),
                             predicted_cell(entry.rules, state, sampling.until),
                             body_cost_ns() + points});
    BodyId last = entry.ids[i];
    for (const physics::ContactImpulse& impulse : state.impulses) {
      if (physics::is_static(impulse.other) || impulse.other == last) continue;
      last = impulse.other;
      sample.links.push_back({entry.ids[i], last});
    }
  }
  add_pair_costs(entry, geometry, sample.bodies);
  add_islands(entry, sampling.splits_islands, sample.islands);
  return sample;
}

kernel::Bytes encode_load(const LoadSample& sample) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  writer.world(sample.world);
  for (const std::int64_t number : {sample.step, sample.spent_ns, sample.entries})
    writer.number(number);
  writer.number(static_cast<std::uint32_t>(sample.bodies.size()));
  for (const BodyLoad& body : sample.bodies) {
    writer.id(body.id);
    writer.number(body.cell);
    writer.number(body.later);
    writer.number(body.cost_ns);
  }
  writer.number(static_cast<std::uint32_t>(sample.links.size()));
  for (const BodyLink& link : sample.links) {
    writer.id(link.a);
    writer.id(link.b);
  }
  for (const IslandLoad& island : sample.islands) {
    writer.id(island.label);
    writer.number(island.solve_ns);
    writer.number(static_cast<std::uint32_t>(island.is_shared_out));
  }
  return bytes;
}

LoadSample decode_load(std::span<const std::byte> bytes) {
  Reader reader(bytes);
  LoadSample sample;
  sample.world = reader.world();
  sample.step = reader.number<std::int64_t>();
  sample.spent_ns = reader.number<std::int64_t>();
  sample.entries = reader.number<std::int64_t>();
  sample.bodies.resize(reader.number<std::uint32_t>());
  for (BodyLoad& body : sample.bodies) {
    body.id = reader.id();
    body.cell = reader.number<std::uint32_t>();
    body.later = reader.number<std::uint32_t>();
    body.cost_ns = reader.number<std::int64_t>();
  }
  sample.links.resize(reader.number<std::uint32_t>());
  for (BodyLink& link : sample.links) {
    link.a = reader.id();
    link.b = reader.id();
  }
  while (!reader.at_end()) {
    IslandLoad island;
    island.label = reader.id();
    island.solve_ns = reader.number<std::int64_t>();
    island.is_shared_out = reader.number<std::uint32_t>() != 0;
    sample.islands.push_back(island);
  }
  return sample;
}

}  // namespace soda::models
