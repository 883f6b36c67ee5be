// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh files as programs write them: byte-order marks, line ends, other files in place of a mesh, and faces
// of more than three corners.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "polygon/files/mesh_file.h"
#include "polygon/repair/check.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/findings.h"

namespace {

using namespace polygon;

class MeshText : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path written(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  MeshFile loaded(const std::string& name, const std::string& bytes) {
    return load_mesh(written(name, bytes));
  }
  std::string refused(const std::string& name, const std::string& bytes) {
    try {
      (void)loaded(name, bytes);
      return {};
    } catch (const MeshError& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("hybrid-mesh-text-" + std::to_string(::getpid()));
};

// A tetrahedron of volume 1/6 in every text format.
const std::vector<std::pair<std::string, std::string>>& tetrahedra() {
  static const std::vector<std::pair<std::string, std::string>> kFiles{
      {"t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 \\\n4\nf 1 4 3\n"},
      {"t.off", "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"},
      {"t.ply",
       "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
       "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
       "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"},
      {"t.stl",
       "solid t\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 "
       "0\nendloop\nendfacet\n"
       "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
       "facet normal 1 1 1\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n"
       "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\n"
       "endsolid t\n"}};
  return kFiles;
}

std::string with_line_ends(const std::string& text, const std::string& end) {
  std::string result;
  for (const char c : text) result += c == '\n' ? end : std::string(1, c);
  return result;
}

TEST_F(MeshText, MarksAndLineEndsOfEveryKindAreRead) {
  for (const auto& [name, text] : tetrahedra()) {
    const std::string half =
        with_line_ends(text.substr(0, text.size() / 2), "\r") + text.substr(text.size() / 2);
    for (const std::string& mark : {std::string(), std::string("\xEF\xBB\xBF")}) {
      for (const std::string& bytes :
           {text, with_line_ends(text, "\r\n"), with_line_ends(text, "\r"), half}) {
        const MeshFile file = loaded(name, mark + bytes);
        EXPECT_TRUE(file.findings.empty()) << name;
        EXPECT_EQ(file.mesh.triangles.size(), 4U) << name;
        const MeshCheck check = check_mesh(file.mesh);
        EXPECT_TRUE(check.oriented) << name;
        EXPECT_NEAR(check.volume_m3, 1.0 / 6.0, 1e-15) << name;
      }
    }
  }
}

TEST_F(MeshText, LinesKeepTheirNumbers) {
  EXPECT_NE(refused("a.obj", "\xEF\xBB\xBFv 0 0 0\rv 1 0 0\rv 0 x 0\r").find("line 3"), std::string::npos);
}

// A binary body may begin with a byte that equals a line feed.
TEST_F(MeshText, TheBodyOfABinaryPlyIsLeftAsItIs) {
  const std::string body = [] {
    std::string bytes(1, '\n');
    for (const float f : {0.0F, 0.0F, 0.0F, 13.0F, 0.0F, 0.0F, 0.0F, 7.5F, 0.0F})
      bytes.append(reinterpret_cast<const char*>(&f), sizeof(f));
    bytes.append(1, '\3');
    for (const std::int32_t i : {0, 1, 2}) bytes.append(reinterpret_cast<const char*>(&i), sizeof(i));
    return bytes;
  }();
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement first 1\nproperty uchar a\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    for (const std::string mark : {"", "\xEF\xBB\xBF"}) {
      const MeshFile file = loaded("b.ply", mark + with_line_ends(header, end) + body);
      ASSERT_EQ(file.mesh.triangles.size(), 1U);
      EXPECT_EQ(file.mesh.vertices[1], glm::dvec3(13.0, 0.0, 0.0));
      EXPECT_EQ(file.mesh.vertices[2], glm::dvec3(0.0, 7.5, 0.0));
      EXPECT_TRUE(file.findings.empty());
    }
  }
}

TEST_F(MeshText, WhatStandsInPlaceOfAMeshIsToldForWhatItIs) {
  const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
  for (const std::string name : {"a.obj", "a.ply", "a.stl", "a.off", "a.stl.gz", "A.OBJ"}) {
    EXPECT_NE(refused(name, pointer).find("Git LFS pointer"), std::string::npos) << name;
    EXPECT_NE(refused(name, pointer).find("git lfs pull"), std::string::npos) << name;
    EXPECT_NE(refused(name, "<!DOCTYPE html>\n<html></html>").find("web page"), std::string::npos) << name;
  }
  for (const std::string name : {"a.obj", "a.ply", "a.stl", "a.off"})
    EXPECT_NE(refused(name, std::string("\xFF\xFEv\0 \0", 6)).find("UTF-16"), std::string::npos) << name;
}

TEST_F(MeshText, FilesOfOtherFormatsAreToldForWhatTheyAre) {
  const std::string padding(200, ' ');
  const std::string gzip = std::string("\x1F\x8B\x08\0", 4) + padding;
  for (const std::string name : {"b.obj", "b.ply", "b.stl", "b.off"}) {
    EXPECT_NE(refused(name, gzip).find("packed by gzip; let its name end in .gz, as in " + name + ".gz"),
              std::string::npos)
        << name;
    EXPECT_NE(refused(name, "PK\x03\x04" + padding).find("ZIP file, as 3MF"), std::string::npos) << name;
    EXPECT_NE(refused(name, "BZh91AY" + padding).find("packed by bzip2"), std::string::npos) << name;
    EXPECT_NE(refused(name, "glTF\x02" + padding).find("glTF"), std::string::npos) << name;
    EXPECT_NE(refused(name, "ISO-10303-21;\nHEADER;\n" + padding).find("STEP"), std::string::npos) << name;
    EXPECT_NE(refused(name, "<?xml version=\"1.0\"?>\n<VTKFile>" + padding).find("XML"), std::string::npos);
    for (const auto& [true_name, bytes] : tetrahedra()) {
      const std::string ending = std::filesystem::path(true_name).extension();
      if (ending == ".obj" || name.ends_with(ending)) continue;
      EXPECT_NE(refused(name, bytes).find("begins as " + ending + " does; rename it"), std::string::npos)
          << ending << " in " << name;
    }
  }
  for (const std::string name : {"c.obj", "c.off"})
    EXPECT_NE(refused(name, std::string("\0\0\0\1", 4) + padding).find("no text"), std::string::npos) << name;
}

// Two facets in binary, with 'solid' in the header as many programs write it.
std::string binary_stl(std::uint32_t announced, const std::string& after) {
  std::string bytes = "solid by a scanner";
  bytes.resize(80, ' ');
  bytes.append(reinterpret_cast<const char*>(&announced), sizeof(announced));
  for (const float z : {0.0F, 1.0F}) {
    const float facet[12] = {0, 0, 1, 0, 0, z, 1, 0, z, 0, 1, z};
    bytes.append(reinterpret_cast<const char*>(facet), sizeof(facet)).append(2, '\0');
  }
  return bytes + after;
}

TEST_F(MeshText, ABinaryStlIsBinaryWhateverItsHeaderAndItsSize) {
  EXPECT_TRUE(loaded("d.stl", binary_stl(2, "")).findings.empty());
  const MeshFile longer = loaded("d.stl", binary_stl(2, "COLOR=rgba"));
  EXPECT_EQ(longer.mesh.triangles.size(), 2U);
  ASSERT_EQ(longer.findings.size(), 1U);
  EXPECT_EQ(longer.findings[0].id, "F07-trailing-bytes");
  EXPECT_EQ(longer.findings[0].count, 10U);
  EXPECT_EQ(loaded("d.stl", binary_stl(1, "")).mesh.triangles.size(), 1U);
  EXPECT_NE(refused("d.stl", binary_stl(3, "")).find("announces 3 facets, which need 234 bytes, but has 184"),
            std::string::npos);
  EXPECT_NE(refused("d.stl", binary_stl(0, "")).find("no triangle"), std::string::npos);
}

// A prism of height 10 over an L-shaped base of 700 square units. Each face's list of corners begins at
// `turn`.
std::string l_prism(std::size_t turn, const std::string& format) {
  const std::vector<std::array<int, 2>> corners{{40, 0}, {40, 10}, {10, 10}, {10, 40}, {0, 40}, {0, 0}};
  std::vector<std::vector<std::size_t>> faces{{5, 4, 3, 2, 1, 0}, {6, 7, 8, 9, 10, 11}};
  for (std::size_t i = 0; i < 6; ++i) faces.push_back({i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6});
  std::string vertices, indices;
  for (const int z : {0, 10}) {
    for (const auto& [x, y] : corners)
      vertices += (format == "obj" ? "v " : "") + std::to_string(x) + " " + std::to_string(y) + " " +
                  std::to_string(z) + "\n";
  }
  for (const auto& face : faces) {
    indices += format == "obj" ? "f" : std::to_string(face.size());
    for (std::size_t i = 0; i < face.size(); ++i)
      indices += " " + std::to_string(face[(i + turn) % face.size()] + (format == "obj" ? 1 : 0));
    indices += "\n";
  }
  if (format == "obj") return vertices + indices;
  if (format == "off") return "OFF\n12 8 0\n" + vertices + indices;
  return "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 8\nproperty list uchar int vertex_indices\nend_header\n" +
         vertices + indices;
}

TEST_F(MeshText, ANotchInAFaceIsEmptyWhateverItsFirstCorner) {
  for (const std::string format : {"obj", "off", "ply"}) {
    for (std::size_t turn = 0; turn < 6; ++turn) {
      const MeshFile file = loaded("l." + format, l_prism(turn, format));
      EXPECT_EQ(file.mesh.triangles.size(), 20U);
      EXPECT_EQ(tests::in_short(file.findings), "F06 8");
      const MeshCheck check = check_mesh(file.mesh, true);
      EXPECT_TRUE(check.oriented) << format << turn;
      EXPECT_TRUE(check.findings.empty()) << tests::in_short(check.findings);
      EXPECT_NEAR(check.volume_m3, 7000.0, 1e-9);
      const auto surface = make_mesh_surface(file.mesh, check.oriented);
      EXPECT_FALSE(surface->inside({20.0, 20.0, 5.0})) << "the notch";
      EXPECT_TRUE(surface->inside({5.0, 30.0, 5.0}));
    }
  }
}

TEST_F(MeshText, AFaceThatRunsAlongACutToAHoleIsKept) {
  const std::string vertices = "v 0 0 0\nv 6 0 0\nv 6 6 0\nv 0 6 0\nv 2 2 0\nv 2 4 0\nv 4 4 0\nv 4 2 0\n";
  const MeshFile file = loaded("k.obj", vertices + "f 1 2 3 4 1 5 6 7 8 5\n");
  EXPECT_EQ(tests::in_short(file.findings), "F06 1");
  double area = 0.0;
  for (const auto& [a, b, c] : file.mesh.triangles) {
    const auto& v = file.mesh.vertices;
    area += 0.5 * glm::cross(v[b] - v[a], v[c] - v[a]).z;
  }
  EXPECT_NEAR(area, 32.0, 1e-12);
}

TEST_F(MeshText, ATriangleWrittenWithFourCornersIsOne) {
  const MeshFile file = loaded("q.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 3\nf 1 1 1 2\n");
  EXPECT_EQ(file.mesh.triangles.size(), 1U);
  EXPECT_EQ(tests::in_short(file.findings), "F05 1, F06 1");
}

TEST_F(MeshText, AFaceThatCrossesItselfIsSaid) {
  const MeshFile file = loaded("x.obj", "v 0 0 0\nv 4 4 0\nv 4 0 0\nv 0 5 0\nv 0 0 1\nf 1 2 5\nf 1 2 3 4\n");
  EXPECT_EQ(tests::count_of(file.findings, "F08"), 1U);
  EXPECT_NE(tests::find_finding(file.findings, "F08")->text.find("face 1"), std::string::npos);
  EXPECT_EQ(file.mesh.triangles.size(), 3U) << "it can be touched all the same";
}

}  // namespace
