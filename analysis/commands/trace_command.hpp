// `soda trace`: the execution of a logged run as a trace file for ui.perfetto.dev, or any viewer of
// the Trace Event Format.
#pragma once

#include <iosfwd>
#include <string>

namespace soda::analysis {

struct TraceRequest {
  std::string file;
  std::string trace_file;  // empty: the log's name and .json
  bool force = false;
};

// A track for each worker and each world, with a slice for each execution; arrows for messages that
// came late; counters of GVT, of how far worlds are ahead of it (lead), and of the entries of their
// buffers that are not committed (fill). The clock is that of the executor: of a virtual cluster
// the modelled one. Throws FileError and UsageError as read_trace().
int trace_command(const TraceRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
