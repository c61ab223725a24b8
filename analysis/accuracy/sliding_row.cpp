#include "analysis/accuracy/sliding_row.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace soda::analysis {
namespace {

using physics::Vec3;

constexpr double kNever = std::numeric_limits<double>::infinity();

// Of one box from a time on.
struct Slide {
  double since_s = 0.0, x_m = 0.0, v_m_s = 0.0, a_m_s2 = 0.0;

  double stop_s() const { return a_m_s2 != 0.0 ? since_s - v_m_s / a_m_s2 : kNever; }
  Slide at(double time_s) const {
    const double t = time_s - since_s;
    return {time_s, x_m + t * (v_m_s + 0.5 * a_m_s2 * t), v_m_s + a_m_s2 * t, a_m_s2};
  }
  void brake(double friction_m_s2) {
    a_m_s2 = v_m_s > 0.0 ? -friction_m_s2 : v_m_s < 0.0 ? friction_m_s2 : 0.0;
  }
};

// How long two boxes, the second one ahead by `gap_m`, take to meet.
double meeting_s(const Slide& behind, const Slide& ahead, double gap_m) {
  const double closing = behind.v_m_s - ahead.v_m_s, faster = behind.a_m_s2 - ahead.a_m_s2;
  const double squared = closing * closing + 2.0 * faster * gap_m;
  if (squared < 0.0 || (closing <= 0.0 && faster <= 0.0)) return kNever;
  const double meeting = closing + std::sqrt(squared);
  return meeting > 0.0 ? 2.0 * gap_m / meeting : kNever;
}

struct Row {
  std::vector<Slide> slides;  // as of one time, in the order along x
  std::vector<double> half_m, mass_kg;

  double gap_m(std::size_t i) const {
    return slides[i + 1].x_m - slides[i].x_m - half_m[i] - half_m[i + 1];
  }
};

void hit(double restitution, std::size_t i, Row& row) {
  double &a = row.slides[i].v_m_s, &b = row.slides[i + 1].v_m_s;
  const double mass = 1.0 / (1.0 / row.mass_kg[i] + 1.0 / row.mass_kg[i + 1]);
  const double impulse = (1.0 + restitution) * mass * (a - b);
  a -= impulse / row.mass_kg[i];
  b += impulse / row.mass_kg[i + 1];
}

// The slides of each box, up to where nothing more happens. Boxes that are left together by a hit
// that does not bounce brake alike, and do not meet again.
std::vector<std::vector<Slide>> all_slides(double friction_m_s2, double restitution, Row row) {
  constexpr int kMostEvents = 10'000;
  const std::size_t count = row.slides.size();
  std::vector<std::vector<Slide>> slides(count);
  double now = 0.0;
  for (int event = 0; event < kMostEvents; ++event) {
    for (std::size_t i = 0; i < count; ++i) {
      row.slides[i].brake(friction_m_s2);
      slides[i].push_back(row.slides[i]);
    }
    double next = kNever;
    std::size_t met = count, stopped = count;
    for (std::size_t i = 0; i < count; ++i) {
      if (row.slides[i].stop_s() >= next) continue;
      next = row.slides[i].stop_s();
      stopped = i;
    }
    for (std::size_t i = 0; i + 1 < count; ++i) {
      const double gap = std::max(row.gap_m(i), 0.0);
      const double time = now + meeting_s(row.slides[i], row.slides[i + 1], gap);
      if (time >= next) continue;
      next = time;
      met = i;
    }
    if (next == kNever) break;
    for (Slide& slide : row.slides) slide = slide.at(next);
    now = next;
    if (met < count)
      hit(restitution, met, row);
    else
      row.slides[stopped].v_m_s = 0.0;
  }
  return slides;
}

}  // namespace

std::vector<MotionAt> sliding_row(const std::vector<StartingBody>& bodies,
                                  const std::vector<double>& half_m, double gravity_m_s2,
                                  const scenarios::SlidingRow& answer) {
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return bodies[a].state.position_m.x() < bodies[b].state.position_m.x();
  });
  Row row;
  for (const std::size_t i : order) {
    row.slides.push_back(
        {0.0, bodies[i].state.position_m.x(), bodies[i].state.linear_velocity_m_s.x(), 0.0});
    row.half_m.push_back(half_m[i]);
    row.mass_kg.push_back(bodies[i].params.mass_kg);
  }
  const std::vector<std::vector<Slide>> slides =
      all_slides(answer.friction * gravity_m_s2, answer.restitution, std::move(row));
  std::vector<MotionAt> motions(bodies.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::vector<Slide>& slid = slides[n];
    motions[order[n]] = [body = bodies[order[n]], of_body = slid](double t) {
      const auto after =
          std::upper_bound(of_body.begin(), of_body.end(), t,
                           [](double time, const Slide& slide) { return time < slide.since_s; });
      const Slide now = std::prev(after)->at(t);
      Motion motion{body.state.position_m, Vec3(now.v_m_s, 0, 0), body.state.orientation,
                    Vec3(Vec3::Zero())};
      motion.position_m.x() = now.x_m;
      return motion;
    };
  }
  return motions;
}

}  // namespace soda::analysis
