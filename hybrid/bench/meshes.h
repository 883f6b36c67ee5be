// SPDX-License-Identifier: GPL-3.0-or-later
// The meshes of `hybrid bench rigid`: named ones, from a thousand triangles to more than ten million, or one
// from a file.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace hybrid::bench {

enum class BenchShape : std::uint8_t { sphere, cube, corner, from_file };

struct BenchMesh {
  std::string name;
  BenchShape shape = BenchShape::sphere;
  bool solid = true;                // true: a closed mesh with an inside
  double inscribed_radius_m = 0.0;  // sphere and cube: least distance from a triangle's plane to the middle
  double reach_m = 0.0;             // from_file: greatest distance from a vertex to the middle of the box
  polygon::TriangleMesh mesh;       // counter-clockwise as seen from outside; each vertex occurs once
};

// ico0 … ico9: a ball. Each triangle of an icosahedron is divided n times into four: 20·4ⁿ triangles.
// geo1 … geo1024: a ball. Each face of an icosahedron is divided into n² triangles (geo707: 9,996,980 in
// all). These meshes have sizes between and beyond those of ico.
// cube1 … cube1024: a cube with n quads along each edge.
// corner1 … corner1024: three quarter planes that meet, with n quads along each edge.
// The vertices of a ball lie on the sphere of radius bench::kSphereRadius_m. All sizes are multiplied by
// `scale`. Throws std::invalid_argument for another name; the message lists the valid ones.
BenchMesh make_bench_mesh(const std::string& name, double scale = 1.0);

// The shape of the mesh of this name, without making the mesh. Throws std::invalid_argument for another name.
BenchShape bench_mesh_shape(const std::string& name);
std::size_t bench_mesh_triangles(const std::string& name);

// Is this the path of a file and not one of the names above? A path has a dot or a slash.
bool is_bench_mesh_file(std::string_view name);
// Loads a mesh file and moves the middle of its bounding box to the origin. Adds the defects of the mesh to
// `notes`, in words. Throws polygon::MeshError.
BenchMesh load_bench_mesh(const std::string& file, double unit_m, std::vector<std::string>& notes);

// The ball of mesh geo<frequency>.
polygon::TriangleMesh make_geodesic_mesh(double radius_m, int frequency);
// The three quarter planes x = 0, y = 0 and z = 0 over [0, size]². They face the side where x, y and z are
// positive.
polygon::TriangleMesh make_corner_mesh(double size_m, int quads_per_edge);

}  // namespace hybrid::bench
