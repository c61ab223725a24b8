// Triangle meshes from OBJ and STL files.
#pragma once

#include <string>
#include <variant>

#include "physics/model/scene.hpp"

namespace soda::scenarios {

// Reads `path` (.obj or .stl, at most 64 MiB), scales by unit_m and merges equal vertices, keeping
// the order of the file; or says what is wrong. Materials and other files named inside are not
// opened. Coordinates have the mesh library's single precision.
std::variant<physics::TriangleMesh, std::string> read_mesh_file(const std::string& path,
                                                                double unit_m);

}  // namespace soda::scenarios
