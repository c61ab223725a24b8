// Logs with right checksums that no soda wrote.
#pragma once

#include <functional>
#include <string>

#include "analysis/event_log/log_format.hpp"

namespace soda::analysis_test {

// A block as it is changed: its header's raw_bytes follow the payload unless `claimed` is set.
struct ForgedBlock {
  analysis::BlockType type{};
  std::int64_t step = -1;  // of a step block
  analysis::ByteBuffer payload;
  std::uint64_t claimed = 0;
};

// The log in `from`, written to `to` with what `change` makes of its blocks.
void forge_log(const std::string& from, const std::string& to,
               const std::function<void(ForgedBlock&)>& change);

// The log in `from`, written anew to `to` with what `change` makes of its steps: sound in all its
// checksums.
void rewrite_log(const std::string& from, const std::string& to,
                 const std::function<void(analysis::LoggedStep&)>& change);

// In place of the bytes at `at`.
template <class T>
void overwrite(analysis::ByteBuffer& bytes, std::size_t at, T value) {
  analysis::ByteBuffer field;
  analysis::put(field, value);
  std::copy(field.begin(), field.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace soda::analysis_test
