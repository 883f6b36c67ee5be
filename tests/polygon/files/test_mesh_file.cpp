// SPDX-License-Identifier: GPL-3.0-or-later
// Reading and writing of mesh files: every format, each kind of element that is left out, each kind of file
// that is refused, and the data sets.
#include "polygon/files/mesh_file.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "polygon/files/write_mesh.h"
#include "polygon/surface/primitives.h"
#include "tests/shared_data.h"

namespace {

using namespace polygon;

// A folder for the files of one test, removed at the test's end.
class MeshFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("hybrid-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + "-" +
               std::to_string(reinterpret_cast<std::uintptr_t>(this)));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path path(const std::string& name) const { return folder_ / name; }

  std::filesystem::path write(const std::string& name, const std::string& bytes) {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  std::filesystem::path write_gz(const std::string& name, const std::string& bytes) {
    gzFile out = gzopen(path(name).c_str(), "wb");
    gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(out);
    return path(name);
  }

  // The error text; empty if the file was accepted.
  static std::string refusal(const std::filesystem::path& file, const MeshFileOptions& options = {}) {
    try {
      (void)load_mesh(file, options);
      return {};
    } catch (const MeshError& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
};

std::size_t count_of(const MeshFile& file, const std::string& id) {
  for (const Finding& f : file.findings) {
    if (f.id.starts_with(id)) return f.count;
  }
  return 0;
}

constexpr const char* kTetrahedronObj =
    "# a comment\nmtllib none.mtl\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0\nvn 0 0 1\nvt 0 0\nv 0 0 1\n"
    "f 1 3 2\nf 1/1 2/1 4/1\nf 2//1 3//1 4//1\nf -4/1/1 -1/1/1 -2/1/1\n";
constexpr const char* kTetrahedronOff =
    "OFF # comment\n# another\n4 4 6\n0 0 0\n1 0 0\n\n0 1 0 # here too\n0 0 1\n3 0 2 1\n3 0 1 3 255 0 0\n3 1 "
    "2 3\n"
    "3 0 3 2\n";
constexpr const char* kTetrahedronPly =
    "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty double x\nproperty double y\nproperty "
    "double z\n"
    "property uchar red\nproperty list uchar float extra\nelement face 4\nproperty int flags\n"
    "property list uchar uint vertex_index\nproperty list uchar float texcoord\nelement edge 1\nproperty int "
    "a\n"
    "end_header\n0 0 0 1 0\n1 0 0 1 2 0.5 0.5\n0 1 0 1 0\n0 0 1 1 0\n7 3 0 2 1 0\n7 3 0 1 3 1 0.5\n7 3 1 2 3 "
    "0\n"
    "7 3 0 3 2 0\n5\n";
constexpr const char* kTetrahedronStl =
    "solid t\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n"
    "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
    "facet normal 1 1 1\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n"
    "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
    "t\n";

// Accepts any order of vertices, because it differs between formats.
void expect_tetrahedron(const MeshFile& file, double scale = 1.0) {
  ASSERT_EQ(file.mesh.vertices.size(), 4U);
  ASSERT_EQ(file.mesh.triangles.size(), 4U);
  const std::array<std::array<glm::dvec3, 3>, 4> expected{{{{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}},
                                                           {{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}},
                                                           {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                                                           {{{0, 0, 0}, {0, 0, 1}, {0, 1, 0}}}}};
  for (std::size_t t = 0; t < 4; ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(file.mesh.vertices[file.mesh.triangles[t][c]], expected[t][c] * scale);
    }
  }
}

TEST_F(MeshFiles, EveryFormatAndEveryCaseOfItsName) {
  const std::vector<std::pair<std::string, std::string>> files{{"a.obj", kTetrahedronObj},
                                                               {"a.off", kTetrahedronOff},
                                                               {"a.ply", kTetrahedronPly},
                                                               {"a.stl", kTetrahedronStl}};
  for (const auto& [name, text] : files) {
    SCOPED_TRACE(name);
    const MeshFile file = load_mesh(write(name, text));
    expect_tetrahedron(file);
    EXPECT_TRUE(file.findings.empty());
    expect_tetrahedron(load_mesh(write_gz(name + ".gz", text)));
    std::string shouted = name + ".GZ";
    std::transform(shouted.begin(), shouted.end(), shouted.begin(),
                   [](unsigned char c) { return std::toupper(c); });
    expect_tetrahedron(load_mesh(write_gz(shouted, text), {.scale = 0.001}), 0.001);
  }
}

TEST_F(MeshFiles, CarriageReturnsAreWhiteSpace) {
  for (const auto& [name, text] :
       std::vector<std::pair<std::string, std::string>>{{"a.obj", kTetrahedronObj},
                                                        {"a.off", kTetrahedronOff},
                                                        {"a.ply", kTetrahedronPly},
                                                        {"a.stl", kTetrahedronStl}}) {
    std::string dos;
    for (const char c : text) dos += c == '\n' ? "\r\n" : std::string(1, c);
    SCOPED_TRACE(name);
    expect_tetrahedron(load_mesh(write(name, dos)));
  }
}

TEST_F(MeshFiles, CoordinatesKeepAllTheirDigits) {
  const double x = 1234567.0123456789, tiny = 1e-320;
  const MeshFile obj =
      load_mesh(write("a.obj", "v 1234567.0123456789 0 0\nv 1 1e-320 1e-999\nv 0 +1 0\nf 1 2 3\n"));
  EXPECT_EQ(obj.mesh.vertices[0].x, x);
  EXPECT_EQ(obj.mesh.vertices[1].y, tiny);
  EXPECT_EQ(obj.mesh.vertices[1].z, 0.0);
  EXPECT_EQ(obj.mesh.vertices[2].y, 1.0);
  const MeshFile off =
      load_mesh(write("a.off", "OFF 3 1 0\n1234567.0123456789 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
  EXPECT_EQ(off.mesh.vertices[0].x, x);
  TriangleMesh mesh = make_ball_mesh(x, 2);
  save_ply(path("b.ply"), mesh);
  const MeshFile ply = load_mesh(path("b.ply"));
  EXPECT_EQ(ply.mesh.vertices, mesh.vertices);
  EXPECT_EQ(ply.mesh.triangles, mesh.triangles);
  EXPECT_TRUE(ply.findings.empty());
}

TEST_F(MeshFiles, NonManifoldFacesAreKept) {
  const MeshFile fins = load_mesh(
      write("a.obj",
            "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 3\nf 3 2 1\n"));
  EXPECT_EQ(fins.mesh.triangles.size(), 5U);
  EXPECT_TRUE(fins.findings.empty());
}

TEST_F(MeshFiles, PolygonsThatAllCanBeSeenFromTheirFirstCornerBecomeFans) {
  const MeshFile file =
      load_mesh(write("a.obj", "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 \\\n 4 5\n"));
  const std::vector<TriangleIndices> expected{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
  EXPECT_EQ(file.mesh.triangles, expected);
  EXPECT_EQ(count_of(file, "F06"), 1U);
}

TEST_F(MeshFiles, WhatCannotBeKeptIsLeftOutAndReported) {
  const MeshFile file =
      load_mesh(write("a.obj",
                      "v 0 0 0\nv nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 inf 0\nv 1e999 0 0\nv 1e13 0 0\n"
                      "f 1 3 4\nf 1 2 3\nf 1 3 99\nf 1 3 -99\nf 0 1 3\nf 1 3\nf 1 1 3 1\nf 7 1 3\n"));
  EXPECT_EQ(file.mesh.triangles.size(), 1U);
  EXPECT_EQ(file.mesh.vertices.size(), 3U);
  EXPECT_EQ(count_of(file, "F01"), 4U);
  EXPECT_EQ(count_of(file, "F02"), 2U);
  EXPECT_EQ(count_of(file, "F03"), 3U);
  EXPECT_EQ(count_of(file, "F04"), 1U);
  EXPECT_EQ(count_of(file, "F05"), 1U);
  for (const Finding& f : file.findings) EXPECT_GT(f.text.size(), 40U);
}

TEST_F(MeshFiles, BinaryStlMayBeginWithSolidAndMayHaveATail) {
  const auto facet = [](float x) {
    std::string bytes(50, '\0');
    const std::array<float, 9> corners{x, 0, 0, x + 1, 0, 0, x, 1, 0};
    std::memcpy(bytes.data() + 12, corners.data(), sizeof(corners));
    return bytes;
  };
  const auto stl = [&](std::uint32_t announced, std::uint32_t actual) {
    std::string bytes = "solid but binary";
    bytes.resize(80, ' ');
    bytes.append(reinterpret_cast<const char*>(&announced), 4);
    for (std::uint32_t i = 0; i < actual; ++i) bytes += facet(static_cast<float>(i));
    return bytes;
  };
  const MeshFile good = load_mesh(write("a.stl", stl(3, 3)));
  EXPECT_EQ(good.mesh.triangles.size(), 3U);
  EXPECT_EQ(good.mesh.vertices.size(), 7U) << "equal corners are one vertex";
  std::string not_solid = stl(3, 3) + "tail";
  not_solid[0] = 'X';
  const MeshFile tail = load_mesh(write("b.stl", not_solid));
  EXPECT_EQ(tail.mesh.triangles.size(), 3U);
  EXPECT_EQ(count_of(tail, "F07"), 4U);
  std::string lying = stl(4'000'000'000U, 3);
  lying[0] = 'X';
  EXPECT_NE(refusal(write("c.stl", lying)).find("4000000000"), std::string::npos);
  std::string with_nan = stl(2, 2);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(with_nan.data() + 84 + 12, &nan, 4);
  const MeshFile cleaned = load_mesh(write("d.stl", with_nan));
  EXPECT_EQ(cleaned.mesh.triangles.size(), 1U);
  EXPECT_EQ(count_of(cleaned, "F02"), 1U);
}

TEST_F(MeshFiles, BigEndianPlyAndShortLists) {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "element face 1\nproperty list ushort ushort vertex_indices\nend_header\n";
  const auto put = [&](const void* value, std::size_t size) {
    std::string raw(static_cast<const char*>(value), size);
    bytes.append(raw.rbegin(), raw.rend());
  };
  for (const float f : {0.0F, 0.0F, 0.0F, 1.5F, 0.0F, 0.0F, 0.0F, -2.25F, 0.0F}) put(&f, 4);
  for (const std::uint16_t i : {3, 0, 1, 2}) put(&i, 2);
  const MeshFile file = load_mesh(write("a.ply", bytes));
  ASSERT_EQ(file.mesh.triangles.size(), 1U);
  EXPECT_EQ(file.mesh.vertices[1], glm::dvec3(1.5, 0.0, 0.0));
  EXPECT_EQ(file.mesh.vertices[2], glm::dvec3(0.0, -2.25, 0.0));
}

TEST_F(MeshFiles, RefusalsSayWhatAndWhatToDo) {
  const std::string ply_head = "ply\nformat binary_little_endian 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  struct Case {
    std::string name, bytes, says;
  };
  const std::vector<Case> cases{
      {"a.xyz", "1 2 3", "no mesh format"},
      {"b", "1 2 3", "no mesh format"},
      {"a.obj", "", "is empty"},
      {"b.obj", "v 0 0 0\nv 1 0 0\n", "no triangle"},
      {"c.obj", "v 0 0 0\nv 1 zero 0\n", "line 2"},
      {"d.obj", "v 0 0 0\nf 1 a 2\n", "line 2"},
      {"a.stl", "solid Empty\nendsolid Empty\n", "no triangle"},
      {"b.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "cut short"},
      {"c.stl", "hello", "cut short"},
      {"d.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\nendfacet\n", "line 6"},
      {"a.off", "COFFEE\n", "OFF"},
      {"b.off", "OFF\n4000000000 1 0\n0 0 0\n", "4000000000"},
      {"c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n", "cut short"},
      {"d.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n1000000000 0 1 2\n", "line 6"},
      {"e.off", "OFF BINARY\n", "binary OFF"},
      {"f.off", "4OFF\n1 1 0\n", "three-dimensional"},
      {"a.ply", "ply\nformat ascii 1.0\n", "end_header"},
      {"b.ply",
       ply_head + "element vertex 4000000000\n" + xyz +
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n",
       "4000000000"},
      {"c.ply", ply_head + "element vertex 0\n" + xyz + "end_header\n", "'face'"},
      {"d.ply", ply_head + "element vertex 1\nproperty float x\nelement face 0\nend_header\n123456789012",
       "'y'"},
      {"e.ply",
       ply_head + "element vertex 0\n" + xyz +
           "element face 1\nproperty list uint int vertex_indices\nend_header\n\xff\xff\xff\xff",
       "list announces"},
      {"f.ply", "plyx\n", "ply"},
      {"g.ply",
       ply_head + "element vertex 0\n" + xyz +
           "element face 1\nproperty list float int vertex_indices\nend_header\n",
       "known type"},
      {"a.obj.gz", "v 0 0 0\n", "not gzip"},
  };
  for (const Case& c : cases) {
    const std::string text = refusal(write(c.name, c.bytes));
    EXPECT_NE(text.find(c.says), std::string::npos) << c.name << ": " << text;
    EXPECT_NE(text.find(c.name), std::string::npos) << "the file is named: " << text;
    EXPECT_GT(text.size(), folder_.string().size() + 40) << text;
  }
  EXPECT_NE(refusal(path("missing.stl")).find("no such file"), std::string::npos);
  std::filesystem::create_directory(path("folder.stl"));
  EXPECT_NE(refusal(path("folder.stl")).find("not a file"), std::string::npos);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(refusal(write("s.obj", kTetrahedronObj), {.scale = bad}).empty());
  }
}

TEST_F(MeshFiles, LimitsHoldBeforeMemoryIsTaken) {
  const auto plain = write("a.obj", kTetrahedronObj);
  const std::string text = refusal(plain, {.max_bytes = 100});
  EXPECT_NE(text.find("100 bytes"), std::string::npos) << text;
  // A compression bomb: 200 MB of spaces in 200 kB.
  std::string spaces;
  spaces.resize(200'000'000, ' ');
  const auto bomb = write_gz("bomb.obj.gz", spaces);
  EXPECT_LT(std::filesystem::file_size(bomb), 1'000'000U);
  EXPECT_NE(refusal(bomb, {.max_bytes = 10'000'000}).find("unpacks to more than"), std::string::npos);
  // A truncated file.
  const auto cut = write_gz("cut.obj.gz", std::string(kTetrahedronObj) + std::string(100'000, 'x'));
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) - 20);
  EXPECT_NE(refusal(cut).find("gzip data are damaged or cut short"), std::string::npos) << refusal(cut);
}

TEST_F(MeshFiles, SavingSaysWhyItCannot) {
  EXPECT_THROW(save_ply(path("no/such/folder/a.ply"), make_ball_mesh(1.0, 0)), MeshError);
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_THROW(save_ply("/dev/full", make_ball_mesh(1.0, 5)), MeshError);
  }
}

TEST_F(MeshFiles, WrittenFormatsAreReadAgainInTheirUnit) {
  const TriangleMesh ball = make_ball_mesh(0.0123456789, 2);
  struct Written {
    const char* name;
    void (*write)(const TriangleMesh&, const ByteSink&);
    double unit_m, error_m;
  };
  // STL has floats, and OpenMesh welds equal corners.
  for (const Written& w :
       {Written{"a.ply", write_ply, 1.0, 0.0}, Written{"a.stl", write_stl_in_mm, 1e-3, 1e-9},
        Written{"a.obj", write_obj_in_mm, 1e-3, 1e-17}}) {
    std::string bytes;
    w.write(ball, [&bytes](std::string_view more) { bytes += more; });
    const MeshFile back = load_mesh(write(w.name, bytes), {.scale = w.unit_m});
    EXPECT_TRUE(back.findings.empty()) << w.name;
    ASSERT_EQ(back.mesh.vertices.size(), ball.vertices.size()) << w.name;
    ASSERT_EQ(back.mesh.triangles.size(), ball.triangles.size()) << w.name;
    for (std::size_t t = 0; t < ball.triangles.size(); ++t) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const glm::dvec3 away =
            back.mesh.vertices[back.mesh.triangles[t][corner]] - ball.vertices[ball.triangles[t][corner]];
        EXPECT_LE(glm::length(away), w.error_m) << w.name;
      }
    }
  }
}

TEST_F(MeshFiles, AMeshThatIsNotFinishedLeavesWhatWasThere) {
  save_ply(path("a.ply"), make_ball_mesh(1.0, 0));
  EXPECT_EQ(load_mesh(path("a.ply")).mesh.triangles.size(), 20U);
  save_ply(path("a.ply"), make_ball_mesh(1.0, 1));
  EXPECT_EQ(load_mesh(path("a.ply")).mesh.triangles.size(), 80U);
  EXPECT_EQ(
      std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator()), 1);
}

// The expected counts are from the data sets' own list, which another program made.
TEST(SharedMeshes, LoadWithTheirDocumentedCounts) {
  const auto folder = tests::shared_data("data");
  SKIP_WITHOUT(folder);
  struct Case {
    const char* file;
    std::size_t vertices, triangles;
    std::size_t left_out = 0;
    const char* finding = "";
    std::size_t found = 0;
  };
  const std::vector<Case> cases{
      {"meshes/adis16480_cad.stl.gz", 3672, 7436},
      {"meshes/allen_brain_1M.ply.gz", 540751, 1082098},
      {"meshes/fandisk.obj", 2877, 5750},
      {"meshes/fixed_top.ply", 2374, 4772},
      {"meshes/hammer.obj.gz", 30082, 60160},
      {"meshes/mountain.obj.gz", 25600, 50562},
      {"meshes/pelvis_coarse.ply.gz", 93931, 187934},
      {"meshes/skull.obj.gz", 49999, 100002},
      {"meshes/sword.obj.gz", 22293, 44582},
      {"meshes/tray_bottom_thin.stl.gz", 2216, 4520},
      {"meshes/vertebra_T12.ply", 21364, 42728},
      {"meshes/wingnut.obj", 3047, 6090},
      {"meshes_bad/bunny_nonmanifold.ply.gz", 8171, 16301},
      {"meshes_bad/chair_doublefaced.obj.gz", 3186, 12756},
      {"meshes_bad/cycloidal.ply.gz", 21384, 43368},
      {"meshes_bad/featuretype.STL", 2010, 3476},
      {"meshes_bad/idler_riser.STL", 803, 1572},
      {"meshes_bad/joined_tetrahedra.obj", 5, 8},
      {"meshes_bad/multibody.stl", 20, 32},
      {"meshes_bad/not_convex.obj", 288, 96},
      {"meshes_bad/notenoughindices.obj", 3, 1, 0, "F04", 1},
      {"meshes_bad/plane_holes.obj.gz", 8519, 16747},
      {"meshes_bad/soup.stl", 300, 100},
      {"meshes_bad/syn_degenerate_faces.ply", 2562, 5123},
      {"meshes_bad/syn_duplicate_faces.ply", 2562, 5420},
      {"meshes_bad/syn_half_flipped.ply", 2562, 5120},
      {"meshes_bad/syn_hole_pole.ply", 2562, 4970},
      {"meshes_bad/syn_index_out_of_range.ply", 2562, 5120, 2, "F03", 2},
      {"meshes_bad/syn_inside_out.ply", 2562, 5120},
      {"meshes_bad/syn_nan_inf_vertices.ply", 2562 - 4, 5120, 22, "F01", 4},
      {"meshes_bad/syn_open_sheet_zero_thickness.ply", 1681, 3200},
      {"meshes_bad/syn_soup_duplicated_vertices.ply", 15360, 5120},
      {"meshes_bad/syn_two_spheres_intersecting.ply", 5124, 10240},
      {"meshes_bad/wallhole.obj", 92, 66},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.file);
    const MeshFile file = load_mesh(folder / c.file);
    EXPECT_EQ(file.mesh.vertices.size(), c.vertices);
    EXPECT_EQ(file.mesh.triangles.size(), c.triangles - c.left_out);
    if (c.found > 0) {
      EXPECT_EQ(count_of(file, c.finding), c.found);
    }
    for (const Finding& f : file.findings) {
      EXPECT_TRUE(f.id.starts_with("F06") || c.found > 0) << f.id << ' ' << f.count << ' ' << f.text;
    }
  }
  try {
    (void)load_mesh(folder / "meshes_bad/empty.stl");
    ADD_FAILURE() << "empty.stl has nothing to touch";
  } catch (const MeshError& error) {
    EXPECT_NE(std::string(error.what()).find("no triangle"), std::string::npos) << error.what();
  }
}

}  // namespace
