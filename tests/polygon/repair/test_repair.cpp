// SPDX-License-Identifier: GPL-3.0-or-later
// Each repair step against a mesh whose intact form is known, and against meshes that must stay unchanged.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <random>

#include "polygon/mesh/triangle.h"
#include "polygon/repair/check.h"
#include "polygon/repair/repair_soup.h"
#include "polygon/repair/self_intersections.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"
#include "tests/polygon/fixtures/findings.h"

namespace {

using namespace polygon;
using tests::count_of;
using tests::find_finding;

// Separates all triangles, and moves each corner by at most `gap` per coordinate.
TriangleMesh cracked(const TriangleMesh& mesh, double gap, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> off(-0.5 * gap, 0.5 * gap);
  TriangleMesh soup;
  for (const TriangleIndices& t : mesh.triangles) {
    const auto base = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t corner : t) {
      soup.vertices.push_back(mesh.vertices[corner] + glm::dvec3(off(random), off(random), off(random)));
    }
    soup.triangles.push_back({base, base + 1, base + 2});
  }
  return soup;
}

TEST(RepairCracks, ASoupOfNearlyEqualCornersBecomesASolid) {
  for (const double size : {1e-3, 1.0, 1e3}) {
    const TriangleMesh ball = make_ball_mesh(size, 3);
    const TriangleMesh soup = cracked(ball, 3e-7 * size, 5);
    ASSERT_FALSE(check_mesh(soup).closed);
    const RepairedMesh repaired = repair_mesh(soup);
    const MeshCheck check = check_mesh(repaired.mesh, true);
    EXPECT_TRUE(check.oriented) << tests::in_short(repaired.changes) << " | "
                                << tests::in_short(check.findings);
    EXPECT_TRUE(check.findings.empty()) << tests::in_short(check.findings);
    EXPECT_EQ(repaired.mesh.vertices.size(), ball.vertices.size());
    EXPECT_EQ(count_of(repaired.changes, "R12"), ball.triangles.size() * 3 / 2);
    EXPECT_NEAR(check.volume_m3, tests::signed_volume(ball), 1e-5 * size * size * size);
    EXPECT_EQ(count_of(repaired.changes, "R14"), 0U);
  }
}

TEST(RepairCracks, WiderOnesStayOpenAndNothingMoves) {
  const TriangleMesh ball = make_ball_mesh(1.0, 2);
  const TriangleMesh soup = cracked(ball, 1e-4, 6);
  const RepairedMesh repaired = repair_mesh(soup);
  EXPECT_EQ(count_of(repaired.changes, "R12"), 0U);
  EXPECT_EQ(repaired.mesh.vertices, soup.vertices);
  EXPECT_EQ(count_of(repaired.changes, "R14"), ball.triangles.size()) << "every triangle has its own rim";
}

// Two sheets are closer together than the tolerance, edge beside edge. Some pairings of edges are ambiguous,
// and no triangle may be lost.
TEST(RepairCracks, NoTriangleIsLostWhereSheetsLieTogether) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> off(-2e-6, 2e-6);
    TriangleMesh mesh = cracked(make_box_mesh(glm::dvec3(0.5), 2), 1e-7, seed);
    for (glm::dvec3& v : mesh.vertices) {
      if (random() % 4 == 0) v += glm::dvec3(off(random), off(random), off(random));
    }
    for (int i = 0; i < 40; ++i) {  // fins, some of them thinner than the tolerance
      const TriangleIndices t = mesh.triangles[random() % mesh.triangles.size()];
      const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const std::uint32_t corner : t) {
        mesh.vertices.push_back(mesh.vertices[corner] + glm::dvec3(off(random), off(random), off(random)));
      }
      mesh.vertices[base] = mesh.vertices[base + 1] + (i % 2 == 0 ? 1e-6 : 0.1) * glm::dvec3(1.0, 0.5, 0.25);
      mesh.triangles.push_back({base, base + 1, base + 2});
    }
    RepairSoup soup{mesh, std::vector<std::uint32_t>(mesh.triangles.size(), 0)};
    const ClosedCracks closed = close_cracks(soup, 1.7e-6);
    ASSERT_EQ(soup.mesh.triangles.size(), mesh.triangles.size());
    EXPECT_LE(closed.furthest_m, 2 * 1.7e-6);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& [a, b, c] = soup.mesh.triangles[i];
      EXPECT_TRUE(a != b && b != c && c != a);
    }
    EXPECT_LE(count_of(check_mesh(soup.mesh).findings, "M06"), count_of(check_mesh(mesh).findings, "M06"));
  }
}

// A vertex lies at the middle of a neighbour's edge. The gap between them has no width.
TEST(RepairHoles, ATJunctionIsClosedByAnEdge) {
  TriangleMesh box = make_box_mesh(glm::dvec3(0.5), 1);
  const auto [a, b, c] = box.triangles[0];
  const auto middle = static_cast<std::uint32_t>(box.vertices.size());
  box.vertices.push_back(0.5 * (box.vertices[a] + box.vertices[b]));
  box.triangles[0] = {a, middle, c};
  box.triangles.push_back({middle, b, c});
  ASSERT_FALSE(check_mesh(box).closed);
  const RepairedMesh repaired = repair_mesh(box);
  const MeshCheck check = check_mesh(repaired.mesh, true);
  EXPECT_TRUE(check.oriented) << tests::in_short(repaired.changes);
  EXPECT_TRUE(check.findings.empty()) << tests::in_short(check.findings);
  EXPECT_NEAR(check.volume_m3, 1.0, 1e-14);
  EXPECT_EQ(repaired.mesh.triangles.size(), 14U);
}

TriangleMesh without(const TriangleMesh& mesh, const glm::dvec3& around, double radius) {
  TriangleMesh holed = mesh;
  std::erase_if(holed.triangles, [&](const TriangleIndices& t) {
    const glm::dvec3 middle = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
    return glm::length(middle - around) < radius;
  });
  return holed;
}

TEST(RepairHoles, SmallOnesAreFilledAndSaid) {
  const TriangleMesh ball = make_ball_mesh(1.0, 4);
  TriangleMesh holed = without(without(ball, {0.0, 0.0, 1.0}, 0.2), {1.0, 0.0, 0.0}, 0.1);
  const RepairedMesh repaired = repair_mesh(holed);
  const MeshCheck check = check_mesh(repaired.mesh, true);
  EXPECT_TRUE(check.oriented);
  EXPECT_TRUE(check.findings.empty()) << tests::in_short(check.findings);
  EXPECT_EQ(count_of(repaired.changes, "R13"), 2U);
  EXPECT_EQ(count_of(repaired.changes, "R04"), 0U) << "fills agree with the triangles they meet";
  // A cap of radius 0.2 is 0.02 high, so a flat fill loses 0.03 % of the ball's volume.
  EXPECT_NEAR(check.volume_m3, tests::signed_volume(ball), 2e-3);
  EXPECT_LT(check.volume_m3, tests::signed_volume(ball));
  const Finding* filled = find_finding(repaired.changes, "R13");
  ASSERT_TRUE(filled != nullptr && filled->place);
  EXPECT_GT(glm::length(filled->place->upper_m), 0.9);
}

TEST(RepairHoles, LargeOnesAndLongOnesAreLeftWithTheReason) {
  const TriangleMesh half = without(make_ball_mesh(1.0, 3), {0.0, 0.0, 1.0}, 1.4);
  RepairedMesh repaired = repair_mesh(half);
  EXPECT_EQ(repaired.mesh.triangles.size(), half.triangles.size());
  ASSERT_EQ(count_of(repaired.changes, "R14"), 1U);
  EXPECT_NE(find_finding(repaired.changes, "R14")->text.find("larger than 0.3"), std::string::npos);

  repaired = repair_mesh(half, {.hole_share = 1.0});
  EXPECT_EQ(count_of(repaired.changes, "R13"), 1U) << "asked for, it is filled";
  EXPECT_TRUE(check_mesh(repaired.mesh).oriented);

  repaired = repair_mesh(half, {.hole_edges = 5, .hole_share = 1.0});
  EXPECT_NE(find_finding(repaired.changes, "R14")->text.find("more than 5 edges"), std::string::npos);
}

TEST(RepairHoles, AFillThatWouldCutTheMeshIsLeft) {
  TriangleMesh holed = without(make_ball_mesh(1.0, 4), {0.0, 0.0, 1.0}, 0.2);
  const auto base = static_cast<std::uint32_t>(holed.vertices.size());
  // Adds a spike through the hole.
  for (const glm::dvec3& v :
       {glm::dvec3(0.0, 0.0, 0.5), glm::dvec3(0.02, 0.0, 1.5), glm::dvec3(-0.02, 0.01, 1.5)})
    holed.vertices.push_back(v);
  holed.triangles.push_back({base, base + 1, base + 2});
  const RepairedMesh repaired = repair_mesh(holed);
  EXPECT_EQ(count_of(repaired.changes, "R13"), 0U);
  EXPECT_EQ(count_of(repaired.changes, "R14"), 2U) << "the hole, and the spike's own rim";
  EXPECT_EQ(repaired.mesh.triangles.size(), holed.triangles.size());
}

// Among the fills of a flat non-convex loop, only those inside the loop have the loop's area.
TEST(RepairHoles, AFlatLoopThatIsNotConvexIsFilledInside) {
  const TriangleMesh plane = make_plane_mesh(0.5, 16);
  TriangleMesh holed = plane;
  std::erase_if(holed.triangles, [&](const TriangleIndices& t) {
    const glm::dvec3 m = (plane.vertices[t[0]] + plane.vertices[t[1]] + plane.vertices[t[2]]) / 3.0;
    const bool in = std::abs(m.x) < 0.125 && std::abs(m.y) < 0.125;
    return in && !(m.x > 0.0 && std::abs(m.y) < 0.0625);  // shaped like a C
  });
  ASSERT_LT(holed.triangles.size(), plane.triangles.size());
  const RepairedMesh repaired = repair_mesh(holed);
  EXPECT_EQ(count_of(repaired.changes, "R13"), 1U) << tests::in_short(repaired.changes);
  double area = 0.0;
  for (const auto& [a, b, c] : repaired.mesh.triangles) {
    const std::vector<glm::dvec3>& v = repaired.mesh.vertices;
    area += 0.5 * glm::length(glm::cross(v[b] - v[a], v[c] - v[a]));
  }
  EXPECT_NEAR(area, 1.0, 1e-12);
}

TEST(RepairMesh, NestedAndOverlappingPiecesAreTurnedEachForItself) {
  const TriangleMesh box = make_box_mesh(glm::dvec3(0.5), 2);
  TriangleMesh two = box;
  const auto base = static_cast<std::uint32_t>(two.vertices.size());
  for (const glm::dvec3& v : box.vertices) two.vertices.push_back(v + glm::dvec3(0.4));
  for (const auto& [a, b, c] : box.triangles) two.triangles.push_back({base + a, base + c, base + b});
  const RepairedMesh repaired = repair_mesh(two);
  EXPECT_EQ(count_of(repaired.changes, "R08"), 1U);
  EXPECT_GT(count_of(repaired.changes, "R15"), 0U) << "they cut one another, and it is said";
  const MeshCheck check = check_mesh(repaired.mesh);
  EXPECT_TRUE(check.oriented);
  EXPECT_NEAR(check.volume_m3, 2.0, 1e-12);
}

// Every pair of triangles intersects. The search and the repair still end.
TEST(RepairMesh, EndsWhereEverythingCutsEverything) {
  TriangleMesh mesh;
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    for (int k = 0; k < 3; ++k) mesh.vertices.emplace_back(normal(random), normal(random), normal(random));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto start = std::chrono::steady_clock::now();
  const MeshCheck check = check_mesh(mesh, true);
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 120.0);
  EXPECT_EQ(repaired.mesh.triangles.size(), mesh.triangles.size());
  const Finding* cuts = find_finding(check.findings, "M12");
  ASSERT_TRUE(cuts != nullptr);
  EXPECT_NE(cuts->text.find("at least"), std::string::npos);
}

// A case from fuzzing: a needle 2.7e8 m long and 1e-5 m wide, whose normal is mostly rounding error.
TEST(ClosestOnTriangle, NeedlesAreNotMissedByTheRoundingOfTheirNormal) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const double width = std::pow(10.0, -16.0 * unit(random));
    const glm::dvec3 a(-134217728.0 * unit(random), -197971136.0 * unit(random), -135056576.0 * unit(random));
    const double length = glm::length(a);
    const glm::dvec3 b = width * length * glm::dvec3(unit(random), unit(random), unit(random));
    const glm::dvec3 c(0.0);
    const double s = unit(random), t = unit(random) * (1.0 - s);
    const glm::dvec3 p = s * a + t * b + (1.0 - s - t) * c;
    for (const TrianglePoint& at : {closest_on_triangle(p, a, b, c), closest_on_triangle(p, b, c, a),
                                    closest_on_triangle(p, c, a, b)}) {
      EXPECT_LE(std::sqrt(at.squared_distance), 1e-6 * length);
      EXPECT_LE(glm::length(at.point - p), 1e-6 * length);
    }
  }
}

}  // namespace
