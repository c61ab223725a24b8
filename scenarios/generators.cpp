#include "scenarios/generators.hpp"

#include "scenarios/orientation.hpp"

namespace soda::scenarios {
namespace {

// What all bodies of a regular generator start with.
physics::BodyState first_state(const RegularBase& spec, FaultList& faults) {
  physics::BodyState state;
  state.position_m = spec.position_m;
  state.orientation = orientation_of(spec.orientation, faults);
  state.linear_velocity_m_s = spec.velocity_m_s;
  state.angular_velocity_rad_s = spec.angular_velocity_rad_s;
  return state;
}

physics::BodyState moved(const physics::BodyState& state, double x_m, double y_m, double z_m) {
  physics::BodyState result = state;
  result.position_m =
      Vec3(state.position_m.x() + x_m, state.position_m.y() + y_m, state.position_m.z() + z_m);
  return result;
}

struct Expand {
  const PlacedShape& shape;
  std::span<const BoundingSphere> taken;
  std::optional<std::uint64_t> seed;
  FaultList& faults;
  std::vector<physics::BodyState> states{};

  void operator()(const GridSpec& s) {
    const physics::BodyState first = first_state(s, faults);
    for (std::int64_t z = 0; z < s.count[2]; ++z) {
      for (std::int64_t y = 0; y < s.count[1]; ++y) {
        for (std::int64_t x = 0; x < s.count[0]; ++x) {
          states.push_back(moved(first, static_cast<double>(x) * s.spacing_m.x(),
                                 static_cast<double>(y) * s.spacing_m.y(),
                                 static_cast<double>(z) * s.spacing_m.z()));
        }
      }
    }
  }

  void operator()(const StackSpec& s) {
    const physics::BodyState first = first_state(s, faults);
    const double pitch = shape.size_m.z() + s.gap_m;
    for (std::int64_t i = 0; i < s.count; ++i) {
      states.push_back(moved(first, 0.0, 0.0, static_cast<double>(i) * pitch));
    }
  }

  void operator()(const PyramidSpec& s) {
    const physics::BodyState first = first_state(s, faults);
    const double pitch = shape.size_m.x() + s.side_gap_m, rise = shape.size_m.z() + s.gap_m;
    for (std::int64_t row = 0; row < s.rows; ++row) {
      for (std::int64_t i = 0; i < s.rows - row; ++i) {
        const double across = (static_cast<double>(i) + 0.5 * static_cast<double>(row)) * pitch;
        states.push_back(moved(first, across, 0.0, static_cast<double>(row) * rise));
      }
    }
  }

  void operator()(const ChainSpec& s) {
    const physics::BodyState first = first_state(s, faults);
    const int axis = static_cast<int>(s.axis);
    for (std::int64_t i = 0; i < s.count; ++i) {
      Vec3 shift = Vec3::Zero();
      shift[axis] = static_cast<double>(i) * (shape.size_m[axis] + s.gap_m);
      states.push_back(moved(first, shift.x(), shift.y(), shift.z()));
    }
  }

  void operator()(const RandomSpec& s) { scatter(s, 0.0, 0.0); }
  void operator()(const GasSpec& s) { scatter(s, s.max_speed_m_s, s.max_spin_rad_s); }

  void scatter(const ScatterBase& s, double max_speed_m_s, double max_spin_rad_s) {
    const std::uint64_t own_seed = seed.value_or(static_cast<std::uint64_t>(s.seed));
    RandomStream stream = make_stream(own_seed, static_cast<std::uint64_t>(s.first_id));
    for (int i = 0; i < 3; ++i) {
      if (s.region_min_m[i] <= s.region_max_m[i]) continue;
      add_fault(faults, *find_member(*s.json, "region_min_m"),
                {"a corner beyond region_max_m", "a corner not above region_max_m", ""});
      return;
    }
    const auto wanted = static_cast<std::size_t>(s.count);
    const std::vector<Vec3> centers =
        place_spheres(wanted, shape.bounding_radius_m, s.min_gap_m,
                      {s.region_min_m, s.region_max_m}, taken, stream);
    if (centers.size() < wanted) {
      add_fault(faults, *find_member(*s.json, "count"),
                {std::to_string(wanted) + " bodies in a region that is full after " +
                     std::to_string(centers.size()),
                 "as many as fit without overlap of bounding spheres",
                 "enlarge the region or lower the count"});
    }
    states.reserve(centers.size());
    for (const Vec3& center : centers) {
      physics::BodyState& state = states.emplace_back();
      state.position_m = center;
      if (s.random_orientation) state.orientation = uniform_rotation(stream);
      if (max_speed_m_s > 0.0) state.linear_velocity_m_s = max_speed_m_s * uniform_in_ball(stream);
      if (max_spin_rad_s > 0.0) {
        state.angular_velocity_rad_s = max_spin_rad_s * uniform_in_ball(stream);
      }
    }
  }
};

struct Count {
  std::int64_t operator()(const GridSpec& s) const {
    return s.count[0] * s.count[1] * s.count[2];  // each at most 1e6
  }
  std::int64_t operator()(const PyramidSpec& s) const { return s.rows * (s.rows + 1) / 2; }
  std::int64_t operator()(const auto& s) const { return s.count; }
};

}  // namespace

std::int64_t count_of(const GeneratorSpec& spec) { return std::visit(Count{}, spec); }

std::vector<physics::BodyState> generate(const GeneratorSpec& spec, const PlacedShape& shape,
                                         std::span<const BoundingSphere> taken,
                                         std::optional<std::uint64_t> seed, FaultList& faults) {
  Expand expand{shape, taken, seed, faults};
  std::visit(expand, spec);
  return std::move(expand.states);
}

}  // namespace soda::scenarios
