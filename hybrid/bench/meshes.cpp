// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "hybrid/base/process_memory.h"
#include "hybrid/bench/paths.h"
#include "polygon/files/mesh_file.h"
#include "polygon/mesh/mesh_bounds.h"
#include "polygon/repair/check.h"
#include "polygon/surface/primitives.h"

namespace hybrid::bench {
namespace {

enum class Family : std::uint8_t { ico, geo, cube, corner };
struct Name {
  Family family;
  int number;
};

struct FamilyRow {
  Family family;
  std::string_view prefix;
  int lowest, highest;
};
constexpr FamilyRow kFamilies[]{{Family::ico, "ico", 0, 9},
                                {Family::geo, "geo", 1, 1024},
                                {Family::cube, "cube", 1, 1024},
                                {Family::corner, "corner", 1, 1024}};

Name parse(const std::string& name) {
  for (const FamilyRow& row : kFamilies) {
    if (!name.starts_with(row.prefix)) continue;
    const char* const first = name.data() + row.prefix.size();
    const char* const last = name.data() + name.size();
    int number = 0;
    const auto [end, error] = std::from_chars(first, last, number);
    if (error == std::errc() && end == last && number >= row.lowest && number <= row.highest)
      return {row.family, number};
  }
  throw std::invalid_argument(
      fmt::format("there is no mesh \"{}\"; there are ico0 to ico9 (balls of 20·4^n triangles), geo1 to "
                  "geo1024 (balls of 20·n²), cube1 to cube1024 and corner1 to corner1024 (n quads an edge), "
                  "and files: OBJ, "
                  "PLY, STL, OFF",
                  name));
}

// Numbers the vertices of a divided icosahedron: its corners, the vertices along its edges, and those inside
// its faces.
class Geodesic {
 public:
  Geodesic(const polygon::TriangleMesh& base, int frequency, double radius)
      : base_(base), f_(frequency), radius_(radius) {
    const auto n = static_cast<std::size_t>(frequency);
    mesh_.vertices.reserve(10 * n * n + 2);
    mesh_.triangles.reserve(20 * n * n);
    for (const glm::dvec3& corner : base.vertices) add(corner);
  }

  polygon::TriangleMesh build() {
    for (const polygon::TriangleIndices& face : base_.triangles) add_face(face);
    return std::move(mesh_);
  }

 private:
  std::uint32_t add(const glm::dvec3& direction) {
    mesh_.vertices.push_back(glm::normalize(direction) * radius_);
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  // The i-th vertex on the way from corner a to corner b. Both faces at the edge get the same vertices.
  std::uint32_t on_edge(std::uint32_t a, std::uint32_t b, int i) {
    if (i == 0) return a;
    if (i == f_) return b;
    if (a > b) {
      std::swap(a, b);
      i = f_ - i;
    }
    const auto [place, is_new] =
        edges_.try_emplace({a, b}, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) {
      for (int j = 1; j < f_; ++j)
        add(base_.vertices[a] * static_cast<double>(f_ - j) + base_.vertices[b] * static_cast<double>(j));
    }
    return place->second + static_cast<std::uint32_t>(i - 1);
  }

  // Row i of a face, at height i towards c. It has f − i + 1 vertices, from side a–c to side b–c.
  std::vector<std::uint32_t> row(const polygon::TriangleIndices& face, int i) {
    const auto [a, b, c] = face;
    std::vector<std::uint32_t> indices;
    const int last = f_ - i;
    for (int j = 0; j <= last; ++j) {
      if (j == 0) {
        indices.push_back(on_edge(a, c, i));
      } else if (j == last) {
        indices.push_back(on_edge(b, c, i));
      } else if (i == 0) {
        indices.push_back(on_edge(a, b, j));
      } else {
        indices.push_back(add(base_.vertices[a] * static_cast<double>(last - j) +
                              base_.vertices[b] * static_cast<double>(j) +
                              base_.vertices[c] * static_cast<double>(i)));
      }
    }
    return indices;
  }

  void add_face(const polygon::TriangleIndices& face) {
    std::vector<std::uint32_t> below = row(face, 0);
    for (int i = 1; i <= f_; ++i) {
      std::vector<std::uint32_t> above = row(face, i);
      for (std::size_t j = 0; j < above.size(); ++j) {
        mesh_.triangles.push_back({below[j], below[j + 1], above[j]});
        if (j + 1 < above.size()) mesh_.triangles.push_back({below[j + 1], above[j + 1], above[j]});
      }
      below = std::move(above);
    }
  }

  const polygon::TriangleMesh& base_;
  int f_;
  double radius_;
  polygon::TriangleMesh mesh_;
  // Key: the two corners of an edge, the lower first. Value: the first vertex between them.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> edges_;
};

double inscribed_radius(const polygon::TriangleMesh& mesh) {
  double least = std::numeric_limits<double>::max();
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices[t[0]];
    const glm::dvec3 normal = glm::cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    least = std::min(least, glm::dot(normal, a) / glm::length(normal));
  }
  return least;
}

}  // namespace

polygon::TriangleMesh make_geodesic_mesh(double radius_m, int frequency) {
  const polygon::TriangleMesh icosahedron = polygon::make_ball_mesh(1.0, 0);
  return Geodesic(icosahedron, frequency, radius_m).build();
}

polygon::TriangleMesh make_corner_mesh(double size_m, int quads_per_edge) {
  const auto n = static_cast<std::uint32_t>(quads_per_edge);
  polygon::TriangleMesh mesh;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> seams;  // a vertex on an axis belongs to two planes
  const auto vertex = [&](const std::array<std::uint32_t, 3>& at) {
    const auto make = [&] {
      mesh.vertices.push_back(glm::dvec3(at[0], at[1], at[2]) / static_cast<double>(n) * size_m);
      return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    };
    if (std::count(at.begin(), at.end(), 0U) < 2) return make();
    const auto found = seams.find(at);
    return found != seams.end() ? found->second : seams.emplace(at, make()).first->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::vector<std::uint32_t> grid;
    for (std::uint32_t j = 0; j <= n; ++j) {
      for (std::uint32_t i = 0; i <= n; ++i) {
        std::array<std::uint32_t, 3> at{};
        at[u] = i;
        at[v] = j;
        grid.push_back(vertex(at));
      }
    }
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = j * (n + 1) + i, b = a + n + 1;
        mesh.triangles.push_back({grid[a], grid[a + 1], grid[b + 1]});
        mesh.triangles.push_back({grid[a], grid[b + 1], grid[b]});
      }
    }
  }
  return mesh;
}

BenchShape bench_mesh_shape(const std::string& name) {
  switch (parse(name).family) {
    case Family::cube:
      return BenchShape::cube;
    case Family::corner:
      return BenchShape::corner;
    default:
      return BenchShape::sphere;
  }
}

std::size_t bench_mesh_triangles(const std::string& name) {
  const Name what = parse(name);
  const auto n = static_cast<std::size_t>(what.number);
  switch (what.family) {
    case Family::ico:
      return std::size_t{20} << (2 * n);
    case Family::geo:
      return 20 * n * n;
    case Family::cube:
      return 12 * n * n;
    case Family::corner:
      break;
  }
  return 6 * n * n;
}

bool is_bench_mesh_file(std::string_view name) {
  return name.find_first_of("./") != std::string_view::npos;
}

BenchMesh load_bench_mesh(const std::string& file, double unit_m, std::vector<std::string>& notes) {
  polygon::MeshFile loaded =
      polygon::load_mesh(file, {.scale = unit_m, .max_bytes = usable_memory_bytes() / 4});
  const polygon::MeshCheck check = polygon::check_mesh(loaded.mesh);
  const auto note = [&](const std::vector<polygon::Finding>& findings) {
    for (const polygon::Finding& f : findings) {
      if (f.severity != polygon::Severity::info)
        notes.push_back(fmt::format("{}: {}: {} {}", file, f.id, f.count, f.text));
    }
  };
  note(loaded.findings);
  note(check.findings);
  BenchMesh made{
      .name = file, .shape = BenchShape::from_file, .solid = check.oriented, .mesh = std::move(loaded.mesh)};
  const polygon::MeshBounds bounds = polygon::checked_bounds(made.mesh);
  for (glm::dvec3& v : made.mesh.vertices) v -= 0.5 * (bounds.low + bounds.high);
  for (const polygon::TriangleIndices& t : made.mesh.triangles) {
    for (const std::uint32_t v : t) made.reach_m = std::max(made.reach_m, glm::length(made.mesh.vertices[v]));
  }
  if (!(made.reach_m > 0.0))
    throw polygon::MeshError(
        fmt::format("{}: all of its vertices are one point; give a mesh with a size", file));
  return made;
}

BenchMesh make_bench_mesh(const std::string& name, double scale) {
  const Name what = parse(name);
  BenchMesh made{.name = name, .shape = bench_mesh_shape(name), .mesh = {}};
  switch (what.family) {
    case Family::ico:
      made.mesh = polygon::make_ball_mesh(kSphereRadius_m * scale, what.number);
      break;
    case Family::geo:
      made.mesh = make_geodesic_mesh(kSphereRadius_m * scale, what.number);
      break;
    case Family::cube:
      made.mesh = polygon::make_box_mesh(glm::dvec3(kCubeHalf_m * scale), what.number);
      break;
    case Family::corner:
      made.mesh = make_corner_mesh(kCornerSize_m * scale, what.number);
      made.solid = false;
      break;
  }
  if (made.solid) made.inscribed_radius_m = inscribed_radius(made.mesh);
  return made;
}

}  // namespace hybrid::bench
