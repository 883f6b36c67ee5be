// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/gl/mesh_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <set>
#include <vector>

#include "hybrid/view/camera.h"
#include "polygon/surface/primitives.h"

namespace {

using hybrid::DrawMesh;
using hybrid::IndexRange;
using hybrid::MeshPart;

constexpr double kRadius_m = 0.1;

polygon::TriangleMesh ball() {
  return polygon::make_ball_mesh(kRadius_m, 5);
}

std::multiset<std::array<std::uint32_t, 3>> triangles_of(const DrawMesh& mesh) {
  std::multiset<std::array<std::uint32_t, 3>> all;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
    all.insert({mesh.indices[t], mesh.indices[t + 1], mesh.indices[t + 2]});
  return all;
}

// A view of a tenth of the ball's size, about a point of its surface.
glm::mat4 near_view(const glm::dvec3& at) {
  hybrid::Camera camera;
  camera.target_m = at;
  camera.azimuth_rad = 0.4;
  camera.elevation_rad = 0.3;
  camera.distance_m *= 0.1 * kRadius_m / camera.view_height_m();
  return glm::mat4(camera.clip_from_scene(1.0, glm::dvec3(0.0), glm::dvec3(0.0), 1.1 * kRadius_m));
}

bool is_seen(const glm::mat4& clip, const glm::vec3& at) {
  const glm::vec4 c = clip * glm::vec4(at, 1.0F);
  return std::abs(c.x) <= c.w && std::abs(c.y) <= c.w && std::abs(c.z) <= c.w;
}

std::vector<bool> drawn_indices(std::span<const IndexRange> ranges, std::size_t count) {
  std::vector<bool> drawn(count, false);
  for (const IndexRange& range : ranges) std::fill_n(drawn.begin() + range.first, range.count, true);
  return drawn;
}

TEST(MeshParts, KeepEveryTriangleAndCoverEveryIndexOnce) {
  DrawMesh mesh = hybrid::make_moving_mesh(ball(), glm::dvec3(0.0));
  const auto before = triangles_of(mesh);
  const std::vector<MeshPart> parts = hybrid::divide_mesh(mesh);
  EXPECT_EQ(triangles_of(mesh), before);
  std::uint32_t next = 0;
  for (const MeshPart& part : parts) {
    EXPECT_EQ(part.first, next);
    next += part.count;
    for (std::uint32_t n = part.first; n < next; ++n)
      EXPECT_LE(glm::distance(mesh.vertices[mesh.indices[n]].position, part.centre), 1.0001F * part.radius);
  }
  EXPECT_EQ(next, mesh.indices.size());
}

TEST(MeshParts, DrawEveryVertexThatTheViewShowsAndFewOthers) {
  DrawMesh mesh = hybrid::make_moving_mesh(ball(), glm::dvec3(0.0));
  const std::vector<MeshPart> parts = hybrid::divide_mesh(mesh);
  for (const glm::dvec3 toward :
       {glm::dvec3(1.0, 0.0, 0.0), glm::dvec3(0.3, -0.8, 0.5), glm::dvec3(0.0, 0.0, 1.0)}) {
    const glm::mat4 clip = near_view(kRadius_m * glm::normalize(toward));
    const auto drawn = drawn_indices(hybrid::seen_ranges(parts, clip, 0.0F), mesh.indices.size());
    int seen = 0;
    for (std::size_t n = 0; n < drawn.size(); ++n) {
      if (!is_seen(clip, mesh.vertices[mesh.indices[n]].position)) continue;
      ++seen;
      EXPECT_TRUE(drawn[n]);
    }
    EXPECT_GT(seen, 0);
    EXPECT_LT(std::ranges::count(drawn, true), static_cast<std::ptrdiff_t>(drawn.size() / 2));
  }
}

TEST(MeshParts, DrawVerticesThatMovedIntoTheView) {
  DrawMesh mesh = hybrid::make_moving_mesh(ball(), glm::dvec3(0.0));
  const std::vector<MeshPart> parts = hybrid::divide_mesh(mesh);
  const glm::mat4 clip = near_view({kRadius_m, 0.0, 0.0});
  const glm::vec3 moved(0.0F, 0.02F, -0.015F);
  const auto drawn = drawn_indices(hybrid::seen_ranges(parts, clip, glm::length(moved)), mesh.indices.size());
  for (std::size_t n = 0; n < drawn.size(); ++n) {
    const bool seen = is_seen(clip, mesh.vertices[mesh.indices[n]].position + moved);
    EXPECT_TRUE(drawn[n] || !seen);
  }
}

TEST(MeshParts, KnowWhichMeshesShowNoBacks) {
  polygon::TriangleMesh mesh = ball();
  EXPECT_TRUE(hybrid::is_closed_outwards(mesh));
  polygon::TriangleMesh turned = mesh;
  for (polygon::TriangleIndices& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_FALSE(hybrid::is_closed_outwards(turned));
  polygon::TriangleMesh one_turned = mesh;
  std::swap(one_turned.triangles.front()[0], one_turned.triangles.front()[1]);
  EXPECT_FALSE(hybrid::is_closed_outwards(one_turned));
  mesh.triangles.pop_back();
  EXPECT_FALSE(hybrid::is_closed_outwards(mesh));
  EXPECT_FALSE(hybrid::is_closed_outwards({}));
}

}  // namespace
