// Marks and poses as bytes of a page.
#include <algorithm>
#include <cmath>

#include "analysis/viewer/page_bytes.hpp"

namespace soda::analysis {
namespace {

void put_three(ByteBuffer& out, const std::array<float, 3>& floats) {
  for (const float value : floats) put_float(out, value);
}

void put_joint(ByteBuffer& out, const FrameMarks::Joint& joint) {
  put(out, joint.a);
  put(out, joint.b);
  put(out, joint.kind);
  put_three(out, joint.anchor_a_m);
  put_three(out, joint.anchor_b_m);
  put(out, joint.label);
  put(out, joint.broken_from);
}

// A part of an orientation that is not the largest, as ten bits.
std::uint32_t ten_bits(double part) {
  const double share = 0.5 + part / std::sqrt(2.0);
  return static_cast<std::uint32_t>(std::clamp(std::lround(share * 1023.0), 0l, 1023l));
}

}  // namespace

void put_pose(ByteBuffer& out, const PoseRange& range, std::span<const float> numbers) {
  for (int k = 0; k < 3; ++k) {
    const double share = (static_cast<double>(numbers[k]) - range.low_m[k]) / range.size_m[k];
    // All are there, or the range is beyond what floats hold.
    const double told = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0.0;
    const auto bits = static_cast<std::uint32_t>(std::lround(told * 0xffffff));
    put(out, static_cast<std::uint16_t>(bits));
    put(out, static_cast<std::uint8_t>(bits >> 16));
  }
  int largest = 0;
  for (int part = 1; part < 4; ++part)
    if (std::abs(numbers[3 + part]) > std::abs(numbers[3 + largest])) largest = part;
  const float sign = numbers[3 + largest] < 0.0f ? -1.0f : 1.0f;
  auto packed = static_cast<std::uint32_t>(largest);
  for (int part = 0; part < 4; ++part)
    if (part != largest) packed = packed << 10 | ten_bits(sign * numbers[3 + part]);
  put(out, packed);
  put(out, static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(numbers[7]) >> 16));
}

ByteBuffer encoded(const FrameMarks& marks) {
  ByteBuffer out;
  put(out, marks.every);
  put(out, static_cast<std::uint8_t>(marks.has_strongest_only));
  put_list<FrameMarks::Joint>(out, marks.joints,
                              [&out](const FrameMarks::Joint& joint) { put_joint(out, joint); });
  put_list<FrameMarks::Energy>(out, marks.energies, [&out](const FrameMarks::Energy& energy) {
    put_float(out, energy.kinetic_joule);
    put_float(out, energy.potential_joule);
  });
  put_list<FrameMarks::Frame>(out, marks.frames, [&out](const FrameMarks::Frame& frame) {
    put(out, frame.frame);
    put_list<FrameMarks::Contact>(out, frame.contacts, [&out](const FrameMarks::Contact& contact) {
      put(out, contact.a);
      put(out, contact.b);
      put_three(out, contact.point_m);
      put_three(out, contact.force_newton);
      put_float(out, contact.normal_newton);
      put_float(out, contact.depth_m);
    });
    put_list<FrameMarks::Ghost>(out, frame.ghosts, [&out](const FrameMarks::Ghost& ghost) {
      put(out, ghost.body);
      put(out, ghost.world);
    });
  });
  return out;
}

}  // namespace soda::analysis
