#include "scenarios/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>

#include "physics/narrowphase/part_pairs.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/file_text.hpp"
#include "scenarios/format.hpp"

namespace soda::scenarios {
namespace {

constexpr std::size_t kMaxTriangles = 1'000'000;
// Compounds can meet it.
static_assert(kMaxTriangles <= physics::most_triangles(physics::kMostParts));

// Lets the mesh library open nothing: the file is handed to it as bytes.
class NoFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char*) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char*, const char*) override { return nullptr; }
  void Close(Assimp::IOStream*) override {}
};

std::string ending_of(const std::string& path) {
  const std::size_t dot = path.find_last_of("./");
  if (dot == std::string::npos || path[dot] == '/') return "";
  std::string ending = path.substr(dot + 1);
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return ending;
}

class MeshBuilder {
 public:
  explicit MeshBuilder(double unit_m) : unit_m_(unit_m) {}

  // The index of the vertex, which is new or equal to one before.
  std::uint32_t add_vertex(const aiVector3D& v) {
    const std::array<double, 3> key{v.x * unit_m_ + 0.0, v.y * unit_m_ + 0.0, v.z * unit_m_ + 0.0};
    const auto next = static_cast<std::uint32_t>(mesh_.vertices_m.size());
    const auto [at, is_new] = index_of_.try_emplace(key, next);
    if (is_new) mesh_.vertices_m.emplace_back(key[0], key[1], key[2]);
    return at->second;
  }

  // False if the triangle has no area.
  bool add_triangle(const aiMesh& part, const aiFace& face) {
    std::array<std::uint32_t, 3> triangle{};
    for (int i = 0; i < 3; ++i) triangle[i] = add_vertex(part.mVertices[face.mIndices[i]]);
    mesh_.triangles.push_back(triangle);
    const physics::Vec3& a = mesh_.vertices_m[triangle[0]];
    const physics::Vec3 ab = mesh_.vertices_m[triangle[1]] - a;
    const physics::Vec3 ac = mesh_.vertices_m[triangle[2]] - a;
    return ab.cross(ac) != physics::Vec3::Zero();
  }

  physics::TriangleMesh take() { return std::move(mesh_); }

 private:
  double unit_m_;
  physics::TriangleMesh mesh_;
  std::map<std::array<double, 3>, std::uint32_t> index_of_;
};

bool coordinates_allowed(const aiMesh& part, double unit_m) {
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) * unit_m;
    const bool finite = std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    if (!finite || largest > kMaxLength_m) return false;
  }
  return true;
}

const MeshFile* find(const std::vector<MeshFile>& files, const std::string& name) {
  const auto at = std::ranges::find(files, name, &MeshFile::name);
  return at == files.end() ? nullptr : &*at;
}

FileText text_of(const std::string& name, const MeshFiles& files) {
  if (files.kept != nullptr) {
    const MeshFile* kept = find(*files.kept, name);
    return kept == nullptr ? FileText{"", "is not among the files that are kept"}
                           : FileText{kept->bytes, ""};
  }
  FileText text = read_file_text(files.path_of(name), kMaxMeshBytes);
  if (text.failure.empty() && files.read != nullptr && find(*files.read, name) == nullptr)
    files.read->push_back({name, text.bytes});
  return text;
}

}  // namespace

std::variant<physics::TriangleMesh, std::string> read_mesh_file(const std::string& name,
                                                                double unit_m,
                                                                const MeshFiles& files) {
  const std::string ending = ending_of(name);
  if (ending != "obj" && ending != "stl") return std::string("neither .obj nor .stl");
  const FileText text = text_of(name, files);
  if (!text.failure.empty()) return text.failure;
  if (text.bytes.size() > kMaxMeshBytes) return std::string("more than 64 MiB");

  Assimp::Importer importer;
  importer.SetIOHandler(new NoFiles);  // the importer takes ownership
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  const aiScene* scene =
      importer.ReadFileFromMemory(text.bytes.data(), text.bytes.size(),
                                  aiProcess_Triangulate | aiProcess_SortByPType, ending.c_str());
  if (!scene) return "no mesh that can be read: " + std::string(importer.GetErrorString());

  MeshBuilder builder(unit_m);
  std::size_t triangles = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    if (!coordinates_allowed(part, unit_m)) {
      return "a coordinate beyond " + number_text(kMaxLength_m) + " m";
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      if (part.mFaces[f].mNumIndices != 3) continue;
      if (++triangles > kMaxTriangles) return std::string("more than 1,000,000 triangles");
      if (!builder.add_triangle(part, part.mFaces[f])) {
        return "triangle " + std::to_string(triangles) + " without area";
      }
    }
  }
  if (triangles == 0) return std::string("no triangles");
  return builder.take();
}

}  // namespace soda::scenarios
