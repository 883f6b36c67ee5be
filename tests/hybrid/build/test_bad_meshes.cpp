// SPDX-License-Identifier: GPL-3.0-or-later
// Damaged meshes, as loaded and as repaired: the findings, the changes by repair, the remaining findings, and
// a finite, bounded force on a ball that presses and slides on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <vector>

#include "polygon/files/mesh_file.h"
#include "polygon/mesh/triangle.h"
#include "polygon/repair/check.h"
#include "tests/hybrid/fixtures/touch.h"
#include "tests/polygon/fixtures/findings.h"
#include "tests/shared_data.h"

namespace {

using glm::dvec3;

constexpr double kStiffness = 1000.0;  // N/m
constexpr double kSize = 0.1;          // m; every mesh is scaled to this size

struct Expected {
  const char* file;
  const char* found;  // findings of loading and of a check, including self-intersections
  const char* did;    // changes by repair
  const char* left;   // findings of a second check
  bool solid_after;   // true: closed and oriented outward after repair
};

const std::vector<Expected>& expected() {
  static const std::vector<Expected> list{
      {"bunny_nonmanifold.ply.gz", "M03 87, M05 25, M06 150, M07 298, M09 5, M12 2",
       "R16 25, R03 87, R13 3, R04 5, R05 254, R06 114, R15 2, R14 70, R10 144",
       "M04 194, M06 125, M07 130, M09 70, M12 2", false},
      {"chair_doublefaced.obj.gz", "M03 6382, M04 28, M06 9518, M07 19036, M10 3, M12 638",
       "R01 28, R03 6382, R04 30, R05 129, R06 78, R15 638, R14 2, R10 10",
       "M04 54, M06 51, M07 78, M09 2, M10 3, M12 638", false},
      {"cycloidal.ply.gz", "M06 242, M07 484, M08 26, M10 100, M12 54960",
       "R05 750, R06 52, R15 54960, R17 242", "M04 702, M06 242, M07 484, M08 26, M10 100, M12 54960", false},
      {"empty.stl", "", "", "", false},
      {"featuretype.STL", "M09 16, M12 1216", "R12 288, R09 1", "", true},
      {"idler_riser.STL", "M08 1, M09 3, M10 2, M12 58", "R12 22, R09 1", "", true},
      {"joined_tetrahedra.obj", "M03 1, M06 3, M07 6", "R03 1, R05 6, R17 3", "M04 6, M06 3, M07 3", false},
      {"multibody.stl", "M07 12, M10 2", "R04 6, R08 2, R09 1", "M10 2", true},
      {"not_convex.obj", "M04 244, M06 12, M07 24, M12 156", "R01 244, R05 28, R15 156, R17 12",
       "M04 28, M06 12, M07 24, M12 156", false},
      {"notenoughindices.obj", "F04 1, M09 1", "R14 1, R10 3", "M09 1", false},
      {"plane_holes.obj.gz", "M09 27", "R13 27, R09 1", "", true},
      {"soup.stl", "M09 100, M10 100, M12 1248", "R15 1248, R14 100, R10 300", "M09 100, M10 100, M12 1248",
       false},
      {"syn_degenerate_faces.ply", "M01 3", "R02 3, R09 1", "", true},
      {"syn_duplicate_faces.ply", "M03 300, M06 336, M07 600", "R03 300, R09 1", "", true},
      {"syn_half_flipped.ply", "M07 3864", "R04 2560, R09 1", "", true},
      {"syn_hole_pole.ply", "M05 57, M09 1", "R16 57, R13 1, R09 1", "", true},
      {"syn_index_out_of_range.ply", "F03 2, M09 2", "R13 2, R09 1", "", true},
      {"syn_inside_out.ply", "M11 1", "R08 1, R09 1", "", true},
      {"syn_nan_inf_vertices.ply", "F01 4, F02 22, M09 4", "R13 4, R09 1", "", true},
      {"syn_open_sheet_zero_thickness.ply", "M09 1", "R14 1, R10 160", "M09 1", false},
      {"syn_soup_duplicated_vertices.ply", "M04 12798", "R01 12798, R09 1", "", true},
      {"syn_two_spheres_intersecting.ply", "M10 2, M12 498", "R15 498, R09 1", "M10 2, M12 498", true},
      {"wallhole.obj", "F06 13, M04 57", "R01 57, R09 1", "", true},
  };
  return list;
}

struct Box {
  dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

Box box_of(const polygon::TriangleMesh& mesh) {
  Box box;
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    for (const std::uint32_t corner : t) {
      box.low = glm::min(box.low, mesh.vertices[corner]);
      box.high = glm::max(box.high, mesh.vertices[corner]);
    }
  }
  return box;
}

// Presses the ball 2 mm into triangles all over the mesh, from both sides, slides 5 mm along each triangle,
// and leaves.
void press_and_slide(const std::filesystem::path& file, double unit_m, bool repair) {
  hybrid::Scene scene;
  scene.file = "in the test";
  scene.rigid = {{.name = "mesh",
                  .source = hybrid::MeshSource{.file = file, .unit_m = unit_m, .repair = repair},
                  .pose = {},
                  .place = {},
                  .source_place = {}}};
  scene.tool = {.shape = hybrid::Tool::Shape::ball, .radius_m = 2e-3, .stiffness_N_per_m = kStiffness};
  scene.device_model = device::DeviceModel::ideal;
  scene.max_force_given = true;
  scene.safety = {.max_force_N = 8.5, .max_slew_N_per_s = 1e15, .soft_start_s = 0.0};

  polygon::TriangleMesh mesh = polygon::load_mesh(file, {.scale = unit_m}).mesh;
  if (repair) mesh = polygon::repair_mesh(mesh).mesh;
  const Box box = box_of(mesh);
  const dvec3 middle = 0.5 * (box.low + box.high);
  const dvec3 outside = box.high + dvec3(0.02);
  tests::Touch touch(scene, outside);
  std::uint64_t in_contact = 0, ticks = 0;
  double largest_N = 0.0;
  const auto look = [&](const hybrid::TickResult& felt) {
    ++ticks;
    ASSERT_TRUE(tests::finite(felt.force_N) && tests::finite(felt.proxy_m));
    const double force = glm::length(felt.force_N);
    // The felt force comes from the coupling alone, and is within the device's limit.
    ASSERT_LE(force, 8.5 * (1.0 + 1e-9));
    ASSERT_LE(glm::length(tests::coupling(felt) - kStiffness * (felt.proxy_m - felt.device_m)),
              1e-6 * kStiffness * kSize);
    ASSERT_LE(glm::length(felt.proxy_m - felt.device_m), 3.0 * kSize) << "the proxy stays by the mesh";
    in_contact += felt.contacts != 0 ? 1 : 0;
    largest_N = std::max(largest_N, force);
  };
  constexpr std::size_t kPlaces = 12;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const polygon::TriangleIndices& t = mesh.triangles[i * mesh.triangles.size() / kPlaces];
    const dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    if (polygon::is_degenerate(a, b, c)) continue;
    const dvec3 at = (a + b + c) / 3.0;
    dvec3 normal = glm::normalize(glm::cross(b - a, c - a));
    if (glm::dot(normal, at - middle) < 0.0) normal = -normal;
    if (i % 3 == 2)
      normal = -normal;  // also from the inner side, which the tool cannot reach in a closed mesh
    const dvec3 along = glm::normalize(b - a);
    touch.go(at + 0.02 * normal, 5e-3, 0, look);
    touch.go(at - 2e-3 * normal, 1e-3, 5, look);
    touch.go(at - 2e-3 * normal + 5e-3 * along, 1e-3, 5, look);
    touch.go(at + 0.02 * normal, 5e-3, 0, look);
    touch.go(outside, 0.02, 2, look);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(in_contact, 0U) << "of " << ticks << " ticks";
  EXPECT_GT(largest_N, 0.5);
  EXPECT_EQ(touch.state().nonfinite, 0U);
  EXPECT_EQ(touch.state().faults, 0U);
}

class BadMeshes : public testing::TestWithParam<Expected> {};

TEST_P(BadMeshes, AreFoundRepairedAndTouched) {
  const std::filesystem::path folder = tests::shared_data("data/meshes_bad");
  SKIP_WITHOUT(folder);
  const Expected& e = GetParam();
  const std::filesystem::path file = folder / e.file;
  if (std::string(e.found).empty()) {
    EXPECT_THROW(polygon::load_mesh(file), polygon::MeshError);
    return;
  }
  const polygon::MeshFile loaded = polygon::load_mesh(file);
  const polygon::MeshCheck before = polygon::check_mesh(loaded.mesh, true);
  std::vector<polygon::Finding> found = loaded.findings;
  found.insert(found.end(), before.findings.begin(), before.findings.end());
  EXPECT_EQ(tests::in_short(found), e.found);

  const polygon::RepairedMesh repaired = polygon::repair_mesh(loaded.mesh);
  EXPECT_EQ(tests::in_short(repaired.changes), e.did);
  const polygon::MeshCheck after = polygon::check_mesh(repaired.mesh, true);
  EXPECT_EQ(tests::in_short(after.findings), e.left);
  EXPECT_EQ(after.oriented, e.solid_after);
  for (const std::vector<polygon::Finding>* list : {&before.findings, &repaired.changes, &after.findings}) {
    for (const polygon::Finding& f : *list) EXPECT_TRUE(f.place || f.id.starts_with("R09")) << f.id;
  }

  const Box box = box_of(loaded.mesh);
  const double unit_m = kSize / glm::length(box.high - box.low);
  for (const bool repair : {false, true}) {
    SCOPED_TRACE(repair ? "repaired" : "as it came");
    press_and_slide(file, unit_m, repair);
  }
}

INSTANTIATE_TEST_SUITE_P(Shared, BadMeshes, testing::ValuesIn(expected()),
                         [](const testing::TestParamInfo<Expected>& tested) {
                           std::string name = tested.param.file;
                           std::replace_if(
                               name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; },
                               '_');
                           return name;
                         });

}  // namespace
