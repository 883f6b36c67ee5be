// SPDX-License-Identifier: GPL-3.0-or-later
// Fills a closed mesh with voxels.
#include "hybrid/geometry/surface_nets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <vector>

#include "hybrid/geometry/label_checks.h"

namespace hybrid {
namespace {

using voxel::LabelVolume;

// A mesh prepared for counting crossings along x. Two coordinates of each vertex are rounded to a grid. The
// grid is so fine that it is invisible (2^-18 of the spacing at 4,096 rows). It is coarse enough that the
// side of an edge on which a row lies is an exact 64-bit integer. A row that meets an edge or a vertex
// exactly is treated as if it lay slightly further along y and far less along z (simulation of simplicity,
// Edelsbrunner & Mücke 1990). So each row crosses a closed mesh an even number of times, whatever its shape.
struct Crossings {
  std::vector<double> x;                        // per vertex; unit: spacing
  std::vector<std::array<std::int64_t, 2>> yz;  // per vertex; unit: spacing / scale
  std::int64_t scale = 1;
};

// Gives vertices at the same position the same number, so that matching triangles without shared vertices
// count as closed.
std::vector<std::uint32_t> weld(const std::vector<glm::dvec3>& vertices) {
  std::vector<std::uint32_t> order(vertices.size());
  for (std::size_t v = 0; v < order.size(); ++v) order[v] = static_cast<std::uint32_t>(v);
  const auto key = [&](std::uint32_t v) { return std::array{vertices[v].x, vertices[v].y, vertices[v].z}; };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint32_t> same(vertices.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    const bool repeated = n > 0 && key(order[n]) == key(order[n - 1]);
    same[order[n]] = repeated ? same[order[n - 1]] : order[n];
  }
  return same;
}

void check_mesh(const polygon::TriangleMesh& mesh) {
  if (mesh.triangles.empty()) refuse("the mesh has no triangles, so nothing can be inside it");
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const glm::dvec3& p = mesh.vertices[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      refuse("vertex ", v, " of the mesh is not finite; repair the mesh first");
    }
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v >= mesh.vertices.size()) {
        refuse("triangle ", t, " of the mesh uses vertex ", v, " of ", mesh.vertices.size(),
               "; repair the mesh first");
      }
    }
  }
}

// Checks that every edge has an even number of triangles. Then the parity along a row is defined.
void check_closed(const std::vector<polygon::TriangleIndices>& triangles,
                  const std::vector<glm::dvec3>& vertices) {
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * triangles.size());
  for (const auto& t : triangles) {
    for (std::size_t n = 0; n < 3; ++n) {
      const std::uint64_t a = t[n];
      const std::uint64_t b = t[(n + 1) % 3];
      if (a != b) edges.push_back(std::min(a, b) << 32 | std::max(a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  std::uint64_t example = 0;
  for (std::size_t n = 0; n < edges.size();) {
    std::size_t end = n;
    while (end < edges.size() && edges[end] == edges[n]) ++end;
    if ((end - n) % 2 != 0) {
      if (open == 0) example = edges[n];
      ++open;
    }
    n = end;
  }
  if (open == 0) return;
  const glm::dvec3 place = 0.5 * (vertices[example >> 32] + vertices[example & 0xffffffffU]);
  refuse("the mesh is not closed: ", open, " of its edges have an odd number of triangles (the first near ",
         place.x, " ", place.y, " ", place.z,
         " m), so inside and outside are not defined; repair its holes first");
}

// Removes coincident triangles in pairs. So a million of them cost no more than their sort.
void cancel_pairs(std::vector<polygon::TriangleIndices>& triangles) {
  for (auto& t : triangles) std::sort(t.begin(), t.end());
  std::sort(triangles.begin(), triangles.end());
  std::size_t kept = 0;
  for (std::size_t n = 0; n < triangles.size();) {
    std::size_t end = n;
    while (end < triangles.size() && triangles[end] == triangles[n]) ++end;
    if ((end - n) % 2 != 0) triangles[kept++] = triangles[n];
    n = end;
  }
  triangles.resize(kept);
}

// A lattice centred on the mesh's box. Where the box is a whole number of voxels wide, the outermost voxel
// centres are half a spacing inside.
LabelVolume lattice_around(const polygon::TriangleMesh& mesh, const glm::dvec3& spacing_m,
                           std::size_t max_voxels) {
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high(-std::numeric_limits<double>::infinity());
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t v : t) {
      low = glm::min(low, mesh.vertices[v]);
      high = glm::max(high, mesh.vertices[v]);
    }
  }
  const glm::dvec3 counts = glm::max(glm::ceil((high - low) / spacing_m - 1e-6), glm::dvec3(1.0));
  const double total = counts.x * counts.y * counts.z;
  constexpr double kLongest = 1e8;  // a longer axis would leave too few bits for the crossings' grid
  if (!(total <= static_cast<double>(max_voxels)) || std::max({counts.x, counts.y, counts.z}) > kLongest) {
    refuse("voxelising the mesh needs ", counts.x, " x ", counts.y, " x ", counts.z, " = ", total,
           " voxels, above the limit of ", max_voxels, "; use a larger spacing");
  }
  LabelVolume volume;
  volume.spacing_m = spacing_m;
  for (int axis = 0; axis < 3; ++axis)
    volume.dims[static_cast<std::size_t>(axis)] = static_cast<int>(counts[axis]);
  volume.origin_m = 0.5 * (low + high) - 0.5 * (counts - 1.0) * spacing_m;
  volume.labels.assign(static_cast<std::size_t>(total), std::uint8_t{0});
  return volume;
}

Crossings prepare(const std::vector<glm::dvec3>& vertices, const LabelVolume& volume) {
  Crossings crossings;
  // Coordinates run from −1 to the number of rows. They must stay within 2^30, so that products fit into 64
  // bits.
  const std::int64_t rows = std::max(volume.dims[1], volume.dims[2]) + 2LL;
  while (crossings.scale * 2 * rows <= (1LL << 30)) crossings.scale *= 2;
  const auto scale = static_cast<double>(crossings.scale);
  crossings.x.reserve(vertices.size());
  crossings.yz.reserve(vertices.size());
  for (const glm::dvec3& p : vertices) {
    const glm::dvec3 at = (p - volume.origin_m) / volume.spacing_m;
    crossings.x.push_back(at.x);
    // Only a vertex without triangles can be outside the lattice. Clamping keeps its coordinates valid
    // integers.
    const glm::dvec3 grid = glm::clamp(at, -1.0, static_cast<double>(rows)) * scale;
    crossings.yz.push_back({std::llround(grid.y), std::llround(grid.z)});
  }
  return crossings;
}

using Point = std::array<std::int64_t, 2>;

// Twice the signed area of (a, b, p). It is positive if p is left of a→b.
std::int64_t side_of(const Point& a, const Point& b, const Point& p) {
  return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
}

// Is p left of a→b after p is moved slightly along the first axis and far less along the second? `side`:
// side_of(a, b, p).
bool left_of(std::int64_t side, const Point& a, const Point& b) {
  if (side != 0) return side > 0;
  return b[1] != a[1] ? b[1] < a[1] : b[0] > a[0];
}

std::int64_t divide_up(std::int64_t a, std::int64_t b) {
  return a / b + (a % b > 0 ? 1 : 0);
}
std::int64_t divide_down(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

// Flips bit 0 of the first voxel at or behind each point where a row crosses the triangle.
void mark_triangle(const Crossings& mesh, polygon::TriangleIndices t, LabelVolume& volume) {
  if (side_of(mesh.yz[t[0]], mesh.yz[t[1]], mesh.yz[t[2]]) < 0) std::swap(t[1], t[2]);
  const std::array<Point, 3> p{mesh.yz[t[0]], mesh.yz[t[1]], mesh.yz[t[2]]};
  const std::int64_t area = side_of(p[0], p[1], p[2]);
  if (area == 0) return;  // edge-on: no row in general position crosses it
  std::array<std::int64_t, 2> low{}, high{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto [least, most] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
    low[axis] = std::max<std::int64_t>(divide_up(least, mesh.scale), 0);
    high[axis] = std::min<std::int64_t>(divide_down(most, mesh.scale), volume.dims[axis + 1] - 1);
  }
  const double x0 = mesh.x[t[0]];
  for (std::int64_t k = low[1]; k <= high[1]; ++k) {
    for (std::int64_t j = low[0]; j <= high[0]; ++j) {
      const Point row{j * mesh.scale, k * mesh.scale};
      const std::array<std::int64_t, 3> side{side_of(p[1], p[2], row), side_of(p[2], p[0], row),
                                             side_of(p[0], p[1], row)};
      if (!left_of(side[0], p[1], p[2]) || !left_of(side[1], p[2], p[0]) || !left_of(side[2], p[0], p[1]))
        continue;
      // Interpolates from the first vertex, so that x is exact on a face perpendicular to x.
      const double x = x0 + (static_cast<double>(side[1]) * (mesh.x[t[1]] - x0) +
                             static_cast<double>(side[2]) * (mesh.x[t[2]] - x0)) /
                                static_cast<double>(area);
      const double first = std::max(std::ceil(x), 0.0);
      if (first >= volume.dims[0]) continue;
      volume.labels[volume.index(static_cast<int>(first), static_cast<int>(j), static_cast<int>(k))] ^= 1U;
    }
  }
}

}  // namespace

LabelVolume voxelise_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& spacing_m, std::uint8_t label,
                          std::size_t max_voxels) {
  if (label == 0)
    refuse("a mesh cannot be filled with label 0, which means empty; give a label from 1 to 255");
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::isfinite(spacing_m[axis]) && spacing_m[axis] > 0.0)) {
      refuse("the spacing to voxelise a mesh is ", spacing_m[axis], " m along axis ", axis,
             "; it must be above 0");
    }
  }
  check_mesh(mesh);
  std::vector<polygon::TriangleIndices> triangles = mesh.triangles;
  {
    const std::vector<std::uint32_t> same = weld(mesh.vertices);
    for (auto& t : triangles) {
      for (auto& v : t) v = same[v];
    }
  }
  check_closed(triangles, mesh.vertices);
  cancel_pairs(triangles);
  LabelVolume volume = lattice_around(mesh, spacing_m, max_voxels);
  const Crossings crossings = prepare(mesh.vertices, volume);
  for (const auto& t : triangles) mark_triangle(crossings, t, volume);
  std::size_t filled = 0;
  const auto row_length = static_cast<std::size_t>(volume.dims[0]);
  for (std::size_t row = 0; row < volume.labels.size(); row += row_length) {
    unsigned inside = 0;
    for (std::size_t i = 0; i < row_length; ++i) {
      inside ^= volume.labels[row + i];
      volume.labels[row + i] = inside != 0 ? label : std::uint8_t{0};
      filled += inside;
    }
  }
  if (filled == 0) {
    refuse("no voxel centre lies inside the mesh: none of ", volume.dims[0], " x ", volume.dims[1], " x ",
           volume.dims[2], " at a spacing of ", spacing_m.x, " ", spacing_m.y, " ", spacing_m.z,
           " m; use a smaller spacing, or check that the mesh's length unit is right");
  }
  return volume;
}

}  // namespace hybrid
