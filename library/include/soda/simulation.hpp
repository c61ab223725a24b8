// A scene that is simulated step by step, in the program that asks for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "soda/inputs.hpp"
#include "soda/scene.hpp"

namespace soda {

// A point at which two solids press each other. Forces are means over the last step (of an impact,
// over the step in which it was).
struct Contact {
  Solid a = {}, b = {};        // a is a body
  bool touching = true;        // false: they have come apart since; then there is no place
  Vec3 position_m = {};        // midway between the surfaces
  Vec3 normal = {};            // unit, from a to b
  double separation_m = 0.0;   // < 0: they overlap
  double normal_newton = 0.0;  // along the normal, on b
  Vec3 friction_newton = {};   // on b
  double normal_impulse_newton_s = 0.0;
};

struct RayHit {
  Solid solid = {};
  double distance_m = 0.0;
  Vec3 point_m = {};
  Vec3 normal = {};  // unit, outward
};

struct Neighbour {
  Solid solid = {};
  double distance_m = 0.0;  // < 0: overlap
  Vec3 normal = {};         // unit, from the shape to the neighbour
};

// What all steps have done, counted.
struct Counters {
  std::uint64_t steps = 0;
  std::uint64_t candidate_pairs = 0, contact_points = 0;
  std::uint64_t islands_solved = 0, islands_at_rest = 0;
  std::uint64_t solver_iterations = 0, impacts = 0, joints_broken = 0;
};

// Of the last step.
struct StepReport {
  double deepest_penetration_m = 0.0, constraint_residual_m_s = 0.0;
  std::uint64_t islands = 0, contact_points = 0;
};

// All that the next steps depend on, as bytes: states, contact impulses, broken joints, who is
// present, changed materials and motors, the step, and inputs whose step has not come. Of the
// same scene on any machine; it may be stored and sent.
struct Snapshot {
  std::vector<std::byte> bytes = {};
};

// Has the states of `soda run` of the same scene and inputs, bit for bit. One thread at a time uses
// it; simulations of one scene share what does not change.
class SODA_API Simulation {
 public:
  explicit Simulation(const Scene& scene);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  const Scene& scene() const;

  // Advances by so many steps (>= 0). Throws NumericalError.
  void step(std::int64_t steps = 1);
  std::int64_t steps() const;  // so many have been made
  double time_s() const;
  // Of all states, as `soda run` prints it.
  std::uint64_t digest() const;
  // Called at the end of each step, when it has become final. What it throws leaves step().
  void on_step(std::function<void(const Simulation&)> callback);
  StepReport report() const;
  Counters counters() const;

  // Bodies that are there, ascending, and their states in that order.
  std::span<const std::uint32_t> body_ids() const;
  bool has(std::uint32_t body) const;
  BodyState state(std::uint32_t body) const;  // throws UsageError
  std::vector<BodyState> states() const;
  void states(std::vector<BodyState>& out) const;  // overwrites it
  // Puts a body somewhere else: a change that no input tells of, so the trajectory is another one.
  // A new place or orientation takes its contact impulses away. Throws UsageError.
  void set_state(std::uint32_t body, const BodyState& state);
  std::vector<std::uint32_t> broken_joints() const;  // ids, ascending

  // An input for this step or a later one. Ids: no two of one step. Throws UsageError; SceneError,
  // with the messages of scenario files, if it says what it may not.
  void apply(const Input& input);
  // The same as a line of JSON, as in `soda run --inputs`; without a time it acts at once.
  void apply(std::string_view line);

  // Of all contacts that bear anything, by (a, b) and point.
  std::vector<Contact> contacts() const;
  // The first surface that a ray enters: solids in which it begins are not entered, meshes through
  // the front of their triangles. `direction` of any length but 0.
  std::optional<RayHit> cast_ray(const Vec3& from_m, const Vec3& direction, double length_m) const;
  // Bodies and statics no farther than `within_m` from a convex shape that is put there.
  std::vector<Neighbour> neighbours(const ConvexShape& shape, const Vec3& position_m,
                                    const Quat& orientation, double within_m = 0.0) const;

  Snapshot snapshot() const;
  void snapshot(Snapshot& into) const;  // takes no new memory where the old is large enough
  // Goes on from there, bit for bit. Throws UsageError if it is of another scene, or damaged; then
  // nothing has changed.
  void restore(const Snapshot& snapshot);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace soda
