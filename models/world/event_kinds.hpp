// What a run's events and messages are called, and what a message is about.
#pragma once

#include <cstdint>
#include <span>

#include "kernel/api/event_recorder.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::models {

// The kind of an execution, for kernel::Recording.
std::uint8_t kind_of(kernel::VirtualTime time);

// Kinds of executions and of messages, in the order of EventCounts: lower case, words joined by
// '_'.
std::span<const char* const> event_kinds();
std::span<const char* const> message_kinds();

// Why a world takes late news for more than it can absorb: the code of a kernel::Refusal.
enum class Refused : std::uint32_t {
  kUnknown = 0,    // it cannot tell: the news is not of ghosts, or the step's memo is gone
  kTouches = 1,    // own or foreign body `other` touches the ghost `subject`
  kTouched = 2,    // the ghost `subject` that is gone, or was elsewhere, had touched `other`
  kIsOwn = 3,      // body `subject` was its own in the step
  kMeetsSent = 4,  // the ghost `subject` comes to a body that an impact has sent on
  kInDoubt = 5,    // nothing is known of the cells that the ghost `subject` covers
};
inline constexpr std::uint32_t kRefusals = 6;

// What a trace says of a late message: the ids of the bodies that it brings, as 32-bit numbers,
// ascending and kMostNoted at most. None if it is about something else.
inline constexpr std::size_t kMostNoted = 64;
void note_bodies(std::uint32_t kind, std::span<const std::byte> payload, kernel::Bytes& note);

}  // namespace soda::models
