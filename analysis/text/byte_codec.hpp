// Named fields to bytes and back: little-endian, no padding, lengths before contents.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace soda::analysis {

using ByteBuffer = std::vector<unsigned char>;

template <class T>
void put(ByteBuffer& out, T value) {
  static_assert(std::is_integral_v<T>);
  const auto bits = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<unsigned char>(bits >> (8 * i)));
  }
}
inline void put(ByteBuffer& out, double value) { put(out, std::bit_cast<std::uint64_t>(value)); }
inline void put(ByteBuffer& out, const std::string& text) {
  put(out, static_cast<std::uint64_t>(text.size()));
  out.insert(out.end(), text.begin(), text.end());
}

// The bytes end before the fields do, or hold more than the fields.
class DecodeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Takes fields off the front. Throws DecodeError instead of reading beyond the end.
class ByteReader {
 public:
  explicit ByteReader(std::span<const unsigned char> bytes) : rest_(bytes) {}

  template <class T>
  T take() {
    static_assert(std::is_integral_v<T>);
    const std::span<const unsigned char> bytes = take_span(sizeof(T));
    if constexpr (std::endian::native == std::endian::little) {
      T value;
      std::memcpy(&value, bytes.data(), sizeof value);
      return value;
    } else {
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < sizeof(T); ++i) bits |= std::uint64_t{bytes[i]} << (8 * i);
      return static_cast<T>(bits);
    }
  }
  // An integer of `length` <= 8 bytes.
  std::uint64_t take_bits(std::size_t length) {
    std::uint64_t bits = 0;
    if (std::endian::native == std::endian::little && rest_.size() >= sizeof bits) {
      std::memcpy(&bits, rest_.data(), sizeof bits);
      rest_ = rest_.subspan(length);
      return length == 0 ? 0 : bits & (~std::uint64_t{0} >> (64 - 8 * length));
    }
    const std::span<const unsigned char> bytes = take_span(length);
    for (std::size_t i = 0; i < length; ++i) bits |= std::uint64_t{bytes[i]} << (8 * i);
    return bits;
  }
  double take_double() { return std::bit_cast<double>(take<std::uint64_t>()); }
  std::string take_string() {
    const std::span<const unsigned char> bytes = take_span(take<std::uint64_t>());
    return {bytes.begin(), bytes.end()};
  }
  bool take_flag() {
    const auto flag = take<std::uint8_t>();
    if (flag > 1) throw DecodeError("holds " + std::to_string(flag) + " where 0 or 1 stands");
    return flag == 1;
  }
  // A count of items of at least `item_bytes` each: never more than the bytes left can hold.
  std::size_t take_count(std::size_t item_bytes) {
    const std::uint64_t count = take<std::uint64_t>();
    if (count > rest_.size() / item_bytes) throw DecodeError("a count exceeds the bytes left");
    return count;
  }
  std::span<const unsigned char> take_span(std::uint64_t count) {
    if (count > rest_.size()) throw DecodeError("ends inside a field");
    const std::span<const unsigned char> bytes = rest_.first(count);
    rest_ = rest_.subspan(count);
    return bytes;
  }
  void skip(std::uint64_t count) { take_span(count); }
  std::size_t left() const { return rest_.size(); }
  void expect_end() const {
    if (!rest_.empty()) throw DecodeError(std::to_string(rest_.size()) + " bytes too many");
  }

 private:
  std::span<const unsigned char> rest_;
};

}  // namespace soda::analysis
