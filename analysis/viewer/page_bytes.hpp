// What a page holds, as bytes: counts before contents, as viewer/data.js takes them.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "analysis/text/byte_codec.hpp"
#include "analysis/viewer/recording.hpp"
#include "analysis/viewer/timeline.hpp"

namespace soda::analysis {

// As text, also in other files.
std::string base64(const ByteBuffer& bytes);

inline void put_float(ByteBuffer& out, float value) {
  put(out, std::bit_cast<std::uint32_t>(value));
}

template <class T, class PutItem>
void put_list(ByteBuffer& out, std::span<const T> items, PutItem put_item) {
  put(out, static_cast<std::uint64_t>(items.size()));
  for (const T& item : items) put_item(item);
}
inline void put_floats(ByteBuffer& out, std::span<const float> floats) {
  put_list(out, floats, [&out](float value) { put_float(out, value); });
}
template <class T>
void put_integers(ByteBuffer& out, const std::vector<T>& integers) {
  put_list<T>(out, integers, [&out](T value) { put(out, value); });
}
// A number of each item, one item after the other.
template <class T, class Take>
void put_column(ByteBuffer& out, const std::vector<T>& items, Take take) {
  put_list<T>(out, items, [&](const T& item) { put(out, take(item)); });
}

ByteBuffer encoded(const Recording& recording);               // view_page.cpp
ByteBuffer encoded(const FrameMarks& marks);                  // viewer/marks_bytes.cpp
ByteBuffer encoded(const std::optional<Timeline>& timeline);  // viewer/timeline_bytes.cpp

// A pose and a speed in 15 bytes: each coordinate as 24 bits between the least and the most of the
// recording, the orientation but for its largest part as three times ten bits, the upper half of
// the speed as a float.
struct PoseRange {
  physics::Vec3 low_m, size_m;
};
void put_pose(ByteBuffer& out, const PoseRange& range, std::span<const float> numbers);

}  // namespace soda::analysis
