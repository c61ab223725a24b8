// `soda replay --until` and `--break`: a traced run as it was executed, up to an event.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>

#include "analysis/commands/replay_command.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/trace/recorded_walk.hpp"
#include "models/commit/commit.hpp"

namespace soda::analysis {

// Says what was executed last, of a rollback its story, where every world stands, and the bodies as
// each world has them, be it for good or not. Throws UsageError if there is no such event, or the
// run cannot be had again (recorded_order.hpp).
int replay_until(const ReplayRequest& request, LogReader& log, std::ostream& out);

// Bodies as worlds have them; of `body`, if there is one, only that, in full.
std::string stands_text(const std::vector<models::WorldStand>& stands,
                        const std::vector<std::uint32_t>& labels,
                        const std::optional<physics::BodyId>& body);

}  // namespace soda::analysis
