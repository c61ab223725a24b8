// An event log as files for ParaView, and whatever else reads the XML formats of VTK.
#pragma once

#include <cstddef>
#include <cstdint>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/output_file.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

struct VtkOptions {
  std::int64_t every = 1;  // >= 1: steps from one that is written to the next; the last is, too
  bool surfaces = false;   // also each body's surface
};

struct VtkCounts {
  std::size_t steps = 0, contacts = 0;  // steps with states; contact points of all of them
};

// Into `folder`, which is then complete: collections over time in s, bodies.pvd and contacts.pvd,
// of a file for each step, statics.vtp, and of surfaces surfaces.pvd. A body is a point with
// orientation (w, x, y, z), velocities, world, island (the label of its
// first body) and label, in doubles that are those of the log; a contact a point with the force on
// `other`, which is -1 where `static` says which static it is, by its place in the scenario.
// Surfaces are triangles in the world's frame, of floats. Throws FileError, and UsageError of a log
// without states.
VtkCounts write_vtk(LogReader& log, const scenarios::Scenario& scenario, const VtkOptions& options,
                    OutputFolder& folder);

}  // namespace soda::analysis
