// `soda contacts`: the forces that contacts bear, of steps of an event log.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "physics/step/contact_loads.hpp"

namespace soda::analysis {

struct ContactsRequest {
  std::string file;
  std::optional<std::int64_t> step;   // this one; by default the last
  std::optional<std::int64_t> every;  // instead: each that this divides
  std::optional<std::uint32_t> body;  // only contacts of this body, by label
  bool csv = false, json = false;
};

// The contacts of one step.
struct StepContacts {
  std::int64_t step = 0;
  std::vector<physics::ContactLoad> loads;
};

// Who is who in a step's contacts.
struct ContactNames {
  std::vector<std::uint32_t> labels;  // by BodyId
  std::vector<std::string> statics;   // by static_index_of(BodyId)
};

int contacts_command(const ContactsRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
