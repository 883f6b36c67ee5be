// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/polygon/files/fuzz_seeds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <glm/common.hpp>
#include <sstream>
#include <string_view>

#include "polygon/mesh/mesh.h"
#include "polygon/surface/primitives.h"

namespace tests {
namespace {

using namespace polygon;

void append(TriangleMesh& mesh, const TriangleMesh& other, const glm::dvec3& offset) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const glm::dvec3& v : other.vertices) mesh.vertices.push_back(v + offset);
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({base + a, base + b, base + c});
}

std::ostringstream text_stream() {
  std::ostringstream out;
  out.precision(9);
  return out;
}

std::string obj_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << "# small\no thing\n";
  for (const glm::dvec3& v : mesh.vertices) out << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
  out << "vn 0 0 1\nvt 0 0\n";
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    if (i % 7 == 3) {
      out << "f " << a + 1 << "//1 " << b + 1 << "/1/1 \\\n -" << mesh.vertices.size() - c << "//1\n";
    } else {
      out << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
    }
  }
  return out.str();
}

void faces_as_text(std::ostringstream& out, const TriangleMesh& mesh) {
  for (const glm::dvec3& v : mesh.vertices) out << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (const auto& [a, b, c] : mesh.triangles) out << "3 " << a << ' ' << b << ' ' << c << '\n';
}

std::string off_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << "OFF\n" << mesh.vertices.size() << ' ' << mesh.triangles.size() << " 0\n";
  faces_as_text(out, mesh);
  return out.str();
}

std::string ply_header(const TriangleMesh& mesh, const char* format, const char* real) {
  std::ostringstream out;
  out << "ply\nformat " << format << " 1.0\nelement vertex " << mesh.vertices.size() << "\nproperty " << real
      << " x\nproperty " << real << " y\nproperty " << real << " z\nelement face " << mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  return out.str();
}

std::string ply_text_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << ply_header(mesh, "ascii", "float");
  faces_as_text(out, mesh);
  return out.str();
}

template <typename T>
void append_value(std::string& bytes, T value, bool swapped) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  if (swapped) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

template <typename Real>
std::string ply_binary_of(const TriangleMesh& mesh, bool big_endian) {
  static_assert(std::endian::native == std::endian::little);
  std::string bytes = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian",
                                 sizeof(Real) == 8 ? "double" : "float");
  for (const glm::dvec3& v : mesh.vertices) {
    for (int k = 0; k < 3; ++k) append_value(bytes, static_cast<Real>(v[k]), big_endian);
  }
  for (const TriangleIndices& t : mesh.triangles) {
    append_value(bytes, std::uint8_t{3}, big_endian);
    for (const std::uint32_t corner : t) append_value(bytes, corner, big_endian);
  }
  return bytes;
}

std::string stl_text_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << "solid s\n";
  for (const TriangleIndices& t : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t i : t) {
      const glm::dvec3& v = mesh.vertices[i];
      out << "vertex " << v.x << ' ' << v.y << ' ' << v.z << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid s\n";
  return out.str();
}

std::string stl_binary_of(const TriangleMesh& mesh) {
  std::string bytes(80, 'h');
  append_value(bytes, static_cast<std::uint32_t>(mesh.triangles.size()), false);
  for (const TriangleIndices& t : mesh.triangles) {
    bytes.append(12, '\0');
    for (const std::uint32_t corner : t) {
      for (int k = 0; k < 3; ++k) append_value(bytes, static_cast<float>(mesh.vertices[corner][k]), false);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

std::vector<TriangleMesh> small_meshes() {
  std::vector<TriangleMesh> meshes{make_ball_mesh(0.03, 1), make_box_mesh({0.01, 0.02, 0.03}, 2),
                                   make_plane_mesh(0.05, 4)};
  TriangleMesh crossing = make_box_mesh(glm::dvec3(0.5), 1);
  append(crossing, make_box_mesh(glm::dvec3(0.5), 1), {0.3, 0.2, 0.1});
  meshes.push_back(crossing);
  TriangleMesh soup;  // separate triangles of a closed mesh: one missing, one repeated, one turned over
  const TriangleMesh ball = make_ball_mesh(1.0, 1);
  for (std::size_t i = 1; i < ball.triangles.size(); ++i) {
    const TriangleIndices& t = ball.triangles[i];
    for (int copy = 0; copy < (i == 7 ? 2 : 1); ++copy) {
      const auto base = static_cast<std::uint32_t>(soup.vertices.size());
      for (const std::uint32_t corner : t) soup.vertices.push_back(ball.vertices[corner]);
      if (i == 9) std::swap(soup.vertices[base], soup.vertices[base + 1]);
      soup.triangles.push_back({base, base + 1, base + 2});
    }
  }
  meshes.push_back(soup);
  return meshes;
}

}  // namespace

std::vector<FuzzInput> fuzz_seeds() {
  std::vector<FuzzInput> seeds;
  for (const TriangleMesh& mesh : small_meshes()) {
    seeds.push_back({obj_of(mesh), ".obj"});
    seeds.push_back({off_of(mesh), ".off"});
    seeds.push_back({ply_text_of(mesh), ".ply"});
    seeds.push_back({ply_binary_of<double>(mesh, false), ".ply"});
    seeds.push_back({ply_binary_of<float>(mesh, true), ".PLY"});
    seeds.push_back({stl_text_of(mesh), ".stl"});
    seeds.push_back({stl_binary_of(mesh), ".STL"});
    seeds.push_back({obj_of(mesh), ".obj", true});
    seeds.push_back({stl_binary_of(mesh), ".stl", true});
  }
  return seeds;
}

}  // namespace tests
