// The one way by which text gets to the terminal.
#pragma once

#include <streambuf>
#include <string>

namespace soda::analysis {

// Passes on what is written, by scenarios::printable_text: whatever names and paths hold, and
// whoever prints them, no control character comes through. A UTF-8 sequence may come in pieces.
class PrintableBuffer final : public std::streambuf {
 public:
  // `to` must outlive this object.
  explicit PrintableBuffer(std::streambuf* to) : to_(to) {}
  ~PrintableBuffer() override;

 protected:
  int_type overflow(int_type c) override;
  std::streamsize xsputn(const char* text, std::streamsize count) override;
  int sync() override;

 private:
  bool pass_on(std::size_t count);

  std::streambuf* const to_;
  std::string held_;  // the begin of a sequence
};

}  // namespace soda::analysis
