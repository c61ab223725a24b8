// The Python module `soda`: scenes as dictionaries in the scenario format, states as numpy arrays.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <memory>
#include <optional>
#include <string>

#include "library/python/arrays.hpp"
#include "soda/run.hpp"
#include "soda/simulation.hpp"

namespace soda::python {
namespace {

namespace py = pybind11;
using namespace py::literals;

// A dictionary as JSON; text stays as it is.
std::string json_of(const py::object& object) {
  if (py::isinstance<py::str>(object)) return object.cast<std::string>();
  return py::module_::import("json").attr("dumps")(object).cast<std::string>();
}

py::array_t<std::uint32_t> array_of(std::span<const std::uint32_t> ids) {
  return py::array_t<std::uint32_t>(static_cast<py::ssize_t>(ids.size()), ids.data());
}

py::dict dictionary_of(const BodyState& state) {
  return py::dict("position_m"_a = tuple_of(state.position_m),
                  "orientation"_a = tuple_of(state.orientation),
                  "velocity_m_s"_a = tuple_of(state.velocity_m_s),
                  "angular_velocity_rad_s"_a = tuple_of(state.angular_velocity_rad_s));
}

// What is not given stays.
void set_state(Simulation& simulation, std::uint32_t body, const py::kwargs& changes) {
  BodyState state = simulation.state(body);
  for (const auto& [key, value] : changes) {
    const auto name = key.cast<std::string>();
    if (name == "position_m")
      state.position_m = vector_of(value);
    else if (name == "orientation")
      state.orientation = quaternion_of(value);
    else if (name == "velocity_m_s")
      state.velocity_m_s = vector_of(value);
    else if (name == "angular_velocity_rad_s")
      state.angular_velocity_rad_s = vector_of(value);
    else
      throw UsageError("found " + name +
                       "; allowed: position_m, orientation, velocity_m_s or "
                       "angular_velocity_rad_s");
  }
  simulation.set_state(body, state);
}

py::dict dictionary_of(const Counters& counters) {
  return py::dict("steps"_a = counters.steps, "candidate_pairs"_a = counters.candidate_pairs,
                  "contact_points"_a = counters.contact_points,
                  "islands_solved"_a = counters.islands_solved,
                  "islands_at_rest"_a = counters.islands_at_rest,
                  "solver_iterations"_a = counters.solver_iterations,
                  "impacts"_a = counters.impacts, "joints_broken"_a = counters.joints_broken);
}

py::dict dictionary_of(const StepReport& report) {
  return py::dict("deepest_penetration_m"_a = report.deepest_penetration_m,
                  "constraint_residual_m_s"_a = report.constraint_residual_m_s,
                  "islands"_a = report.islands, "contact_points"_a = report.contact_points);
}

py::bytes bytes_of(const Simulation& simulation) {
  const Snapshot snapshot = simulation.snapshot();
  return {reinterpret_cast<const char*>(snapshot.bytes.data()), snapshot.bytes.size()};
}

void restore(Simulation& simulation, const py::bytes& bytes) {
  const std::string_view view = bytes;
  Snapshot snapshot{std::vector<std::byte>(view.size())};
  if (!view.empty()) std::memcpy(snapshot.bytes.data(), view.data(), view.size());
  simulation.restore(snapshot);
}

py::object ray_hit(const Simulation& simulation, const py::object& from_m,
                   const py::object& direction, double length_m) {
  const auto hit = simulation.cast_ray(vector_of(from_m), vector_of(direction), length_m);
  if (!hit) return py::none();
  return py::dict("id"_a = hit->solid.id, "is_static"_a = hit->solid.is_static,
                  "distance_m"_a = hit->distance_m, "point_m"_a = tuple_of(hit->point_m),
                  "normal"_a = tuple_of(hit->normal));
}

using States = std::vector<BodyState>;

RunResult run_scene(const Scene& scene, const RunOptions& options, const py::object& on_commit) {
  CommitCallback callback;
  if (!on_commit.is_none())
    callback = [&on_commit](const CommittedStep& step) {
      const py::gil_scoped_acquire locked;
      on_commit(step.step, array_of(step.body_ids),
                positions(States(step.states.begin(), step.states.end())));
    };
  const py::gil_scoped_release unlocked;
  return run(scene, options, callback);
}

void define_errors(py::module_& module) {
  py::register_exception<SceneError>(module, "SceneError", PyExc_ValueError);
  py::register_exception<FileError>(module, "FileError", PyExc_OSError);
  py::register_exception<UsageError>(module, "UsageError", PyExc_ValueError);
  py::register_exception<NumericalError>(module, "NumericalError", PyExc_ArithmeticError);
}

void define_scene(py::module_& module) {
  py::class_<Scene>(module, "Scene", "A scene, checked and compiled.")
      .def_static("load", &Scene::load, "file"_a, "seed"_a = py::none(),
                  "Of a scenario file; a seed replaces all of its own.")
      .def_static(
          "build",
          [](const py::object& scene, const std::string& name) {
            return Scene::parse(json_of(scene), name);
          },
          "scene"_a, "name"_a = "scene", "Of a dictionary in the scenario format, or its text.")
      .def_property_readonly("name", &Scene::name)
      .def_property_readonly("time_step_s", &Scene::time_step_s)
      .def_property_readonly("steps", &Scene::steps)
      .def_property_readonly("body_ids", [](const Scene& s) { return array_of(s.body_ids()); })
      .def_property_readonly("static_names", &Scene::static_names)
      .def_property_readonly("warnings", &Scene::warnings)
      .def("mass_kg", &Scene::mass_kg, "body"_a);
}

void define_simulation(py::module_& module) {
  py::class_<Simulation>(module, "Simulation", "A scene that is simulated step by step.")
      .def(py::init<const Scene&>(), "scene"_a)
      .def("step", &Simulation::step, "steps"_a = 1, py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("steps", &Simulation::steps)
      .def_property_readonly("time_s", &Simulation::time_s)
      .def_property_readonly("digest", &Simulation::digest)
      .def_property_readonly("body_ids", [](const Simulation& s) { return array_of(s.body_ids()); })
      .def("positions", [](const Simulation& s) { return positions(s.states()); })
      .def("orientations", [](const Simulation& s) { return orientations(s.states()); })
      .def("velocities", [](const Simulation& s) { return velocities(s.states()); })
      .def("angular_velocities", [](const Simulation& s) { return angular_velocities(s.states()); })
      .def("has", &Simulation::has, "body"_a)
      .def(
          "state",
          [](const Simulation& s, std::uint32_t body) { return dictionary_of(s.state(body)); },
          "body"_a)
      .def("set_state", &set_state, "body"_a)
      .def(
          "apply", [](Simulation& s, const py::object& input) { s.apply(json_of(input)); },
          "input"_a, "An input as in the scenario format; without step or time_s, at once.")
      .def("contacts", [](const Simulation& s) { return contact_records(s.contacts()); })
      .def("broken_joints", &Simulation::broken_joints)
      .def("cast_ray", &ray_hit, "from_m"_a, "direction"_a, "length_m"_a)
      .def("counters", [](const Simulation& s) { return dictionary_of(s.counters()); })
      .def("report", [](const Simulation& s) { return dictionary_of(s.report()); })
      .def("snapshot", &bytes_of)
      .def("restore", &restore, "snapshot"_a);
}

void define_run(py::module_& module) {
  py::class_<RunResult>(module, "RunResult")
      .def_readonly("steps", &RunResult::steps)
      .def_readonly("digest", &RunResult::digest)
      .def_readonly("events_executed", &RunResult::events_executed)
      .def_readonly("events_rolled_back", &RunResult::events_rolled_back)
      .def_readonly("events_committed", &RunResult::events_committed)
      .def_property_readonly("body_ids", [](const RunResult& r) { return array_of(r.body_ids); })
      .def("positions", [](const RunResult& r) { return positions(r.states); })
      .def("orientations", [](const RunResult& r) { return orientations(r.states); })
      .def("velocities", [](const RunResult& r) { return velocities(r.states); })
      .def("angular_velocities", [](const RunResult& r) { return angular_velocities(r.states); });
  module.def(
      "run",
      [](const Scene& scene, std::optional<std::int64_t> steps, std::optional<std::uint32_t> worlds,
         std::optional<unsigned> threads, std::optional<std::int64_t> buffer_entries,
         const py::object& on_commit) {
        return run_scene(scene, {steps, worlds, threads, buffer_entries, {}}, on_commit);
      },
      "scene"_a, py::kw_only(), "steps"_a = py::none(), "worlds"_a = py::none(),
      "threads"_a = py::none(), "buffer_entries"_a = py::none(), "on_commit"_a = py::none(),
      "A whole run by the Time Warp kernel, divided into worlds, over threads. on_commit(step, "
      "body_ids, positions) is called for each step that is final.");
}

}  // namespace
}  // namespace soda::python

PYBIND11_MODULE(soda, module) {
  module.doc() = "Rigid bodies, simulated so that equal inputs give equal bits.";
  soda::python::register_records();
  soda::python::define_errors(module);
  soda::python::define_scene(module);
  soda::python::define_simulation(module);
  soda::python::define_run(module);
}
