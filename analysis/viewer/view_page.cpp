#include "analysis/viewer/view_page.hpp"

#include <limits>
#include <map>
#include <span>
#include <string_view>

#include "analysis/text/svg_plot.hpp"
#include "analysis/viewer/page_bytes.hpp"
#include "analysis/viewer/viewer_page.hpp"
#include "scenarios/printable.hpp"

namespace soda::analysis {
namespace {

// Of all bodies that are there, over all frames.
PoseRange range_of(const Recording& recording) {
  const physics::Vec3 far = physics::Vec3::Constant(std::numeric_limits<double>::infinity());
  physics::Vec3 low = far, high = -far;
  for (std::size_t i = 0; i < recording.owners.size(); ++i) {
    if (recording.owners[i] == Recording::kAway) continue;
    const float* const at = &recording.numbers[i * Recording::kNumbers];
    const physics::Vec3 place(at[0], at[1], at[2]);
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  if (low.x() > high.x()) return {physics::Vec3::Zero(), physics::Vec3::Zero()};
  return {low, high - low};
}

void put_poses(ByteBuffer& out, const Recording& recording) {
  const PoseRange range = range_of(recording);
  for (int i = 0; i < 3; ++i) put(out, range.low_m[i]);
  for (int i = 0; i < 3; ++i) put(out, range.size_m[i]);
  const std::span<const float> numbers = recording.numbers;
  for (std::size_t i = 0; i < recording.owners.size(); ++i)
    put_pose(out, range, numbers.subspan(i * Recording::kNumbers, Recording::kNumbers));
}

// The template with a text in place of each {{mark}}. In one pass: what is put in is not looked at
// again, whatever it holds.
std::string filled(std::string_view page, const std::map<std::string_view, std::string>& texts) {
  std::string out;
  for (std::size_t mark; (mark = page.find("{{")) != std::string_view::npos;) {
    const std::size_t end = page.find("}}", mark);
    out += page.substr(0, mark);
    out += texts.at(page.substr(mark + 2, end - mark - 2));
    page.remove_prefix(end + 2);
  }
  out += page;
  return out;
}

}  // namespace

std::string base64(const ByteBuffer& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t first = 0; first < bytes.size(); first += 3) {
    std::uint32_t bits = 0;
    for (std::size_t i = first; i < first + 3; ++i)
      bits = bits << 8 | (i < bytes.size() ? bytes[i] : 0u);
    for (std::size_t i = 0; i < 4; ++i)
      text += first + i <= bytes.size() ? kDigits[bits >> (18 - 6 * i) & 63] : '=';
  }
  return text;
}

ByteBuffer encoded(const Recording& recording) {
  ByteBuffer out;
  put(out, recording.name);
  put(out, recording.dt_s);
  for (int i = 0; i < 3; ++i) put(out, recording.up[i]);
  put(out, recording.worlds);
  put_list<Recording::Body>(out, recording.bodies, [&out](const Recording::Body& body) {
    put(out, body.label);
    put(out, body.shape);
  });
  put_list<Recording::Static>(out, recording.statics, [&out](const Recording::Static& body) {
    put(out, body.name);
    put(out, body.shape);
    put_floats(out, body.pose);
  });
  put_integers(out, recording.steps);
  put_list<Triangles>(out, recording.shapes,
                      [&out](const Triangles& shape) { put_floats(out, shape); });
  for (int i = 0; i < 3; ++i) put(out, recording.grid.origin_m[i]);
  put(out, recording.grid.cell_size_m);
  for (const std::int32_t cells : recording.grid.cells) put(out, cells);
  put_integers(out, recording.cell_owners);
  put_list<Recording::CellChange>(out, recording.changes,
                                  [&out](const Recording::CellChange& change) {
                                    put(out, change.frame);
                                    put(out, change.cell);
                                    put(out, change.from);
                                    put(out, change.to);
                                  });
  put_integers(out, recording.owners);
  put_poses(out, recording);
  return out;
}

std::string view_page(const Recording& recording, const std::optional<Timeline>& timeline) {
  return filled(kViewerPage, {{"script", kViewerScript},
                              {"style", kViewerStyle},
                              {"title", escaped_xml(scenarios::printable_text(recording.name))},
                              {"recording", base64(encoded(recording))},
                              {"marks", base64(encoded(recording.marks))},
                              {"timeline", base64(encoded(timeline))}});
}

}  // namespace soda::analysis
