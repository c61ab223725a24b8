#include "analysis/search/fuzz_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "analysis/process/isolated_process.hpp"
#include "analysis/text/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

constexpr const char* kRefused = "the scenario is refused: ";

double rounded(double value, int digits) {
  if (value == 0.0) return value;
  const double unit = std::pow(10.0, digits - 1 - std::floor(std::log10(std::fabs(value))));
  return std::round(value * unit) / unit;
}

Vec3 rounded(const Vec3& v, int digits) {
  return {rounded(v.x(), digits), rounded(v.y(), digits), rounded(v.z(), digits)};
}

void round_off(FuzzStatic& thing, int digits) {
  thing.shape.size_m = rounded(thing.shape.size_m, digits);
  for (Vec3& point : thing.shape.points_m) point = rounded(point, digits);
  thing.friction = rounded(thing.friction, digits);
  thing.restitution = rounded(thing.restitution, digits);
  thing.position_m = rounded(thing.position_m, digits);
}

void round_off(FuzzBody& body, int digits) {
  round_off(static_cast<FuzzStatic&>(body), digits);
  body.mass_kg = rounded(body.mass_kg, digits);
  body.velocity_m_s = rounded(body.velocity_m_s, digits);
  body.spin_rad_s = rounded(body.spin_rad_s, digits);
}

// Changes a scene so that there is less in it. False if there is nothing to change.
using Edit = std::function<bool(FuzzScene&)>;

template <class T>
bool assign(T& place, const T& value) {
  if (place == value) return false;
  place = value;
  return true;
}

bool straighten(Quat& orientation) {
  if (orientation.w() == 1.0) return false;
  orientation = Quat::Identity();
  return true;
}

bool plainer(FuzzShape& shape, FuzzShapeKind kind) {
  if (shape.kind <= kind || shape.kind >= FuzzShapeKind::kHalfSpace) return false;
  shape.kind = kind;
  return true;
}

void drop_body(FuzzScene& scene, std::size_t i) {
  const std::uint32_t id = scene.bodies[i].id;
  std::erase_if(scene.joints,
                [&](const FuzzJoint& j) { return j.body == id || j.other_body == id; });
  scene.bodies.erase(scene.bodies.begin() + static_cast<std::ptrdiff_t>(i));
}

// What to try on every body or static.
std::vector<std::function<bool(FuzzStatic&)>> surface_edits() {
  return {[](FuzzStatic& t) { return assign(t.friction, 0.0); },
          [](FuzzStatic& t) { return assign(t.restitution, 0.0); },
          [](FuzzStatic& t) { return straighten(t.orientation); },
          [](FuzzStatic& t) { return plainer(t.shape, FuzzShapeKind::kSphere); },
          [](FuzzStatic& t) { return plainer(t.shape, FuzzShapeKind::kBox); }};
}

class Shrinking {
 public:
  Shrinking(ShrunkScene& smallest, const ShrinkLimits& limits, const TryScene& try_scene)
      : smallest_(smallest), limits_(limits), try_(try_scene) {}

  void run() {
    bool smaller = true;
    while (smaller) {
      smaller = shrink_steps();
      smaller = drop_all() || smaller;
      smaller = simplify() || smaller;
    }
    for (const int digits : {1, 2, 3, 4}) round_all(digits);
  }

 private:
  bool still_fails(FuzzScene scene) {
    if (limits_.reached(smallest_.tried)) return false;
    ++smallest_.tried;
    FuzzOutcome outcome = try_(scene);
    if (!outcome.failed || outcome.refused) return false;
    smallest_.scene = std::move(scene);
    smallest_.what = std::move(outcome.what);
    return true;
  }

  bool attempt(const Edit& edit) {
    FuzzScene scene = smallest_.scene;
    return edit(scene) && still_fails(std::move(scene));
  }

  bool shrink_steps() {
    bool smaller = false;
    for (bool found = true; found;) {
      const std::int64_t now = smallest_.scene.steps;
      found = false;
      for (const std::int64_t next : {std::int64_t{1}, now / 2, now - 1})
        found = found || (next >= 1 && next < now &&
                          attempt([&](FuzzScene& s) { return assign(s.steps, next); }));
      smaller = smaller || found;
    }
    return smaller;
  }

  template <class T, class Drop>
  bool drop_each(const std::vector<T> FuzzScene::*list, Drop drop) {
    bool smaller = false;
    for (std::size_t i = (smallest_.scene.*list).size(); i-- > 0;)
      smaller = attempt([&](FuzzScene& scene) {
                  drop(scene, i);
                  return true;
                }) ||
                smaller;
    return smaller;
  }

  bool drop_all() {
    const auto at = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
    bool smaller = drop_each(&FuzzScene::joints, [&](FuzzScene& s, std::size_t i) {
      s.joints.erase(s.joints.begin() + at(i));
    });
    smaller = drop_each(&FuzzScene::bodies, drop_body) || smaller;
    return drop_each(
               &FuzzScene::statics,
               [&](FuzzScene& s, std::size_t i) { s.statics.erase(s.statics.begin() + at(i)); }) ||
           smaller;
  }

  bool simplify() {
    bool smaller = attempt([](FuzzScene& s) { return assign(s.gravity_m_s2, 0.0); });
    smaller = attempt([](FuzzScene& s) { return assign(s.time_step_s, 1.0 / 60.0); }) || smaller;
    for (std::size_t i = 0; i < smallest_.scene.bodies.size(); ++i) {
      const auto on = [&](auto edit) {
        smaller = attempt([&](FuzzScene& s) { return edit(s.bodies[i]); }) || smaller;
      };
      on([](FuzzBody& b) { return assign(b.spin_rad_s, Vec3(Vec3::Zero())); });
      on([](FuzzBody& b) { return assign(b.velocity_m_s, Vec3(Vec3::Zero())); });
      on([](FuzzBody& b) { return assign(b.mass_kg, 1.0); });
      for (const auto& edit : surface_edits()) on(edit);
    }
    for (std::size_t i = 0; i < smallest_.scene.statics.size(); ++i)
      for (const auto& edit : surface_edits())
        smaller = attempt([&](FuzzScene& s) { return edit(s.statics[i]); }) || smaller;
    return smaller;
  }

  void round_all(int digits) {
    for (std::size_t i = 0; i < smallest_.scene.bodies.size(); ++i)
      attempt([&](FuzzScene& s) {
        round_off(s.bodies[i], digits);
        return true;
      });
    for (std::size_t i = 0; i < smallest_.scene.statics.size(); ++i)
      attempt([&](FuzzScene& s) {
        round_off(s.statics[i], digits);
        return true;
      });
  }

  ShrunkScene& smallest_;
  const ShrinkLimits& limits_;
  const TryScene& try_;
};

}  // namespace

FuzzOutcome try_scene(const std::string& text, const std::string& file) {
  const ChildOutcome child = run_in_child([&](ChildResults& results) {
    try {
      const scenarios::Scenario scenario = scenarios::read_scenario_text(text, file);
      results.write(run_fuzz_trial(scenario));
    } catch (const scenarios::InputError& error) {
      throw CheckFailed(kRefused + std::string(error.what()));
    }
  });
  FuzzOutcome outcome{child.failed, child.what.starts_with(kRefused), child.what, {}};
  if (!child.failed && child.bytes.size() == sizeof outcome.sums)
    std::memcpy(&outcome.sums, child.bytes.data(), sizeof outcome.sums);
  return outcome;
}

FuzzOutcome try_drawn(const FuzzScene& scene) { return try_scene(scenario_text(scene, "")); }

ShrunkScene shrink(const FuzzScene& failing, std::string what, const ShrinkLimits& limits,
                   const TryScene& attempt) {
  ShrunkScene smallest{failing, std::move(what), 0};
  Shrinking(smallest, limits, attempt).run();
  return smallest;
}

}  // namespace soda::analysis
