#include "scenarios/synonyms.hpp"

#include <algorithm>

#include "scenarios/faults.hpp"
#include "scenarios/field_table.hpp"

namespace soda::scenarios {
namespace {

constexpr Synonym kSynonyms[] = {
    // Shapes.
    {"plane ground infiniteplane", "halfspace", "everything below a plane; among statics only"},
    {"cube cuboid block", "box", ""},
    {"circle", "sphere", ""},
    {"pill", "capsule", ""},
    {"tube", "cylinder", ""},
    {"convex convexhull convexmesh polyhedron polytope", "hull", ""},
    {"multishape composite multi union group aggregate", "compound", "of convex parts"},
    {"trimesh trianglemesh heightfield terrain", "mesh", "among statics only"},
    // Joints.
    {"revolute pivot", "hinge", ""},
    {"prismatic translational", "slider", ""},
    {"spherical socket ballandsocket ballsocket pointtopoint p2p", "ball", ""},
    {"weld rigid lock", "fixed", ""},
    {"rod rope stick", "distance", "it neither gives nor goes slack"},
    {"damper springdamper dampedspring", "spring", ""},
    // Sizes.
    {"halfextents halfextent halfsize", "size_m", "full edge lengths: twice the half extents"},
    {"dimensions dims extents edges edge side", "size_m", "full edge lengths along x, y, z"},
    {"r", "radius_m", ""},
    {"diameter", "radius_m", "half the diameter"},
    {"height", "length_m size_m", "a capsule's without its caps; a box has one edge an axis"},
    {"halflength halfheight", "length_m", "the full length, a capsule's without its caps"},
    {"scale unit units", "unit_m", "length of one unit of the mesh, 0.001 for millimetres"},
    {"points vertices", "points_m vertices_m", ""},
    {"faces indices", "triangles", "three vertices each, counter-clockwise seen from outside"},
    {"path filename filepath src url", "file", ""},
    // Bodies.
    {"mass weight", "mass_kg", ""},
    {"density", "density_kg_m3", ""},
    {"com centerofmass centreofmass centerofgravity cog", "center_of_mass_m",
     "in the shape's frame"},
    {"children shapes elements pieces subshapes", "parts", "of a compound"},
    {"pos position translation location xyz origin offset", "position_m origin_m", ""},
    {"rotation rot quaternion quat euler rpy attitude", "orientation",
     R"({"w", "x", "y", "z"} or {"axis", "angle_deg"})"},
    {"angle", "angle_deg", "in degrees"},
    {"vel velocity linearvelocity linvel v", "velocity_m_s", ""},
    {"angularvelocity angvel omega spin", "angular_velocity_rad_s", "world frame"},
    {"force", "force_newton", ""},
    {"torque", "torque_newton_m motor_torque_newton_m", ""},
    {"lineardamping drag", "linear_damping_1_s", "the rate at which momentum decays"},
    {"angulardamping", "angular_damping_1_s", ""},
    {"geometry collider collision collisionshape geom", "shape", ""},
    {"label uid", "id", "an integer"},
    {"mu frictioncoefficient", "friction", ""},
    {"rollingfriction rollingresistance rollingfrictioncoefficient rollingcoefficient",
     "rolling_friction_m", "a length: torque over force"},
    {"spinningfriction spinfriction torsionalfriction torsionfriction pivotfriction",
     "torsional_friction_m", "a length: torque over force"},
    {"bounciness bounce elasticity cor", "restitution", ""},
    // Joints' members.
    {"bodya body1 parent", "body", ""},
    {"bodyb body2 child", "other_body", "without it, the joint holds the body to the world"},
    {"anchor anchora anchor1 pivotpoint", "anchor_m", "world frame"},
    {"anchorb anchor2 otheranchor", "other_anchor_m", "world frame"},
    {"lower min lowerlimit minlimit minangle", "min_angle_rad min_way_m", "at most 0"},
    {"upper max upperlimit maxlimit maxangle", "max_angle_rad max_way_m", "at least 0"},
    {"motorspeed targetvelocity targetspeed", "motor_speed_rad_s motor_speed_m_s", ""},
    {"motorforce maxforce", "motor_force_newton motor_torque_newton_m", ""},
    {"maxtorque motortorque", "motor_torque_newton_m", ""},
    {"servo target targetangle targetposition setpoint", "motor_target_rad motor_target_m", ""},
    {"stiffness k springconstant", "stiffness_newton_m", ""},
    {"damping c", "damping_newton_s_m linear_damping_1_s", ""},
    {"length restlength", "length_m", ""},
    {"breakforce breakingforce maxbreakforce breakingforcethreshold", "break_force_newton",
     "the mean over a step"},
    {"breaktorque breakingtorque maxbreaktorque breakingtorquethreshold", "break_torque_newton_m",
     "of hinges, sliders and fixed joints: the others bear none"},
    {"breakingimpulse breakimpulse breakingimpulsethreshold", "break_force_newton",
     "impulse over time step"},
    // The file.
    {"gravity g", "gravity_m_s2", "three numbers, such as [0, 0, -9.81]"},
    {"dt timestep step stepsize deltat h", "time_step_s", ""},
    {"duration endtime simulationtime tend time", "duration_s time_s", ""},
    {"timesteps numsteps nsteps stepcount frames iterationcount", "steps", ""},
    {"objects rigidbodies actors dynamics", "bodies", ""},
    {"static staticbodies environment obstacles floor", "statics", ""},
    {"constraints", "joints", ""},
    {"title", "name", ""},
    {"version", "format", "1"},
    {"buffer buffersize", "buffer_entries", ""},
    {"grid domain space", "territory", ""},
    {"cellsize", "cell_size_m", ""},
    // Settings.
    {"serial single", "sequential", ""},
    {"threaded multithreaded parallel timewarp", "threads", ""},
    {"sweeps solveriterations numiterations", "iterations", ""},
};

bool has_word(std::string_view words, std::string_view word) {
  while (!words.empty()) {
    const std::size_t end = std::min(words.find(' '), words.size());
    if (words.substr(0, end) == word) return true;
    words.remove_prefix(std::min(end + 1, words.size()));
  }
  return false;
}

std::string plain(std::string_view word) {
  std::string text;
  for (const char c : word) {
    if (c >= 'A' && c <= 'Z') text += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) text += c;
  }
  return text;
}

// A key of ours ends with its unit, and so may a key of a user who has guessed half of it.
std::string_view without_unit(std::string_view word) {
  constexpr std::string_view kEndings[] = {"_m",      "_kg",    "_s",   "_kg_m3",
                                           "_m_s2",   "_rad_s", "_m_s", "_newton_m",
                                           "_newton", "_rad",   "_deg"};
  std::string_view shortest = word;
  for (const std::string_view ending : kEndings)
    if (word.size() > ending.size() && word.ends_with(ending) &&
        word.size() - ending.size() < shortest.size())
      shortest = word.substr(0, word.size() - ending.size());
  return shortest;
}

const Synonym* find_synonym(std::string_view word) {
  for (const std::string& form : {plain(without_unit(word)), plain(word)})
    for (const Synonym& synonym : kSynonyms)
      if (has_word(synonym.words, form)) return &synonym;
  return nullptr;
}

// The first name of the row that may stand there, or "".
std::string_view name_among(const Synonym& synonym, std::span<const std::string_view> known) {
  for (std::string_view names = synonym.names; !names.empty();) {
    const std::size_t end = std::min(names.find(' '), names.size());
    const std::string_view name = names.substr(0, end);
    if (std::ranges::find(known, name) != known.end()) return name;
    names.remove_prefix(std::min(end + 1, names.size()));
  }
  return "";
}

std::string text_of(const Synonym& synonym, std::string_view name) {
  std::string text = "did you mean " + json_quoted(name) + "?";
  if (!synonym.note.empty()) text += " " + std::string(synonym.note);
  return text;
}

}  // namespace

std::span<const Synonym> synonyms() { return kSynonyms; }

std::string name_hint(std::string_view word, std::span<const std::string_view> known,
                      std::span<const std::string_view> elsewhere,
                      std::string_view elsewhere_hint) {
  if (std::ranges::find(elsewhere, word) != elsewhere.end()) return std::string(elsewhere_hint);
  if (const Synonym* synonym = find_synonym(word)) {
    if (const std::string_view name = name_among(*synonym, known); !name.empty())
      return text_of(*synonym, name);
    if (const std::string_view name = name_among(*synonym, elsewhere); !name.empty())
      return text_of(*synonym, name) + "; " + std::string(elsewhere_hint);
  }
  return nearest_name_hint(word, known);
}

std::string value_hint(std::string_view key, const JsonValue& value) {
  const bool number = value.kind == JsonKind::kNumber || value.kind == JsonKind::kInteger;
  if (number && value.number == 0.0 && (key == "mass_kg" || key == "density_kg_m3"))
    return "what does not move stands under statics, without a mass";
  if (key == "orientation" && value.kind == JsonKind::kArray)
    return value.children == 4 ? R"(write {"w": ..., "x": ..., "y": ..., "z": ...})"
                               : R"(write {"axis": [...], "angle_deg": ...})";
  if (key == "shape" && value.kind == JsonKind::kString)
    return R"(write {"type": )" + json_quoted(printable(value.text)) + ", ...} with its sizes";
  if (key == "gravity_m_s2" && number)
    return "as a vector, such as [0, 0, " + number_text(value.number) + "]";
  if ((key == "size_m" || key == "spacing_m" || key == "cells" || key == "count") && number)
    return "one number an axis";
  if (key == "material" && value.kind == JsonKind::kObject)
    return "describe it under materials, and write its name here";
  return "";
}

}  // namespace soda::scenarios
