#include "analysis/viewer/vtk_poly_data.hpp"

#include <bit>
#include <cstring>
#include <numeric>
#include <type_traits>

#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/viewer/page_bytes.hpp"

namespace soda::analysis {
namespace {

static_assert(std::endian::native == std::endian::little, "as the files say");

template <class T>
constexpr const char* kTypeName = nullptr;
template <>
constexpr const char* kTypeName<double> = "Float64";
template <>
constexpr const char* kTypeName<float> = "Float32";
template <>
constexpr const char* kTypeName<std::int64_t> = "Int64";
template <>
constexpr const char* kTypeName<std::int32_t> = "Int32";

template <class T>
std::string data_array(const std::string& name, std::span<const T> numbers, int components) {
  // How many bytes follow, and these.
  const std::uint64_t count = numbers.size_bytes();
  ByteBuffer bytes(sizeof count + count);
  std::memcpy(bytes.data(), &count, sizeof count);
  if (count > 0) std::memcpy(bytes.data() + sizeof count, numbers.data(), count);
  return std::string("<DataArray type=\"") + kTypeName<T> + "\" Name=\"" + escaped_xml(name) +
         "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"binary\">" +
         base64(bytes) + "</DataArray>\n";
}

// Cells of `corners` points each.
std::string cells_text(const char* kind, std::span<const std::int32_t> points,
                       std::int32_t corners) {
  std::vector<std::int32_t> ends(points.size() / static_cast<std::size_t>(corners));
  for (std::size_t i = 0; i < ends.size(); ++i)
    ends[i] = corners * static_cast<std::int32_t>(i + 1);
  return std::string("<") + kind + ">\n" + data_array("connectivity", points, 1) +
         data_array("offsets", std::span<const std::int32_t>(ends), 1) + "</" + kind + ">\n";
}

constexpr const char* kVtkHead =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"@\" version=\"1.0\" byte_order=\"LittleEndian\" "
    "header_type=\"UInt64\">\n";

std::string vtk_head(const char* type) {
  std::string head = kVtkHead;
  return head.replace(head.find('@'), 1, type);
}

}  // namespace

void VtkPolyData::set_points(std::span<const double> xyz_m) {
  points_ = xyz_m.size() / 3;
  places_ = data_array("points_m", xyz_m, 3);
  std::vector<std::int32_t> all(points_);
  std::iota(all.begin(), all.end(), 0);
  cells_ = cells_text("Verts", all, 1);
}

void VtkPolyData::set_points(std::span<const float> xyz_m, std::span<const std::int32_t> corners) {
  points_ = xyz_m.size() / 3;
  triangles_ = corners.size() / 3;
  places_ = data_array("points_m", xyz_m, 3);
  cells_ = cells_text("Polys", corners, 3);
}

void VtkPolyData::add(const std::string& name, std::span<const double> numbers, int components) {
  arrays_ += data_array(name, numbers, components);
}

void VtkPolyData::add(const std::string& name, std::span<const float> numbers, int components) {
  arrays_ += data_array(name, numbers, components);
}

void VtkPolyData::add(const std::string& name, std::span<const std::int64_t> numbers,
                      int components) {
  arrays_ += data_array(name, numbers, components);
}

std::string VtkPolyData::text() const {
  const bool has_triangles = cells_.starts_with("<Polys>");
  const std::string about = has_triangles ? "CellData" : "PointData";
  const std::string vertices = std::to_string(has_triangles ? 0 : points_);
  return vtk_head("PolyData") +
         "<PolyData>\n<FieldData>\n"
         "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">" +
         format_exact(time_s_) +
         "</DataArray>\n"
         "<DataArray type=\"Int64\" Name=\"step\" NumberOfTuples=\"1\" format=\"ascii\">" +
         std::to_string(step_) + "</DataArray>\n</FieldData>\n<Piece NumberOfPoints=\"" +
         std::to_string(points_) + "\" NumberOfVerts=\"" + vertices +
         "\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
         std::to_string(triangles_) + "\">\n<" + about + ">\n" + arrays_ + "</" + about +
         ">\n<Points>\n" + places_ + "</Points>\n" + cells_ + "</Piece>\n</PolyData>\n</VTKFile>\n";
}

std::string vtk_collection(std::span<const VtkFrame> frames) {
  std::string text = vtk_head("Collection") + "<Collection>\n";
  for (const VtkFrame& frame : frames)
    text += "<DataSet timestep=\"" + format_exact(frame.time_s) + "\" part=\"0\" file=\"" +
            escaped_xml(frame.file) + "\"/>\n";
  return text + "</Collection>\n</VTKFile>\n";
}

}  // namespace soda::analysis
