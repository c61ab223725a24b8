// The start impulses of the convex problem (convex_contacts.hpp) as one vector of velocities, each
// by its compliance: what gives way is taken out by starting again from the impulses found
// (augmented Lagrangian), and that is a fixed-point iteration of this vector.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "physics/solvers/convex_contacts.hpp"

namespace soda::physics {

// By how much what is found differs from the start, of contacts and of rows of joints. Of what
// turns: for what presses now.
struct StartCorrection {
  double points_m_s = 0.0, rows_m_s = 0.0;
  double largest_m_s() const { return std::max(points_m_s, rows_m_s); }
};

// Appends the start impulses to `were` and those of `responses` to `found`. Springs, whose
// compliance is meant, are not among them.
StartCorrection append_start_impulses(const ConvexContacts& problem, const Responses& responses,
                                      std::vector<double>& were, std::vector<double>& found);

// Sets them, in the order of append_start_impulses().
void set_start_impulses(std::span<const double> values, ConvexContacts& problem);

// What presses where bodies turn against each other becomes that of the points' responses.
void set_pressing(std::span<const PointResponse> responses, ConvexContacts& problem);

// What was extrapolated opens and closes no point: an open one starts from what it bears, and a
// closed one presses by half of that at least.
void keep_closed(const Responses& responses, ConvexContacts& problem);

}  // namespace soda::physics
