// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench rigid` on meshes from files: their size, their paths, and the refusal of a wrong file.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/bench/meshes.h"
#include "hybrid/bench/rigid.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using glm::dvec3;
using namespace hybrid::bench;  // NOLINT(google-build-using-namespace): the tests use this namespace only

class BenchOwnMesh : public tests::SceneFile {
 protected:
  // Runs the paths on a mesh that is saved to a file with unchanged coordinates.
  std::vector<RigidRow> rows_of(const polygon::TriangleMesh& mesh, double unit_m = 1e-3) {
    polygon::save_ply(folder_ / "own.ply", mesh);
    RigidBenchOptions options;
    options.quick = true;
    options.meshes = {(folder_ / "own.ply").string()};
    options.mesh_unit_m = unit_m;
    options.engines = {Engine::hybrid};
    options.on_note = [this](const std::string& note) { notes_ += note + "\n"; };
    return bench_rigid(options);
  }
  std::string notes_;
};

TEST_F(BenchOwnMesh, AFileIsTouchedAtItsOwnSizeWithoutAnErrorAHandCouldFeel) {
  // A box of 80 x 40 x 20 mm that lies far from the origin of its file.
  polygon::TriangleMesh box = polygon::make_box_mesh({40.0, 20.0, 10.0}, 4);
  for (dvec3& v : box.vertices) v += dvec3(100.0, -50.0, 7.0);
  const std::vector<RigidRow> rows = rows_of(box);
  std::set<std::string> paths;
  for (const RigidRow& row : rows) {
    SCOPED_TRACE(row.path);
    paths.insert(row.path);
    EXPECT_EQ(row.mesh, (folder_ / "own.ply").string());
    EXPECT_EQ(row.triangles, 12U * 16U);
    EXPECT_EQ(row.scale, 1.0);
    EXPECT_TRUE(row.radius_m == 0.0 || std::abs(row.radius_m - 0.002) < 1e-12 || row.radius_m < 0.002);
    EXPECT_EQ(row.ticks, row.path_ticks);
    ASSERT_TRUE(row.judged.error_mesh_max.has_value());
    EXPECT_LE(*row.judged.error_mesh_max, 1e-7);
    EXPECT_EQ(row.judged.inside_ticks, std::size_t{0});
    EXPECT_EQ(row.judged.pop_throughs, std::size_t{0});
    if (row.path == "slide") {
      EXPECT_GT(row.judged.contact_ticks, row.ticks / 2);
    }
    if (row.path == "far") {
      EXPECT_EQ(row.judged.contact_ticks, 0U);
    }
    if (row.path != "tap") {
      EXPECT_NEAR(row.speed_m_s, 0.1, 1e-12);
    }
  }
  EXPECT_EQ(paths, (std::set<std::string>{"far", "slide", "tap", "moving"}));
  EXPECT_EQ(notes_, "");
}

TEST_F(BenchOwnMesh, TheUnitScalesTheMeshAndNotTheTool) {
  const polygon::TriangleMesh ball = polygon::make_ball_mesh(0.05, 3);  // the file's unit is the meter
  for (const RigidRow& row : rows_of(ball, 1.0)) {
    EXPECT_TRUE(row.radius_m == 0.0 || std::abs(row.radius_m - 0.002) < 1e-12) << row.radius_m;
  }
}

TEST_F(BenchOwnMesh, AnOpenSheetHasNoInside) {
  const BenchMesh corner = make_bench_mesh("corner4", 1e3);
  for (const RigidRow& row : rows_of(corner.mesh)) {
    EXPECT_FALSE(row.judged.inside_ticks.has_value());
    EXPECT_TRUE(to_json(row)["inside_ticks"].is_null());
    ASSERT_TRUE(row.judged.error_mesh_max.has_value());
    EXPECT_LE(*row.judged.error_mesh_max, 1e-7) << row.path;
  }
}

TEST_F(BenchOwnMesh, DefectsOfAFileAreSaid) {
  polygon::TriangleMesh box = polygon::make_box_mesh({40.0, 20.0, 10.0}, 2);
  std::swap(box.triangles[0][0], box.triangles[0][1]);
  rows_of(box);
  EXPECT_NE(notes_.find("own.ply: M"), std::string::npos) << notes_;
}

TEST_F(BenchOwnMesh, AFileThatCannotBeReadIsNamed) {
  for (const char* name : {"gone.obj", "folder/gone.ply", "words.txt"}) {
    write("words.txt", "no mesh");
    RigidBenchOptions options;
    options.quick = true;
    options.meshes = {(folder_ / name).string()};
    try {
      bench_rigid(options);
      FAIL() << name;
    } catch (const polygon::MeshError& e) {
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
    }
  }
}

}  // namespace
