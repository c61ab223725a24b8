// Floors, obstacles, and which idiom it is.
#include <cmath>

#include "analysis/whole/scene_idioms.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

struct Terrain {
  std::vector<Vec3> corners_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Terrain hills(SceneDraw& d) {
  const std::uint32_t side = 3 + d.chance.below(6);
  const double step = d.length(0.5, 4.0), height = d.length(0.0, 0.6);
  Terrain terrain;
  for (std::uint32_t x = 0; x < side; ++x)
    for (std::uint32_t y = 0; y < side; ++y)
      terrain.corners_m.emplace_back((x - 0.5 * (side - 1)) * step, (y - 0.5 * (side - 1)) * step,
                                     d.plain(-height * d.chance.between(0.0, 1.0)));
  for (std::uint32_t x = 0; x + 1 < side; ++x)
    for (std::uint32_t y = 0; y + 1 < side; ++y) {
      const std::uint32_t at = x * side + y;
      terrain.triangles.push_back({at, at + side, at + 1});
      terrain.triangles.push_back({at + 1, at + side, at + side + 1});
    }
  return terrain;
}

std::string obj_text(const Terrain& terrain) {
  std::string text;
  for (const Vec3& v : terrain.corners_m)
    text += "v " + json_of(v.x()) + " " + json_of(v.y()) + " " + json_of(v.z()) + "\n";
  for (const auto& [a, b, c] : terrain.triangles)
    text += "f " + json_of(a + 1) + " " + json_of(b + 1) + " " + json_of(c + 1) + "\n";
  return text;
}

std::string stl_text(const Terrain& terrain) {
  std::string text = "solid hills\n";
  for (const auto& triangle : terrain.triangles) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (const std::uint32_t corner : triangle) {
      const Vec3& v = terrain.corners_m[corner];
      text += "vertex " + json_of(v.x()) + " " + json_of(v.y()) + " " + json_of(v.z()) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid hills\n";
}

void add_terrain(SceneDraw& d) {
  const Terrain terrain = hills(d);
  JsonObject shape;
  shape.set("type", quoted("mesh"));
  const std::uint32_t form = d.chance.below(3);
  if (form < 2) {
    const std::string name = "hills-" + std::to_string(d.seed) + (form == 0 ? ".obj" : ".stl");
    d.scene.meshes = {{name, form == 0 ? obj_text(terrain) : stl_text(terrain)}};
    shape.set("file", quoted(name));
  } else {
    std::string corners, triangles;
    for (const Vec3& v : terrain.corners_m) corners += (corners.empty() ? "" : ", ") + json_of(v);
    for (const auto& [a, b, c] : terrain.triangles)
      triangles += (triangles.empty() ? "[" : ", [") + json_of(a) + ", " + json_of(b) + ", " +
                   json_of(c) + "]";
    shape.set("vertices_m", "[" + corners + "]").set("triangles", "[" + triangles + "]");
  }
  d.add_static(shape, Vec3::Zero());
}

void add_plane(SceneDraw& d) {
  JsonObject shape;
  shape.set("type", quoted("halfspace"));
  if (d.chance.one_in(6))
    shape.set("normal", json_of(Vec3(d.plain(d.chance.between(-0.4, 0.4)), 0, 1)));
  d.add_static(shape, Vec3::Zero());
}

}  // namespace

void add_ground(SceneDraw& draw) {
  const std::uint32_t kind = draw.chance.below(10);
  if (kind < 5) add_plane(draw);
  if (kind == 5 || kind == 6) {
    const Vec3 size(100.0 * draw.unit_m, 100.0 * draw.unit_m, draw.unit_m);
    draw.add_static(box_shape(size).object, Vec3(0, 0, -0.5 * draw.unit_m));
  }
  if (kind == 7 || kind == 8) add_terrain(draw);
  if (kind == 8) add_plane(draw);
  for (std::uint32_t i = draw.chance.one_in(3) ? 1 + draw.chance.below(4) : 0; i > 0; --i) {
    JsonObject more;
    if (draw.chance.one_in(2)) more.set("orientation", json_of(draw.chance.rotation()));
    draw.add_static(draw.any_shape(draw.length(0.3, 3.0)).object,
                    Vec3(draw.length(-4, 4), draw.length(-4, 4), draw.length(0, 1)), more);
  }
}

void add_idiom(SceneDraw& draw, std::uint32_t count, const Vec3& at_m) {
  if (draw.chance.one_in(3))
    add_jointed_idiom(draw, count, at_m);
  else
    add_loose_idiom(draw, count, at_m);
}

}  // namespace soda::analysis
