// SPDX-License-Identifier: GPL-3.0-or-later
// Randomly damaged files, with a fixed seed. Each ends in a mesh or in a MeshError.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <random>
#include <sstream>

#include "polygon/files/mesh_file.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"

namespace {

using namespace polygon;

std::string obj_of(const TriangleMesh& mesh) {
  std::ostringstream out;
  out << "# small\no thing\n";
  for (const glm::dvec3& v : mesh.vertices) out << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
  out << "vn 0 0 1\n";
  for (const auto& [a, b, c] : mesh.triangles) {
    out << "f " << a + 1 << "//1 " << b + 1 << "//1 \\\n -" << mesh.vertices.size() - c << "//1\n";
  }
  return out.str();
}

std::string off_of(const TriangleMesh& mesh) {
  std::ostringstream out;
  out << "OFF\n" << mesh.vertices.size() << ' ' << mesh.triangles.size() << " 0\n";
  for (const glm::dvec3& v : mesh.vertices) out << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (const auto& [a, b, c] : mesh.triangles) out << "3 " << a << ' ' << b << ' ' << c << '\n';
  return out.str();
}

std::string ply_text_of(const TriangleMesh& mesh) {
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const glm::dvec3& v : mesh.vertices) out << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (const auto& [a, b, c] : mesh.triangles) out << "3 " << a << ' ' << b << ' ' << c << '\n';
  return out.str();
}

std::string ply_binary_of(const TriangleMesh& mesh, const std::filesystem::path& scratch) {
  save_ply(scratch, mesh);
  std::ifstream in(scratch, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string stl_text_of(const TriangleMesh& mesh) {
  std::ostringstream out;
  out << "solid s\n";
  for (const TriangleIndices& t : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t i : t) {
      out << "vertex " << mesh.vertices[i].x << ' ' << mesh.vertices[i].y << ' ' << mesh.vertices[i].z
          << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid s\n";
  return out.str();
}

std::string stl_binary_of(const TriangleMesh& mesh) {
  std::string bytes(80, 'h');
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (const TriangleIndices& t : mesh.triangles) {
    std::string facet(50, '\0');
    for (std::size_t c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) {
        const auto value = static_cast<float>(mesh.vertices[t[c]][k]);
        std::memcpy(facet.data() + 12 + 12 * c + 4 * static_cast<std::size_t>(k), &value, 4);
      }
    }
    bytes += facet;
  }
  return bytes;
}

std::string damaged(std::string bytes, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1));
  };
  const std::size_t changes = 1 + below(4);
  for (std::size_t i = 0; i < changes && !bytes.empty(); ++i) {
    // Half of the changes go to the first 200 bytes, where the headers are.
    const std::size_t at = below(random() % 2 == 0 ? std::min<std::size_t>(200, bytes.size()) : bytes.size());
    switch (random() % 6) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
        break;
      case 3:
        bytes.erase(at, 1 + below(8));
        break;
      case 4:
        bytes.insert(at, std::string(1 + below(3), "0123456789-. \n/\\e\xff"[below(18)]));
        break;
      default:
        bytes.insert(at, bytes.substr(below(bytes.size()), below(60)));
    }
  }
  return bytes;
}

TEST(DamagedMeshFiles, EndInAMeshOrARefusal) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("hybrid-damaged-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const TriangleMesh ball = make_ball_mesh(1.0, 0);
  const std::vector<std::pair<std::string, std::string>> seeds{
      {"a.obj", obj_of(ball)},      {"a.off", off_of(ball)},
      {"t.ply", ply_text_of(ball)}, {"b.ply", ply_binary_of(ball, folder / "seed.ply")},
      {"t.stl", stl_text_of(ball)}, {"b.stl", stl_binary_of(ball)},
  };
  std::mt19937_64 random(20);
  for (const auto& [name, bytes] : seeds) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    ASSERT_EQ(load_mesh(folder / name).mesh.triangles.size(), 20U) << name;
    std::size_t loaded = 0, refused = 0;
    for (int i = 0; i < 700; ++i) {
      std::ofstream(folder / name, std::ios::binary) << damaged(bytes, random);
      try {
        const MeshFile file = load_mesh(folder / name);
        ++loaded;
        ASSERT_FALSE(file.mesh.empty());
        for (const glm::dvec3& v : file.mesh.vertices) {
          ASSERT_TRUE(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z));
        }
        for (const TriangleIndices& t : file.mesh.triangles) {
          for (const std::uint32_t corner : t) ASSERT_LT(corner, file.mesh.vertices.size());
        }
        if (i % 50 == 0) (void)make_mesh_surface(file.mesh, false);
      } catch (const MeshError& error) {
        ++refused;
        ASSERT_GT(std::strlen(error.what()), 40U);
      }
    }
    EXPECT_GT(loaded, 20U) << name;
    EXPECT_GT(refused, 20U) << name;
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
