// States and contacts as numpy arrays.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <vector>

#include "soda/simulation.hpp"

namespace soda::python {

using Array = pybind11::array_t<double>;

// A row for each state, in their order.
Array positions(const std::vector<BodyState>& states);
Array orientations(const std::vector<BodyState>& states);  // w, x, y, z
Array velocities(const std::vector<BodyState>& states);
Array angular_velocities(const std::vector<BodyState>& states);

// Tells numpy what a record of a contact is: once in a process, before the first of them.
void register_records();
// One record for each contact.
pybind11::array contact_records(const std::vector<Contact>& contacts);

// Of three numbers, or four.
Vec3 vector_of(const pybind11::handle& numbers);
Quat quaternion_of(const pybind11::handle& numbers);
pybind11::tuple tuple_of(const Vec3& v);
pybind11::tuple tuple_of(const Quat& q);

}  // namespace soda::python
