// A ball comes at 1 m/s to a row of others, as far as mathematics knows what comes of it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/families/family_scene.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

constexpr double kRadius_m = 0.1, kWayToRow_m = 0.0075, kGap_m = 0.0015, kWideGap_m = 0.005;

struct BallRow {
  double gap_m = 0.0;
  double restitution = 1.0;
  double mass_ratio = 1.0;  // of the last ball to the first
  bool on_floor = false;

  bool is_spaced() const { return gap_m > 0.0; }
};

// Each hit by itself, in the order of their times; the first pair first where these are equal.
std::vector<double> after_hits(const BallRow& row, const std::vector<double>& mass_kg,
                               double time_s) {
  const std::size_t n = mass_kg.size();
  std::vector<double> gaps(n, row.gap_m), v(n, 0.0);
  gaps[0] = kWayToRow_m;
  v[0] = 1.0;
  for (double now = 0.0;;) {
    double next = std::numeric_limits<double>::infinity();
    std::size_t hit = n;
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const double closing = v[i] - v[i + 1];
      if (!(closing > 1e-14) || std::max(gaps[i], 0.0) / closing >= next) continue;
      next = std::max(gaps[i], 0.0) / closing;
      hit = i;
    }
    if (hit == n || now + next > time_s) return v;
    for (std::size_t i = 0; i + 1 < n; ++i) gaps[i] -= next * (v[i] - v[i + 1]);
    now += next;
    gaps[hit] = 0.0;
    const double mass = 1.0 / (1.0 / mass_kg[hit] + 1.0 / mass_kg[hit + 1]);
    const double impulse = (1.0 + row.restitution) * mass * (v[hit] - v[hit + 1]);
    v[hit] -= impulse / mass_kg[hit];
    v[hit + 1] += impulse / mass_kg[hit + 1];
  }
}

// Without restitution all that was hit goes on together.
std::vector<double> after_sticking(const BallRow& row, const std::vector<double>& mass_kg,
                                   double time_s) {
  std::vector<double> v(mass_kg.size(), 0.0);
  double together_kg = mass_kg[0], now = 0.0;
  std::size_t hit = 1;
  for (; hit < v.size(); ++hit) {
    now += (hit == 1 ? kWayToRow_m : row.gap_m) * together_kg / mass_kg[0];
    if (now > time_s) break;
    together_kg += mass_kg[hit];
  }
  std::fill_n(v.begin(), hit, mass_kg[0] / together_kg);
  return v;
}

// Largest speed at which two neighbours in touch are left closing.
double left_closing_m_s(const FamilyView& view) {
  double closing = 0.0;
  for (std::size_t i = 0; i + 1 < view.states.size(); ++i) {
    const physics::BodyState &a = view.states[i], &b = view.states[i + 1];
    if (b.position_m.x() - a.position_m.x() > 2.0 * kRadius_m * (1.0 + 1e-6)) continue;
    closing = std::max(closing, a.linear_velocity_m_s.x() - b.linear_velocity_m_s.x());
  }
  return closing;
}

double off_law_m_s(const FamilyView& view, const std::vector<double>& law) {
  double off = 0.0;
  for (std::size_t i = 0; i < law.size(); ++i)
    off = std::max(off, (view.states[i].linear_velocity_m_s - Vec3(law[i], 0, 0)).norm());
  return off;
}

// The momentum is the first ball's; energy is kept by elastic balls, and never gained.
double off_balance(const FamilyView& view, double mass_kg, bool is_elastic) {
  const physics::Mechanics now = physics::measure(view.scene, view.ids, view.states);
  const double momentum = (now.linear_momentum_newton_s - Vec3(mass_kg, 0, 0)).norm() / mass_kg;
  const double gain = now.kinetic_energy_joule / (0.5 * mass_kg) - 1.0;
  return std::max(momentum, is_elastic ? std::abs(gain) : gain);
}

FamilyScene ball_row(const BallRow& row, int n) {
  const physics::Material material{.friction = 0.0, .restitution = row.restitution};
  FamilyScene scene = scene_under_gravity();
  if (row.on_floor)
    add_floor(scene, material);
  else
    scene.scene.gravity_m_s2 = Vec3::Zero();
  // Touching elastic balls are done with in two steps; spaced ones of restitution .5 hit each other
  // without end later.
  scene.steps = 20;
  if (row.restitution == 1.0 && !row.is_spaced()) scene.steps = 2;
  if (row.restitution == 0.5 && row.is_spaced()) scene.steps = 5;
  if (row.is_spaced()) scene.scene.solver.restitution_threshold_m_s = 1e-9;
  const std::uint32_t ball = add_shape(scene, physics::Sphere{kRadius_m});
  std::vector<double> mass_kg;
  for (int i = 0; i < n; ++i) {
    mass_kg.push_back(graded_mass_kg(i, n, row.mass_ratio));
    const double x =
        i == 0 ? -2.0 * kRadius_m - kWayToRow_m : (2.0 * kRadius_m + row.gap_m) * (i - 1);
    add_body(scene, ball, Vec3(x, 0, kRadius_m), mass_kg.back(), material);
  }
  scene.states[0].linear_velocity_m_s = Vec3(1, 0, 0);
  const double time_s = static_cast<double>(scene.steps) * kFamilyStep_s;
  // What touching balls of restitution .5 or of several masses do depends on the order of hits.
  const bool has_law = row.is_spaced() || row.restitution == 0.0 ||
                       (row.restitution == 1.0 && row.mass_ratio == 1.0);
  std::vector<double> law;
  if (has_law)
    law = row.restitution == 0.0 ? after_sticking(row, mass_kg, time_s)
                                 : after_hits(row, mass_kg, time_s);
  scene.judge = [law, mass = mass_kg[0], elastic = row.restitution == 1.0](const FamilyView& view) {
    if (!view.last) return std::vector<double>{0.0, 0.0};
    return std::vector<double>{law.empty() ? left_closing_m_s(view) : off_law_m_s(view, law),
                               off_balance(view, mass, elastic)};
  };
  return scene;
}

std::vector<FamilySeries> row_series(bool on_floor) {
  std::vector<FamilySeries> series;
  const auto add = [&](const std::string& name, const BallRow& row) {
    series.push_back({name, [row](int n) { return ball_row(row, n); }});
  };
  for (const bool spaced : {false, true}) {
    const std::string name = spaced ? "spaced " : "touching ";
    const double gap_m = spaced ? kGap_m : 0.0;
    add(name + "e 1", {gap_m, 1.0, 1.0, on_floor});
    add(name + "e .5", {gap_m, 0.5, 1.0, on_floor});
    add(name + "e 0", {gap_m, 0.0, 1.0, on_floor});
    add(name + "e 1, 1:100", {gap_m, 1.0, 0.01, on_floor});
    add(name + "e 0, 1:100", {gap_m, 0.0, 0.01, on_floor});
  }
  add("apart e 1", {kWideGap_m, 1.0, 1.0, on_floor});
  add("apart e 0", {kWideGap_m, 0.0, 1.0, on_floor});
  return series;
}

Family row_family(bool on_floor) {
  Family family;
  family.name = on_floor ? "balls-floor" : "balls-flight";
  family.scene = std::string("a ball at 1 m/s comes to a row of n - 1, ") +
                 (on_floor ? "on a smooth floor" : "in flight") +
                 ", touching, spaced by 1.5 mm or 5 mm apart; 1:100: the first is 100 times as "
                 "heavy as the last";
  family.measures = {
      {"velocity off, m/s",
       "against the law of the hits; where their order decides (touching, e .5, or e 1 of several "
       "masses): at which neighbours in touch still close",
       1e-6, 1e-9, "solvers end at 1e-9 of the largest velocity"},
      {"momentum and energy off, relative", "energy: gained, or lost by elastic balls", 1e-8, 1e-11,
       "sums of rounding errors over n hits"}};
  family.sizes = {2,  3,  4,  5,  6,  7,  8,  9,  10,  12,  16,  20,
                  25, 32, 40, 50, 63, 64, 65, 80, 100, 128, 160, 200};
  family.full_sizes = {255, 256, 257, 320, 400};
  family.series = row_series(on_floor);
  return family;
}

}  // namespace

std::vector<Family> ball_row_families() { return {row_family(false), row_family(true)}; }

}  // namespace soda::analysis
