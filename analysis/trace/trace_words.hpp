// What a trace tells of, as words for people.
#pragma once

#include <cstdint>
#include <string>

#include "kernel/api/event_recorder.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::analysis {

// "step 41, sync, round 2", "step 41, pass 1, pairs".
std::string words_of(kernel::VirtualTime time);
// The kind of an execution or a message, with spaces.
std::string event_words(kernel::VirtualTime time);
std::string message_words(std::uint32_t kind);
// "put back".
const char* happening_name(kernel::Happening what);  // "put_back"
std::string happening_words(kernel::Happening what);
// "3.412 ms".
std::string milliseconds(std::int64_t ns);
// "world 3", or "outside".
std::string world_words(std::uint32_t world);
// The name of a message, as commands take it: "1:42"; of one from outside "outside:42".
std::string message_name(std::uint32_t source, std::uint64_t number);
// "1 rollback", "2 rollbacks".
std::string counted(std::uint64_t count, const std::string& what);

}  // namespace soda::analysis
