// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stress/scenes.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>

#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"

namespace hybrid {
namespace {

// Half of the size of a large block (units), and also the number of squares along an edge of its mesh.
constexpr int kLargeEdge = 512;
constexpr double kNearlyNothing = 1e-7;  // height of a sliver, as a share of its edge

glm::dvec3 block_size(BlockShape shape) {
  switch (shape) {
    case BlockShape::block:
      return {40.0, 40.0, 20.0};
    case BlockShape::sheet:
      return {40.0, 40.0, 2.0};
    case BlockShape::voxel:
      return glm::dvec3(2.0);
    case BlockShape::large:
      return glm::dvec3(2.0 * kLargeEdge);
  }
  return glm::dvec3(0.0);
}

// Centre of the block. Its top is at z = 10. A block of one voxel is where the tool presses, beside the ball.
glm::dvec3 block_middle(BlockShape shape) {
  const double z = 10.0 - 0.5 * block_size(shape).z;
  return shape == BlockShape::voxel ? glm::dvec3(13.0, 2.0, z) : glm::dvec3(0.0, 0.0, z);
}

polygon::TriangleMesh with_slivers(const polygon::TriangleMesh& mesh) {
  polygon::TriangleMesh out{mesh.vertices, {}};
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const auto p = static_cast<std::uint32_t>(out.vertices.size());
    out.vertices.push_back(a + 0.5 * (b - a) + kNearlyNothing * (c - a));  // close to the edge a–b
    out.triangles.push_back({t[0], t[1], p});
    out.triangles.push_back({t[1], t[2], p});
    out.triangles.push_back({t[2], t[0], p});
  }
  return out;
}

polygon::TriangleMesh with_zero_areas(polygon::TriangleMesh mesh) {
  const std::size_t count = mesh.triangles.size();
  for (std::size_t i = 0; i < count; ++i) {
    const polygon::TriangleIndices t = mesh.triangles[i];
    mesh.triangles.push_back({t[0], t[0], t[1]});
    mesh.triangles.push_back({t[2], t[2], t[2]});
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(0.5 * (mesh.vertices[t[0]] + mesh.vertices[t[1]]));
    mesh.triangles.push_back({t[0], middle, t[1]});
  }
  return mesh;
}

polygon::TriangleMesh with_duplicates(const polygon::TriangleMesh& mesh) {
  polygon::TriangleMesh out;
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const std::uint32_t v : t) out.vertices.push_back(mesh.vertices[v]);
    out.triangles.push_back({first, first + 1, first + 2});
    out.vertices.push_back(mesh.vertices[t[0]]);  // a vertex that no triangle uses
  }
  return out;
}

polygon::TriangleMesh flawed(const polygon::TriangleMesh& mesh, MeshFlaw flaw, int coincident) {
  switch (flaw) {
    case MeshFlaw::none:
      return mesh;
    case MeshFlaw::slivers:
      return with_slivers(mesh);
    case MeshFlaw::zero_area:
      return with_zero_areas(mesh);
    case MeshFlaw::all_flat: {
      polygon::TriangleMesh out = mesh;
      for (polygon::TriangleIndices& t : out.triangles) t[2] = t[1];
      return out;
    }
    case MeshFlaw::duplicates:
      return with_duplicates(mesh);
    case MeshFlaw::coincident: {
      polygon::TriangleMesh out = mesh;
      out.triangles.insert(out.triangles.end(), static_cast<std::size_t>(coincident), mesh.triangles.back());
      return out;
    }
  }
  return mesh;
}

// Three numbers in meters, from coordinates in units about the middle.
std::string at(const SceneSetting& s, const glm::dvec3& units) {
  const glm::dvec3 p = s.origin_m + s.unit_m * units;
  return fmt::format("{:.17g}, {:.17g}, {:.17g}", p.x, p.y, p.z);
}
std::string at(const SceneSetting& s, double x, double y, double z) {
  return at(s, glm::dvec3(x, y, z));
}

std::string size(const SceneSetting& s, const glm::dvec3& v) {
  return fmt::format("{:.17g}, {:.17g}, {:.17g}", s.unit_m * v.x, s.unit_m * v.y, s.unit_m * v.z);
}

}  // namespace

std::string_view name_of(SceneKind kind) {
  switch (kind) {
    case SceneKind::rigid:
      return "rigid";
    case SceneKind::soft:
      return "soft";
    case SceneKind::mixed:
      return "mixed";
  }
  return "";
}

std::string scene_text(const SceneSetting& s) {
  std::string text = fmt::format(
      "# An extreme of the suite.\nformat = 1\nunits = \"m\"\n"
      "[tool]\nradius = {:.17g}\nstiffness = {:.17g}\n[device]\nmodel = \"{}\"\nrate = {:.17g}\n"
      "[safety]\nsoft_start = 0\n{}",
      3.0 * s.unit_m, s.stiffness_N_per_m, s.ideal_device ? "ideal" : "premium-1.5", s.rate_hz,
      s.ideal_device ? "max_force = 8.5\n"
      : s.passivity  ? "passivity = true\n"
                     : "");
  if (s.kind != SceneKind::rigid) {
    text += fmt::format(
        "[material.gel]\nyoung = {:.17g}\nstretch = [{:.17g}, {:.17g}]\nshear = {:.17g}\n"
        "[[soft]]\nname = \"block\"\nformula = \"block\"\nmaterial = \"gel\"\nsize = [{}]\n"
        "spacing = {:.17g}\nposition = [{}]\n",
        s.young_Pa, s.stretch_min, s.stretch_max, s.shear, size(s, block_size(s.shape)), 2.0 * s.unit_m,
        at(s, block_middle(s.shape)));
  } else {
    text += fmt::format("[[rigid]]\nname = \"block\"\nmesh = \"block.ply\"\nposition = [{}]\n",
                        at(s, block_middle(s.shape)));
  }
  if (s.kind != SceneKind::soft)
    text += fmt::format("[[rigid]]\nname = \"ball\"\nmesh = \"ball.ply\"\nposition = [{}]\n",
                        at(s, 0.0, 0.0, 14.0));
  // The path: the ball from above, down its side, into the corner, the block alone, and away.
  text += fmt::format(
      "[path]\nkind = \"waypoints\"\nspeed = {:.17g}\npoints = [[{}], [{}, 0.05], [{}], [{}, 0.1], [{}], "
      "[{}, 0.3]]\n",
      150.0 * s.unit_m, at(s, 0.0, 0.0, kFreeHeight), at(s, 1.0, 0.0, 21.0), at(s, 8.0, 1.0, 18.0),
      at(s, 11.0, 1.0, 11.0), at(s, 15.0, 3.0, 11.5), at(s, 15.0, 3.0, kFreeHeight));
  return text;
}

std::filesystem::path write_scene(const SceneSetting& s, const std::filesystem::path& folder) {
  const glm::dvec3 half = 0.5 * s.unit_m * block_size(s.shape);
  if (s.kind == SceneKind::rigid)
    polygon::save_ply(folder / "block.ply",
                      flawed(polygon::make_box_mesh(half, s.shape == BlockShape::large ? kLargeEdge : 4),
                             s.flaw, s.coincident));
  if (s.kind != SceneKind::soft)
    polygon::save_ply(folder / "ball.ply",
                      flawed(polygon::make_ball_mesh(6.0 * s.unit_m, 3), s.flaw, s.coincident));
  std::filesystem::path file = folder / "scene.toml";
  std::ofstream out(file, std::ios::binary);
  out << scene_text(s);
  out.flush();
  if (!out) throw std::runtime_error(fmt::format("{}: cannot be written; check the folder", file.string()));
  return file;
}

}  // namespace hybrid
