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
      .def_property_readonly("name", &Scene::name, "As it was loaded or built.")
      .def_property_readonly("time_step_s", &Scene::time_step_s, "Length of a step.")
      .def_property_readonly("steps", &Scene::steps, "How many the scene asks for.")
      .def_property_readonly(
          "body_ids", [](const Scene& s) { return array_of(s.body_ids()); },
          "Ids of all bodies, ascending.")
      .def_property_readonly("static_names", &Scene::static_names,
                             "By the numbers that contacts and rays give.")
      .def_property_readonly("warnings", &Scene::warnings,
                             "What the scene may say but hardly means, a line each.")
      .def("mass_kg", &Scene::mass_kg, "body"_a, "Mass of a body.");
}

// What can be asked of a simulation, and coming back to it.
void define_questions(py::class_<Simulation>& type) {
  type.def(
          "contacts", [](const Simulation& s) { return contact_records(s.contacts()); },
          "Contact points of the last step, as a structured array.")
      .def("broken_joints", &Simulation::broken_joints, "Ids of the joints that have broken.")
      .def("cast_ray", &ray_hit, "from_m"_a, "direction"_a, "length_m"_a,
           "The first solid on the ray, as a dictionary, or None.")
      .def(
          "counters", [](const Simulation& s) { return dictionary_of(s.counters()); },
          "What all steps have cost, in pairs, islands, iterations and impacts.")
      .def(
          "report", [](const Simulation& s) { return dictionary_of(s.report()); },
          "Of the last step: penetration, residual, islands and contact points.")
      .def("snapshot", &bytes_of, "All of the state, as bytes.")
      .def("restore", &restore, "snapshot"_a,
           "Goes back, or forward, to a snapshot of the same scene.");
}

// Of something with states: an array for each quantity.
template <class T, class StatesOf>
void define_arrays(py::class_<T>& type, StatesOf states_of) {
  type.def(
          "positions", [=](const T& t) { return positions(states_of(t)); },
          "Centres in m, a row for each of body_ids.")
      .def(
          "orientations", [=](const T& t) { return orientations(states_of(t)); },
          "Unit quaternions (w, x, y, z), a row for each of body_ids.")
      .def(
          "velocities", [=](const T& t) { return velocities(states_of(t)); },
          "Of the centres in m/s, a row for each of body_ids.")
      .def(
          "angular_velocities", [=](const T& t) { return angular_velocities(states_of(t)); },
          "In rad/s, a row for each of body_ids.");
}

void define_simulation(py::module_& module) {
  py::class_<Simulation> type(module, "Simulation", "A scene that is simulated step by step.");
  type.def(py::init<const Scene&>(), "scene"_a, "At the start of the scene.")
      .def("step", &Simulation::step, "steps"_a = 1, py::call_guard<py::gil_scoped_release>(),
           "Goes on by so many steps.")
      .def_property_readonly("steps", &Simulation::steps, "How many have been made.")
      .def_property_readonly("time_s", &Simulation::time_s, "Simulated time.")
      .def_property_readonly("digest", &Simulation::digest,
                             "Of all states, bit for bit: equal simulations have equal ones.")
      .def_property_readonly(
          "body_ids", [](const Simulation& s) { return array_of(s.body_ids()); },
          "Ids of the bodies that are there, ascending.")
      .def("has", &Simulation::has, "body"_a, "Whether the body is there.")
      .def(
          "state",
          [](const Simulation& s, std::uint32_t body) { return dictionary_of(s.state(body)); },
          "body"_a, "position_m, orientation, velocity_m_s and angular_velocity_rad_s of a body.")
      .def("set_state", &set_state, "body"_a,
           "Sets what is given of a body's state, with the names of state().")
      .def(
          "apply", [](Simulation& s, const py::object& input) { s.apply(json_of(input)); },
          "input"_a, "An input as in the scenario format; without step or time_s, at once.");
  define_arrays(type, [](const Simulation& s) { return s.states(); });
  define_questions(type);
}

void define_run(py::module_& module) {
  py::class_<RunResult> type(module, "RunResult", "What a run of the kernel ended with.");
  type.def_readonly("steps", &RunResult::steps, "How many were committed.")
      .def_readonly("digest", &RunResult::digest, "As of a simulation after as many steps.")
      .def_readonly("events_executed", &RunResult::events_executed,
                    "Also those that were rolled back.")
      .def_readonly("events_rolled_back", &RunResult::events_rolled_back, "Executed in vain.")
      .def_readonly("events_committed", &RunResult::events_committed, "Those that count.")
      .def_property_readonly(
          "body_ids", [](const RunResult& r) { return array_of(r.body_ids); },
          "Ids of the bodies that are there, ascending.");
  define_arrays(type, [](const RunResult& r) { return r.states; });
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
  module.attr("__version__") = SODA_VERSION;
  soda::python::register_records();
  soda::python::define_errors(module);
  soda::python::define_scene(module);
  soda::python::define_simulation(module);
  soda::python::define_run(module);
}
