#include "library/python/arrays.hpp"

#include <array>
#include <string>

namespace soda::python {
namespace {

namespace py = pybind11;

template <std::size_t N, class Numbers>
Array rows(const std::vector<BodyState>& states, const Numbers& numbers_of) {
  Array array({states.size(), N});
  double* out = array.mutable_data();
  for (const BodyState& state : states)
    for (const double number : numbers_of(state)) *out++ = number;
  return array;
}

std::array<double, 3> numbers(const Vec3& v) { return {v.x, v.y, v.z}; }

// A contact as numpy has it: its members are the names of the record's fields.
struct Record {
  std::uint32_t body, other;
  bool other_is_static, touching;
  double position_m[3], normal[3];
  double separation_m, normal_newton;
  double friction_newton[3];
  double normal_impulse_newton_s;
};

void fill(const Vec3& from, double (&to)[3]) {
  to[0] = from.x;
  to[1] = from.y;
  to[2] = from.z;
}

std::vector<double> numbers_of(const py::handle& object, std::size_t count) {
  const auto numbers = object.cast<std::vector<double>>();
  if (numbers.size() != count)
    throw UsageError("found " + std::to_string(numbers.size()) +
                     " numbers; allowed: " + std::to_string(count));
  return numbers;
}

}  // namespace

Array positions(const std::vector<BodyState>& states) {
  return rows<3>(states, [](const BodyState& s) { return numbers(s.position_m); });
}
Array orientations(const std::vector<BodyState>& states) {
  return rows<4>(states, [](const BodyState& s) {
    const Quat& q = s.orientation;
    return std::array{q.w, q.x, q.y, q.z};
  });
}
Array velocities(const std::vector<BodyState>& states) {
  return rows<3>(states, [](const BodyState& s) { return numbers(s.velocity_m_s); });
}
Array angular_velocities(const std::vector<BodyState>& states) {
  return rows<3>(states, [](const BodyState& s) { return numbers(s.angular_velocity_rad_s); });
}

void register_records() {
  PYBIND11_NUMPY_DTYPE(Record, body, other, other_is_static, touching, position_m, normal,
                       separation_m, normal_newton, friction_newton, normal_impulse_newton_s);
}

py::array contact_records(const std::vector<Contact>& contacts) {
  py::array_t<Record> array(static_cast<py::ssize_t>(contacts.size()));
  Record* record = array.mutable_data();
  for (const Contact& contact : contacts) {
    *record = {};
    record->body = contact.a.id;
    record->other = contact.b.id;
    record->other_is_static = contact.b.is_static;
    record->touching = contact.touching;
    fill(contact.position_m, record->position_m);
    fill(contact.normal, record->normal);
    record->separation_m = contact.separation_m;
    record->normal_newton = contact.normal_newton;
    fill(contact.friction_newton, record->friction_newton);
    record->normal_impulse_newton_s = contact.normal_impulse_newton_s;
    ++record;
  }
  return array;
}

Vec3 vector_of(const py::handle& object) {
  const std::vector<double> n = numbers_of(object, 3);
  return {n[0], n[1], n[2]};
}
Quat quaternion_of(const py::handle& object) {
  const std::vector<double> n = numbers_of(object, 4);
  return {n[0], n[1], n[2], n[3]};
}
py::tuple tuple_of(const Vec3& v) { return py::make_tuple(v.x, v.y, v.z); }
py::tuple tuple_of(const Quat& q) { return py::make_tuple(q.w, q.x, q.y, q.z); }

}  // namespace soda::python
