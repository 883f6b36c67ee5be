// SPDX-License-Identifier: GPL-3.0-or-later
// Holes and rims. Holes that touch are told apart and filled, and none is filled twice. A check of the
// repaired mesh confirms the counts and the outcome that the repair reports.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <random>
#include <set>

#include "polygon/repair/check.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"
#include "tests/polygon/fixtures/findings.h"

namespace {

using namespace polygon;
using tests::count_of;

// Checks the conditions that hold after every repair, whether or not all defects could be mended.
void expect_agreement(const TriangleMesh& mesh, const RepairedMesh& repaired) {
  const MeshCheck check = check_mesh(repaired.mesh);
  const std::string said = tests::in_short(repaired.changes) + " | " + tests::in_short(check.findings);
  EXPECT_EQ(count_of(repaired.changes, "R14"), count_of(check.findings, "M09")) << said;
  EXPECT_EQ(count_of(repaired.changes, "R10"), check.border_edges) << said;
  EXPECT_EQ(count_of(repaired.changes, "R09"), check.oriented ? 1U : 0U) << said;
  const bool other = !check.oriented && check.border_edges == 0;
  EXPECT_EQ(count_of(repaired.changes, "R17") > 0, other) << said;
  EXPECT_EQ(touched_as(check) == "a closed solid", check.oriented);
  EXPECT_EQ(count_of(check.findings, "M03"), 0U) << "no triangle is repeated: " << said;
  EXPECT_GE(repaired.mesh.triangles.size() + count_of(repaired.changes, "R03"), mesh.triangles.size());
}

TriangleMesh without_triangles(const TriangleMesh& mesh, const std::set<std::uint32_t>& missing) {
  TriangleMesh holed{.vertices = mesh.vertices, .triangles = {}};
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!missing.contains(i)) holed.triangles.push_back(mesh.triangles[i]);
  }
  return holed;
}

// The triangles around a vertex, in order around it.
std::vector<std::uint32_t> around(const TriangleMesh& mesh, std::uint32_t vertex) {
  std::vector<std::uint32_t> ring;
  const auto after = [&](const TriangleIndices& t) {
    return t[0] == vertex   ? std::pair(t[1], t[2])
           : t[1] == vertex ? std::pair(t[2], t[0])
                            : std::pair(t[0], t[1]);
  };
  for (bool more = true; more;) {
    more = false;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const TriangleIndices& t = mesh.triangles[i];
      if (std::find(t.begin(), t.end(), vertex) == t.end()) continue;
      if (std::find(ring.begin(), ring.end(), i) != ring.end()) continue;
      if (!ring.empty() && after(mesh.triangles[ring.back()]).second != after(t).first) continue;
      ring.push_back(i);
      more = true;
      break;
    }
  }
  return ring;
}

TEST(RepairRims, HolesThatTouchInAVertexAreFilledEach) {
  const TriangleMesh ball = make_ball_mesh(1.0, 3);
  const std::vector<std::uint32_t> ring = around(ball, 200);
  ASSERT_EQ(ring.size(), 6U);
  for (const std::set<std::uint32_t>& missing :
       {std::set{ring[0], ring[2]}, std::set{ring[0], ring[3]}, std::set{ring[0], ring[2], ring[4]},
        std::set{ring[0], ring[1], ring[3]}}) {
    const TriangleMesh holed = without_triangles(ball, missing);
    const std::size_t holes = missing.contains(ring[1]) ? 2 : missing.size();
    EXPECT_EQ(count_of(check_mesh(holed).findings, "M09"), holes);
    const RepairedMesh repaired = repair_mesh(holed);
    EXPECT_EQ(count_of(repaired.changes, "R13"), holes);
    expect_agreement(holed, repaired);
    const MeshCheck check = check_mesh(repaired.mesh, true);
    EXPECT_TRUE(check.oriented);
    EXPECT_TRUE(check.findings.empty()) << tests::in_short(check.findings);
    EXPECT_EQ(repaired.mesh.triangles.size(), ball.triangles.size());
    EXPECT_NEAR(check.volume_m3, tests::signed_volume(ball), 1e-3);
  }
}

// Two holes touch at a corner point on a crease. There a triangle may lie across the plane of a gap, so the
// triangle does not tell on which side of the point the gap lies.
TEST(RepairRims, HolesThatTouchOnACreaseAreFilledEach) {
  const TriangleMesh box = make_box_mesh(glm::dvec3(0.5), 4);
  const auto centre = [&](std::uint32_t t) {
    const auto& [a, b, c] = box.triangles[t];
    return (box.vertices[a] + box.vertices[b] + box.vertices[c]) / 3.0;
  };
  std::size_t pairs = 0;
  for (std::uint32_t v = 0; v < box.vertices.size(); ++v) {
    const std::vector<std::uint32_t> ring = around(box, v);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      for (std::size_t k = i + 2; k < ring.size() && !(i == 0 && k + 1 == ring.size()); ++k) {
        if (glm::length(centre(ring[i]) - centre(ring[k])) < 1e-9) continue;
        const TriangleMesh holed = without_triangles(box, {ring[i], ring[k]});
        ASSERT_EQ(count_of(check_mesh(holed).findings, "M09"), 2U) << v << " " << i << " " << k;
        const RepairedMesh repaired = repair_mesh(holed);
        ASSERT_EQ(count_of(repaired.changes, "R13"), 2U) << v << " " << i << " " << k;
        ++pairs;
      }
    }
  }
  EXPECT_GT(pairs, 300U);
}

// A triangle hangs in the hole by one corner. The hole's rim runs around the triangle, and so passes this
// corner twice.
TEST(RepairRims, AHoleWithATriangleThatHangsInItIsFilledAroundIt) {
  const TriangleMesh ball = make_ball_mesh(1.0, 3);
  const std::vector<std::uint32_t> ring = around(ball, 200);
  ASSERT_EQ(ring.size(), 6U);
  std::set<std::uint32_t> missing;
  for (const std::uint32_t corner : ball.triangles[ring[0]]) {
    for (const std::uint32_t t : around(ball, corner)) missing.insert(t);
  }
  missing.erase(ring[0]);  // this triangle stays, and hangs by vertex 200
  missing.erase(ring[3]);
  const TriangleMesh holed = without_triangles(ball, missing);
  EXPECT_EQ(count_of(check_mesh(holed).findings, "M09"), 1U);
  const RepairedMesh repaired = repair_mesh(holed);
  expect_agreement(holed, repaired);
  const MeshCheck check = check_mesh(repaired.mesh, true);
  EXPECT_TRUE(check.oriented) << tests::in_short(repaired.changes) << " | "
                              << tests::in_short(check.findings);
  EXPECT_NEAR(check.volume_m3, tests::signed_volume(ball), 2e-2);
}

TEST(RepairRims, ABallWithManyFacesMissingIsClosed) {
  const TriangleMesh ball = make_ball_mesh(1.0, 3);
  std::size_t closed = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    std::mt19937_64 random(seed);
    std::set<std::uint32_t> missing;
    while (missing.size() < 80) missing.insert(static_cast<std::uint32_t>(random() % ball.triangles.size()));
    const TriangleMesh holed = without_triangles(ball, missing);
    const std::size_t holes = count_of(check_mesh(holed).findings, "M09");
    const RepairedMesh repaired = repair_mesh(holed);
    expect_agreement(holed, repaired);
    EXPECT_EQ(count_of(repaired.changes, "R13") + count_of(repaired.changes, "R14"), holes);
    const MeshCheck check = check_mesh(repaired.mesh, true);
    EXPECT_EQ(count_of(check.findings, "M12"), 0U);
    closed += check.oriented ? 1 : 0;
    if (check.oriented) {
      EXPECT_NEAR(check.volume_m3, tests::signed_volume(ball), 2e-2);
    }
    EXPECT_TRUE(check.oriented) << "seed " << seed << ": " << tests::in_short(repaired.changes) << " | "
                                << tests::in_short(check.findings);
  }
  EXPECT_EQ(closed, 20U);
}

// A rough mesh with thin parts, from which so many faces are missing that the rims run together.
TEST(RepairRims, NoFillRepeatsATriangleOfARoughMesh) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> off(-0.06, 0.06);
    TriangleMesh rough = make_ball_mesh(1.0, 3);
    for (glm::dvec3& v : rough.vertices) v += glm::dvec3(off(random), off(random), off(random));
    for (glm::dvec3& v : rough.vertices) v.z *= 0.02;  // nearly two sheets
    std::set<std::uint32_t> missing;
    const std::size_t count = 100 + 30 * (seed % 10);
    while (missing.size() < count)
      missing.insert(static_cast<std::uint32_t>(random() % rough.triangles.size()));
    const TriangleMesh holed = without_triangles(rough, missing);
    expect_agreement(holed, repair_mesh(holed));
  }
}

TriangleMesh together(TriangleMesh mesh, const TriangleMesh& other, const glm::dvec3& offset) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const glm::dvec3& v : other.vertices) mesh.vertices.push_back(v + offset);
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({base + a, base + b, base + c});
  return mesh;
}

TEST(RepairRims, ClosedAndASheetAreNeverSaidOfOneMesh) {
  const TriangleMesh box = make_box_mesh(glm::dvec3(0.5), 1), ball = make_ball_mesh(1.0, 2);
  const TriangleMesh by_an_edge = together(box, box, {1.0, 1.0, 0.0});
  const RepairedMesh repaired = repair_mesh(by_an_edge);
  expect_agreement(by_an_edge, repaired);
  EXPECT_EQ(count_of(repaired.changes, "R09"), 0U) << "four triangles meet at an edge";
  EXPECT_EQ(touched_as(check_mesh(repaired.mesh)),
            "a two-sided sheet, because 1 edges have more than two triangles");

  const TriangleMesh by_a_corner = together(box, box, {1.0, 1.0, 1.0});
  expect_agreement(by_a_corner, repair_mesh(by_a_corner));
  EXPECT_EQ(touched_as(check_mesh(by_a_corner)), "a closed solid");

  TriangleMesh turned = ball;
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  EXPECT_EQ(touched_as(check_mesh(turned)),
            "a two-sided sheet, because 3 edges have triangles that are turned against each other");
  expect_agreement(turned, repair_mesh(turned));
  for (auto& t : turned.triangles) std::swap(t[0], t[1]);
  expect_agreement(turned, repair_mesh(turned));

  const TriangleMesh plane = make_plane_mesh(1.0, 3);
  EXPECT_EQ(touched_as(check_mesh(plane)), "a two-sided sheet, because 12 edges are open");
  expect_agreement(plane, repair_mesh(plane));

  TriangleMesh fin = ball;  // the fin's rim ends at an edge of three triangles
  fin.vertices.emplace_back(5.0, 0.0, 0.0);
  fin.triangles.push_back(
      {fin.triangles[0][0], fin.triangles[0][1], static_cast<std::uint32_t>(fin.vertices.size() - 1)});
  expect_agreement(fin, repair_mesh(fin));
  EXPECT_EQ(count_of(check_mesh(fin).findings, "M09"), 1U);
}

}  // namespace
