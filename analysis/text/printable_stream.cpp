#include "analysis/text/printable_stream.hpp"

#include <algorithm>

#include "scenarios/printable.hpp"

namespace soda::analysis {
namespace {

// How many bytes at the end may be the begin of a sequence.
std::size_t open_end(const std::string& text) {
  const std::size_t most = std::min<std::size_t>(text.size(), 3);
  for (std::size_t back = 1; back <= most; ++back) {
    const auto byte = static_cast<unsigned char>(text[text.size() - back]);
    if (byte < 0x80) return 0;
    if (byte >= 0xc0) {
      const std::size_t whole = byte >= 0xf0 ? 4 : byte >= 0xe0 ? 3 : 2;
      return back < whole ? back : 0;
    }
  }
  return 0;
}

}  // namespace

PrintableBuffer::~PrintableBuffer() { PrintableBuffer::sync(); }

bool PrintableBuffer::pass_on(std::size_t count) {
  const std::string text = scenarios::printable_text(std::string_view(held_).substr(0, count));
  held_.erase(0, count);
  const auto size = static_cast<std::streamsize>(text.size());
  return to_->sputn(text.data(), size) == size;
}

std::streambuf::int_type PrintableBuffer::overflow(int_type c) {
  if (c == traits_type::eof()) return traits_type::not_eof(c);
  const char letter = traits_type::to_char_type(c);
  return xsputn(&letter, 1) == 1 ? c : traits_type::eof();
}

std::streamsize PrintableBuffer::xsputn(const char* text, std::streamsize count) {
  held_.append(text, static_cast<std::size_t>(count));
  return pass_on(held_.size() - open_end(held_)) ? count : 0;
}

int PrintableBuffer::sync() { return pass_on(held_.size()) && to_->pubsync() == 0 ? 0 : -1; }

}  // namespace soda::analysis
