// SPDX-License-Identifier: GPL-3.0-or-later
// Every check on meshes with known defects, and on the data sets.
#include "polygon/repair/check.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <numbers>

#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"
#include "tests/polygon/fixtures/findings.h"
#include "tests/shared_data.h"

namespace {

using namespace polygon;

using tests::count_of;

void append(TriangleMesh& mesh, const TriangleMesh& other, const glm::dvec3& offset, bool turned = false) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const glm::dvec3& v : other.vertices) mesh.vertices.push_back(v + offset);
  for (const auto& [a, b, c] : other.triangles) {
    mesh.triangles.push_back(turned ? TriangleIndices{base + a, base + c, base + b}
                                    : TriangleIndices{base + a, base + b, base + c});
  }
}

TEST(CheckMesh, APerfectMeshHasNoFindings) {
  const MeshCheck check = check_mesh(make_ball_mesh(0.1, 3), true);
  EXPECT_TRUE(check.findings.empty());
  EXPECT_TRUE(check.closed);
  EXPECT_TRUE(check.oriented);
}

TEST(CheckMesh, AnEmptyMeshIsNamed) {
  EXPECT_EQ(count_of(check_mesh({}).findings, "M00"), 1U);
  EXPECT_TRUE(repair_mesh({}).mesh.empty());
}

TEST(CheckMesh, EachDefectIsCountedAndPlaced) {
  const TriangleMesh ball = make_ball_mesh(1.0, 2);

  TriangleMesh holed = ball;
  holed.triangles.erase(holed.triangles.begin());
  holed.triangles.pop_back();
  MeshCheck check = check_mesh(holed);
  EXPECT_FALSE(check.closed);
  EXPECT_EQ(check.volume_m3, 0.0);
  EXPECT_EQ(count_of(check.findings, "M09"), 2U);

  TriangleMesh turned = ball;
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  check = check_mesh(turned);
  EXPECT_TRUE(check.closed);
  EXPECT_FALSE(check.oriented);
  EXPECT_EQ(count_of(check.findings, "M07"), 3U);

  TriangleMesh fin = ball;
  fin.vertices.emplace_back(5.0, 0.0, 0.0);
  fin.triangles.push_back(
      {fin.triangles[0][0], fin.triangles[0][1], static_cast<std::uint32_t>(fin.vertices.size() - 1)});
  check = check_mesh(fin);
  EXPECT_FALSE(check.closed);
  EXPECT_EQ(count_of(check.findings, "M06"), 1U);

  TriangleMesh kissing = make_box_mesh(glm::dvec3(0.5), 1);
  append(kissing, make_box_mesh(glm::dvec3(0.5), 1), glm::dvec3(1.0));
  check = check_mesh(kissing, true);
  EXPECT_TRUE(check.closed);
  EXPECT_TRUE(check.oriented);
  EXPECT_EQ(count_of(check.findings, "M08"), 1U) << "they touch in a corner";
  EXPECT_NEAR(check.volume_m3, 2.0, 1e-14);
  EXPECT_EQ(count_of(check.findings, "M12"), 0U);

  TriangleMesh hollow = make_ball_mesh(1.0, 3);
  append(hollow, make_ball_mesh(0.5, 3), glm::dvec3(0.0), true);
  check = check_mesh(hollow, true);
  EXPECT_TRUE(check.oriented);
  EXPECT_EQ(count_of(check.findings, "M10"), 2U);
  EXPECT_EQ(count_of(check.findings, "M11"), 1U) << "a cavity, as information";
  EXPECT_EQ(count_of(check.findings, "M12"), 0U);

  TriangleMesh crossing = make_box_mesh(glm::dvec3(0.5), 1);
  append(crossing, make_box_mesh(glm::dvec3(0.5), 1), glm::dvec3(0.3, 0.2, 0.1));
  EXPECT_EQ(count_of(check_mesh(crossing).findings, "M12"), 0U) << "only looked for when asked";
  EXPECT_GT(count_of(check_mesh(crossing, true).findings, "M12"), 0U);

  for (const Finding& f : check_mesh(crossing, true).findings) {
    EXPECT_NE(f.text.find(") m)"), std::string::npos) << "a place: " << f.text;
    EXPECT_TRUE(f.place.has_value()) << f.id;
  }
}

// Each defect is reported at its place.
TEST(CheckMesh, PlacesAreWhereTheDefectsAre) {
  const TriangleMesh ball = make_ball_mesh(1.0, 3);
  const auto middle = [&](std::size_t i) {
    const auto& [a, b, c] = ball.triangles[i];
    return (ball.vertices[a] + ball.vertices[b] + ball.vertices[c]) / 3.0;
  };
  TriangleMesh bad = ball;
  bad.triangles.push_back(ball.triangles[77]);
  bad.triangles.push_back({5, 5, 6});
  std::vector<Finding> findings = check_mesh(bad).findings;
  const Finding* duplicate = tests::find_finding(findings, "M03");
  ASSERT_TRUE(duplicate != nullptr && duplicate->place);
  EXPECT_EQ(duplicate->place->triangle, ball.triangles.size());
  EXPECT_LT(glm::length(duplicate->place->first_m - middle(77)), 1e-15);
  EXPECT_EQ(tests::find_finding(findings, "M01")->place->triangle, ball.triangles.size() + 1);

  TriangleMesh holed = ball;  // two holes; the larger hole is the reported place
  const auto [a, b, c] = ball.triangles[100];
  std::erase_if(holed.triangles, [&, corner = a](const TriangleIndices& t) {
    return t[0] == corner || t[1] == corner || t[2] == corner || t == ball.triangles[500];
  });
  findings = check_mesh(holed).findings;
  const Finding* holes = tests::find_finding(findings, "M09");
  ASSERT_TRUE(holes != nullptr && holes->place);
  EXPECT_EQ(holes->count, 2U);
  EXPECT_LT(glm::length(holes->place->first_m - ball.vertices[a]), 0.05);
  EXPECT_LE(holes->place->lower_m.x, middle(500).x + 0.05);
  EXPECT_GE(holes->place->upper_m.x, middle(500).x - 0.05);

  TriangleMesh crossing = ball;
  append(crossing, make_ball_mesh(0.2, 2), {1.0, 0.0, 0.0});
  findings = check_mesh(crossing, true).findings;
  const Finding* cuts = tests::find_finding(findings, "M12");
  ASSERT_TRUE(cuts != nullptr && cuts->place);
  for (const glm::dvec3& corner : {cuts->place->lower_m, cuts->place->upper_m, cuts->place->first_m}) {
    EXPECT_LT(glm::length(corner - glm::dvec3(1.0, 0.0, 0.0)), 0.4);
  }
}

TEST(CheckMesh, VolumeFarFromTheOrigin) {
  TriangleMesh far;
  append(far, make_box_mesh(glm::dvec3(0.5), 4), glm::dvec3(1e6, -1e6, 1e6));
  const MeshCheck check = check_mesh(far);
  EXPECT_TRUE(check.oriented);
  EXPECT_NEAR(check.volume_m3, 1.0, 1e-8);
}

TEST(RepairMesh, ASoupOfTurnedAndRepeatedTrianglesBecomesABall) {
  std::mt19937_64 random(31);
  const TriangleMesh ball = make_ball_mesh(1.0, 3);
  TriangleMesh soup;
  for (std::size_t i = 0; i < ball.triangles.size(); ++i) {
    for (int copy = 0; copy < (i % 10 == 3 ? 3 : 1); ++copy) {
      const auto base = static_cast<std::uint32_t>(soup.vertices.size());
      for (const std::uint32_t corner : ball.triangles[i]) soup.vertices.push_back(ball.vertices[corner]);
      soup.triangles.push_back(random() % 2 == 0 ? TriangleIndices{base, base + 1, base + 2}
                                                 : TriangleIndices{base, base + 2, base + 1});
    }
    if (i % 50 == 0)
      soup.triangles.push_back({0, 0, static_cast<std::uint32_t>(3 * i % soup.vertices.size())});
  }
  const TriangleMesh input = soup;
  const RepairedMesh repaired = repair_mesh(soup);
  EXPECT_EQ(soup.vertices, input.vertices) << "the input is left alone";
  const MeshCheck check = check_mesh(repaired.mesh, true);
  EXPECT_TRUE(check.findings.empty()) << check.findings.front().text;
  EXPECT_TRUE(check.oriented);
  EXPECT_EQ(repaired.mesh.triangles.size(), ball.triangles.size());
  EXPECT_EQ(repaired.mesh.vertices.size(), ball.vertices.size());
  EXPECT_NEAR(check.volume_m3, tests::signed_volume(ball), 1e-12);
  EXPECT_EQ(count_of(repaired.changes, "R03"), 2 * ball.triangles.size() / 10);
  EXPECT_EQ(count_of(repaired.changes, "R09"), 1U);
  EXPECT_GT(count_of(repaired.changes, "R04"), 0U);
}

TEST(RepairMesh, CavitiesStayCavitiesAndInsideOutIsTurned) {
  TriangleMesh hollow;
  append(hollow, make_ball_mesh(1.0, 3), glm::dvec3(0.0), true);
  append(hollow, make_ball_mesh(0.5, 3), glm::dvec3(0.0), true);
  const RepairedMesh repaired = repair_mesh(hollow);
  const MeshCheck check = check_mesh(repaired.mesh);
  EXPECT_TRUE(check.oriented);
  const double expected =
      tests::signed_volume(make_ball_mesh(1.0, 3)) - tests::signed_volume(make_ball_mesh(0.5, 3));
  EXPECT_NEAR(check.volume_m3, expected, 1e-12);
  EXPECT_EQ(count_of(repaired.changes, "R08"), 1U);
}

TEST(RepairMesh, AnOpenSheetStaysOpenAndIsSaidToBe) {
  const RepairedMesh repaired = repair_mesh(make_plane_mesh(1.0, 3));
  EXPECT_EQ(repaired.mesh.triangles.size(), 18U);
  EXPECT_EQ(count_of(repaired.changes, "R10"), 12U);
}

struct Documented {
  const char* file;
  bool closed, consistent;
  std::size_t boundary_edges, nonmanifold_edges, doubly_directed, pieces, duplicates, coincident,
      intersections;
  double volume;  // signed; compared only for a closed, consistently oriented mesh
};

// Values from the data sets' own list, which another program made with exact predicates.
const std::vector<Documented>& documented() {
  static const std::vector<Documented> list{
      {"meshes/adis16480_cad.stl.gz", true, true, 0, 0, 0, 1, 0, 0, 0, 2.819e-05},
      {"meshes/fandisk.obj", true, true, 0, 0, 0, 1, 0, 0, 0, 0.6794},
      {"meshes/fixed_top.ply", true, true, 0, 0, 0, 1, 0, 0, 0, 2.645e4},
      {"meshes/hammer.obj.gz", true, true, 0, 0, 0, 1, 0, 0, 0, 3.54},
      {"meshes/mountain.obj.gz", false, true, 636, 0, 0, 1, 0, 0, 0, 0.0},
      {"meshes/skull.obj.gz", true, true, 0, 0, 0, 1, 0, 0, 0, 563.4},
      {"meshes/tray_bottom_thin.stl.gz", true, true, 0, 0, 0, 1, 0, 0, 0, 3.479e5},
      {"meshes/wingnut.obj", true, true, 0, 0, 0, 1, 0, 0, 3, 22.1},
      {"meshes_bad/bunny_nonmanifold.ply.gz", false, false, 123, 150, 298, 1, 87, 0, 2, 0.0},
      {"meshes_bad/chair_doublefaced.obj.gz", false, false, 0, 9518, 19036, 3, 6382, 28, 638, 0.0},
      {"meshes_bad/cycloidal.ply.gz", false, false, 0, 242, 484, 100, 0, 0, 54960, 0.0},
      {"meshes_bad/featuretype.STL", false, true, 576, 0, 0, 1, 0, 0, 1216, 0.0},
      {"meshes_bad/idler_riser.STL", false, true, 44, 0, 0, 2, 0, 0, 58, 0.0},
      {"meshes_bad/joined_tetrahedra.obj", false, false, 0, 3, 6, 1, 1, 0, 0, 0.0},
      {"meshes_bad/multibody.stl", true, false, 0, 0, 12, 2, 0, 0, 0, 0.003698},
      {"meshes_bad/not_convex.obj", false, false, 0, 12, 24, 1, 0, 244, 156, 0.0},
      {"meshes_bad/plane_holes.obj.gz", false, true, 341, 0, 0, 1, 0, 0, 0, 0.0},
      {"meshes_bad/soup.stl", false, true, 300, 0, 0, 100, 0, 0, 1248, 0.0},
      {"meshes_bad/syn_degenerate_faces.ply", true, true, 0, 0, 0, 1, 0, 0, 0, 4.18},
      {"meshes_bad/syn_duplicate_faces.ply", false, false, 0, 336, 600, 1, 300, 0, 0, 0.0},
      {"meshes_bad/syn_half_flipped.ply", true, false, 0, 0, 3864, 1, 0, 0, 0, -0.0006945},
      {"meshes_bad/syn_hole_pole.ply", false, true, 38, 0, 0, 1, 0, 0, 0, 0.0},
      {"meshes_bad/syn_index_out_of_range.ply", false, true, 6, 0, 0, 1, 0, 0, 0, 0.0},
      {"meshes_bad/syn_inside_out.ply", true, true, 0, 0, 0, 1, 0, 0, 0, -4.18},
      {"meshes_bad/syn_open_sheet_zero_thickness.ply", false, true, 160, 0, 0, 1, 0, 0, 0, 0.0},
      {"meshes_bad/syn_soup_duplicated_vertices.ply", true, true, 0, 0, 0, 1, 0, 12798, 0, 4.18},
      {"meshes_bad/syn_two_spheres_intersecting.ply", true, true, 0, 0, 0, 2, 0, 0, 498, 8.359},
  };
  return list;
}

TEST(SharedMeshes, HaveTheirDocumentedDefects) {
  const auto folder = tests::shared_data("data");
  SKIP_WITHOUT(folder);
  for (const Documented& d : documented()) {
    SCOPED_TRACE(d.file);
    const MeshCheck check = check_mesh(load_mesh(folder / d.file).mesh, true);
    const auto count = [&](const char* id) { return count_of(check.findings, id); };
    EXPECT_EQ(check.closed, d.closed);
    EXPECT_EQ(check.oriented, d.closed && d.consistent && d.volume > 0.0);
    if (d.closed && d.consistent) {
      EXPECT_NEAR(check.volume_m3, d.volume, 1e-3 * std::abs(d.volume));
    }
    EXPECT_EQ(count("M06"), d.nonmanifold_edges);
    EXPECT_EQ(count("M07"), d.doubly_directed);
    EXPECT_EQ(count("M10"), d.pieces == 1 ? 0 : d.pieces);
    EXPECT_EQ(count("M03"), d.duplicates);
    EXPECT_EQ(count("M04"), d.coincident);
    EXPECT_EQ(count("M12"), d.intersections);
    EXPECT_EQ(count("M09") > 0, d.boundary_edges > 0);
    for (const Finding& f : check.findings) {
      if (f.id.starts_with("M09")) {
        EXPECT_NE(f.text.find(" " + std::to_string(d.boundary_edges) + " edges"), std::string::npos)
            << f.text;
      }
    }
  }
}

}  // namespace
