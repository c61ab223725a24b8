// Triangle meshes from OBJ and STL files.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "physics/model/scene.hpp"

namespace soda::scenarios {

inline constexpr std::size_t kMaxMeshBytes = std::size_t{64} << 20;

// A mesh file as it stands; `name` as the scenario gives it.
struct MeshFile {
  std::string name, bytes;
};

// Where the mesh files of a scenario come from.
struct MeshFiles {
  std::string folder;  // of relative names: empty, or with a slash at its end
  const std::vector<MeshFile>* kept = nullptr;  // these and no others; null: from disk
  std::vector<MeshFile>* read = nullptr;        // what is read is added here, each name once

  std::string path_of(const std::string& name) const {
    return name.starts_with('/') ? name : folder + name;
  }
};

// Reads `name` (.obj or .stl, at most 64 MiB), scales by unit_m and merges equal vertices, keeping
// the order of the file; or says what is wrong. Materials and other files named inside are not
// opened. Coordinates have the mesh library's single precision.
std::variant<physics::TriangleMesh, std::string> read_mesh_file(const std::string& name,
                                                                double unit_m,
                                                                const MeshFiles& files = {});

}  // namespace soda::scenarios
