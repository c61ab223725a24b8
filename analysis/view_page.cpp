#include "analysis/view_page.hpp"

#include <bit>
#include <map>
#include <span>
#include <string_view>

#include "analysis/byte_codec.hpp"
#include "analysis/svg_plot.hpp"
#include "analysis/viewer_page.hpp"
#include "scenarios/printable.hpp"

namespace soda::analysis {
namespace {

void put_float(ByteBuffer& out, float value) {
  analysis::put(out, std::bit_cast<std::uint32_t>(value));
}

template <class T, class PutItem>
void put_list(ByteBuffer& out, std::span<const T> items, PutItem put_item) {
  analysis::put(out, static_cast<std::uint64_t>(items.size()));
  for (const T& item : items) put_item(item);
}
void put_floats(ByteBuffer& out, std::span<const float> floats) {
  put_list(out, floats, [&out](float value) { put_float(out, value); });
}
template <class T>
void put_integers(ByteBuffer& out, const std::vector<T>& integers) {
  put_list<T>(out, integers, [&out](T value) { analysis::put(out, value); });
}

ByteBuffer encoded(const Recording& recording) {
  ByteBuffer out;
  analysis::put(out, recording.name);
  analysis::put(out, recording.dt_s);
  for (int i = 0; i < 3; ++i) analysis::put(out, recording.up[i]);
  analysis::put(out, recording.worlds);
  put_list<Recording::Body>(out, recording.bodies, [&out](const Recording::Body& body) {
    analysis::put(out, body.label);
    analysis::put(out, body.shape);
  });
  put_list<Recording::Static>(out, recording.statics, [&out](const Recording::Static& body) {
    analysis::put(out, body.name);
    analysis::put(out, body.shape);
    put_floats(out, body.pose);
  });
  put_integers(out, recording.steps);
  put_list<Triangles>(out, recording.shapes,
                      [&out](const Triangles& shape) { put_floats(out, shape); });
  for (int i = 0; i < 3; ++i) analysis::put(out, recording.grid.origin_m[i]);
  analysis::put(out, recording.grid.cell_size_m);
  for (const std::int32_t cells : recording.grid.cells) analysis::put(out, cells);
  put_integers(out, recording.cell_owners);
  put_list<Recording::CellChange>(out, recording.changes,
                                  [&out](const Recording::CellChange& change) {
                                    analysis::put(out, change.frame);
                                    analysis::put(out, change.cell);
                                    analysis::put(out, change.from);
                                    analysis::put(out, change.to);
                                  });
  put_floats(out, recording.numbers);
  put_integers(out, recording.owners);
  return out;
}

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

std::string view_page(const Recording& recording) {
  return filled(kViewerPage, {{"script", kViewerScript},
                              {"title", escaped_xml(scenarios::printable_text(recording.name))},
                              {"recording", base64(encoded(recording))}});
}

}  // namespace soda::analysis
