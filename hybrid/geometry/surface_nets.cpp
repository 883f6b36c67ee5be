// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of labels. The other functions of surface_nets.h are in label_morphology.cpp (pieces, growing)
// and voxelise_mesh.cpp.
#include "hybrid/geometry/surface_nets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "hybrid/geometry/label_checks.h"

namespace hybrid {
namespace {

using voxel::LabelVolume;

// A cell is the cube between eight voxel centres. The bit of a corner is x + 2y + 4z. Cell (i, j, k) has
// voxel (i, j, k) as its corner 0. Cells begin at −1, because the space outside the lattice is empty. Plain
// surface nets (Gibson 1998) put one vertex into each boundary cell, so the surface pinches where solids
// touch along an edge or at a corner. Here a cell has one vertex for each sheet of surface that passes
// through it (dual marching cubes, Nielson 2004). So each edge of the result has exactly two triangles, and
// each vertex one fan.

// Number of a cell's edge along `axis`, on side u of axis + 1 and side v of axis + 2 (modulo 3).
constexpr int edge_id(int axis, int u, int v) {
  return axis * 4 + u + 2 * v;
}
constexpr int corner_at(int axis, int along, int u, int v) {
  return (along << axis) | (u << ((axis + 1) % 3)) | (v << ((axis + 2) % 3));
}

// The sheet (0..3) of each of a cell's twelve edges, in two bits per edge.
struct Sheets {
  std::uint32_t edges = 0;
  int count = 0;
  [[nodiscard]] std::uint32_t of(int edge) const { return (edges >> (2 * edge)) & 3U; }
};

struct CellTables {
  std::array<Sheets, 256> sheets;  // solids that touch diagonally across a face are kept apart
  // Faces (bit axis*2+side) whose two diagonals belong to the same sheet in this cell.
  std::array<std::uint8_t, 256> touching{};
};

bool solid(unsigned corners, int corner) {
  return ((corners >> corner) & 1U) != 0;
}

// A face's corners in order around it, and the edges between them. Edge n is between corners n and n + 1.
struct Face {
  std::array<int, 4> corners{}, edges{};
};
Face face_of(int axis, int side) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  // An edge along u has sides (v, axis), because u + 1 = v and u + 2 = axis. One along v has sides (axis, u).
  return {{corner_at(axis, side, 0, 0), corner_at(axis, side, 1, 0), corner_at(axis, side, 1, 1),
           corner_at(axis, side, 0, 1)},
          {edge_id(u, 0, side), edge_id(v, side, 1), edge_id(u, 1, side), edge_id(v, side, 0)}};
}

bool ambiguous(unsigned corners, const Face& face) {
  return solid(corners, face.corners[0]) == solid(corners, face.corners[2]) &&
         solid(corners, face.corners[1]) == solid(corners, face.corners[3]) &&
         solid(corners, face.corners[0]) != solid(corners, face.corners[1]);
}

// Follows the surface through the six faces, from crossed edge to crossed edge. On an ambiguous face the two
// solid corners are separated, or joined if `joined` has the face's bit.
Sheets trace_sheets(unsigned corners, unsigned joined) {
  std::array<int, 12> sheet{};
  for (int edge = 0; edge < 12; ++edge) sheet[edge] = edge;
  const auto unite = [&](int a, int b) {
    const int from = sheet[a];
    const int to = sheet[b];
    for (int& s : sheet) s = s == from ? to : s;
  };
  for (int f = 0; f < 6; ++f) {
    const Face face = face_of(f / 2, f % 2);
    if (ambiguous(corners, face)) {
      // Corners of this kind (solid or empty) are cut off one by one.
      const bool around = ((joined >> f) & 1U) == 0;
      for (int n = 0; n < 4; ++n) {
        if (solid(corners, face.corners[n]) == around) unite(face.edges[n], face.edges[(n + 3) % 4]);
      }
      continue;
    }
    int first = -1;
    for (int n = 0; n < 4; ++n) {
      if (solid(corners, face.corners[n]) == solid(corners, face.corners[(n + 1) % 4])) continue;
      if (first >= 0) unite(first, face.edges[n]);
      first = face.edges[n];
    }
  }
  Sheets result;
  std::array<int, 12> number{};
  number.fill(-1);
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 4; ++side) {
      const int u = side & 1;
      const int v = side >> 1;
      if (solid(corners, corner_at(axis, 0, u, v)) == solid(corners, corner_at(axis, 1, u, v))) continue;
      const int edge = edge_id(axis, u, v);
      int& n = number[sheet[edge]];
      if (n < 0) n = result.count++;
      result.edges |= static_cast<std::uint32_t>(n) << (2 * edge);
    }
  }
  return result;
}

const CellTables& cell_tables() {
  static const CellTables tables = [] {
    CellTables built;
    for (unsigned corners = 0; corners < 256; ++corners) {
      built.sheets[corners] = trace_sheets(corners, 0);
      for (int f = 0; f < 6; ++f) {
        const Face face = face_of(f / 2, f % 2);
        if (!ambiguous(corners, face)) continue;
        if (built.sheets[corners].of(face.edges[0]) == built.sheets[corners].of(face.edges[2])) {
          built.touching[corners] = static_cast<std::uint8_t>(built.touching[corners] | (1U << f));
        }
      }
    }
    return built;
  }();
  return tables;
}

using Quad = std::array<std::uint32_t, 4>;

// Vertices in lattice units, the cell of each, and the quads between them.
struct Net {
  std::vector<glm::dvec3> positions;
  std::vector<std::array<int, 3>> cells;
  std::vector<Quad> quads;
};

// Least distance (unit: spacing) of a crossing from a voxel centre, where vertices of several cells could
// meet.
constexpr double kLeastCrossing = 0.01;

class NetBuilder {
 public:
  // `range`: null where only labels are known.
  NetBuilder(const LabelVolume& volume, const IntensityRange* range) : volume_(volume), range_(range) {}

  Net build() {
    const std::array<int, 3>& n = volume_.dims;
    row_length_ = static_cast<std::size_t>(n[0]) + 1;
    const std::size_t layer = row_length_ * (static_cast<std::size_t>(n[1]) + 1);
    below_.resize(layer);
    here_.resize(layer);
    // Reserves twice the number for the sides of a full lattice. Unused capacity takes no memory. Growing a
    // vector would take half as much again during the copy, while the labels are in memory too.
    const auto area = [&n](std::size_t a, std::size_t b) {
      return (static_cast<std::size_t>(n[a]) + 1) * (static_cast<std::size_t>(n[b]) + 1);
    };
    const std::size_t most = 4 * (area(0, 1) + area(1, 2) + area(0, 2));
    net_.positions.reserve(most);
    net_.cells.reserve(most);
    net_.quads.reserve(most);
    for (int k = -1; k < n[2]; ++k) {
      for (int j = -1; j < n[1]; ++j) build_row(j, k);
      below_.swap(here_);
    }
    return std::move(net_);
  }

 private:
  struct Cell {
    std::uint32_t first_vertex = 0;
    Sheets sheets;
  };

  // A row of labels; null if it is outside the lattice and so empty.
  [[nodiscard]] const std::uint8_t* row(int j, int k) const {
    const bool inside = j >= 0 && j < volume_.dims[1] && k >= 0 && k < volume_.dims[2];
    return inside ? &volume_.labels[volume_.index(0, j, k)] : nullptr;
  }

  [[nodiscard]] unsigned corners_of(int i, int j, int k) const {
    unsigned corners = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = i + (corner & 1);
      const std::uint8_t* labels = row(j + ((corner >> 1) & 1), k + (corner >> 2));
      if (labels != nullptr && x >= 0 && x < volume_.dims[0] && labels[x] != 0) corners |= 1U << corner;
    }
    return corners;
  }

  // Two cells may share an ambiguous face, each with one sheet through both diagonals. Together they would
  // make an edge with four triangles. Joining the solids across that face splits the sheet in both cells
  // (Wenger 2013, 'Isosurfaces', 3.3).
  [[nodiscard]] Sheets sheets_of(unsigned corners, int i, int j, int k) const {
    const CellTables& tables = cell_tables();
    unsigned joined = 0;
    for (int f = 0; tables.touching[corners] >> f != 0; ++f) {
      if (((tables.touching[corners] >> f) & 1U) == 0) continue;
      std::array<int, 3> other{i, j, k};
      other[f / 2] += f % 2 == 0 ? -1 : 1;
      if (((tables.touching[corners_of(other[0], other[1], other[2])] >> (f ^ 1)) & 1U) != 0)
        joined |= 1U << f;
    }
    return joined == 0 ? tables.sheets[corners] : trace_sheets(corners, joined);
  }

  void build_row(int j, int k) {
    const std::array<const std::uint8_t*, 4> rows{row(j, k), row(j + 1, k), row(j, k + 1), row(j + 1, k + 1)};
    unsigned corners = 0;  // the right corners of a cell become the left corners of the next
    for (int i = -1; i < volume_.dims[0]; ++i) {
      corners = (corners >> 1) & 0x55U;
      if (i + 1 < volume_.dims[0]) {
        for (unsigned r = 0; r < 4; ++r) {
          if (rows[r] != nullptr && rows[r][i + 1] != 0) corners |= 2U << (2 * r);
        }
      }
      if (corners != 0 && corners != 255) add_cell(corners, i, j, k);
    }
  }

  void add_cell(unsigned corners, int i, int j, int k) {
    const std::size_t at = static_cast<std::size_t>(j + 1) * row_length_ + static_cast<std::size_t>(i + 1);
    Cell& cell = here_[at];
    cell.sheets = sheets_of(corners, i, j, k);
    if (net_.positions.size() > std::numeric_limits<std::uint32_t>::max() - 8U) {
      refuse("the surface of this volume of ", volume_.dims[0], " x ", volume_.dims[1], " x ",
             volume_.dims[2], " voxels has more than 4 billion vertices; load it with a larger spacing");
    }
    cell.first_vertex = static_cast<std::uint32_t>(net_.positions.size());
    // Vertices at cell centres give exactly the boundary and the volume of the voxels. Sheets that share a
    // cell start apart, each a quarter of the way to its own edges, so that no two vertices coincide.
    for (int sheet = 0; sheet < cell.sheets.count; ++sheet) {
      glm::dvec3 position = glm::dvec3(i, j, k) + 0.5;
      if (range_ != nullptr) {
        position = glm::dvec3(i, j, k) + mean_crossing(corners, cell.sheets, sheet, {i, j, k});
      } else if (cell.sheets.count > 1) {
        position += 0.25 * towards_edges(corners, cell.sheets, sheet);
      }
      net_.positions.push_back(position);
      net_.cells.push_back({i, j, k});
    }
    // Visits the three lattice edges that begin at corner 0. Each has four cells around it, and this cell is
    // the last of them. `step`: offset to the neighbour before it along each axis. Along z it is 0, because
    // that neighbour is in below_.
    const std::array<std::size_t, 3> step{1, row_length_, 0};
    for (int axis = 0; axis < 3; ++axis) {
      if (solid(corners, 0) == solid(corners, 1 << axis)) continue;
      const auto vertex = [&](int back_u, int back_v) {
        std::size_t index = at;
        bool lower = false;
        for (const int a : {back_u != 0 ? (axis + 1) % 3 : -1, back_v != 0 ? (axis + 2) % 3 : -1}) {
          if (a == 2) lower = true;
          if (a >= 0) index -= step[a];
        }
        const Cell& other = (lower ? below_ : here_)[index];
        return other.first_vertex + other.sheets.of(edge_id(axis, back_u, back_v));
      };
      // Counter-clockwise as seen from the far end of the edge, which is outside if corner 0 is solid.
      Quad quad{vertex(1, 1), vertex(0, 1), vertex(0, 0), vertex(1, 0)};
      if (!solid(corners, 0)) std::swap(quad[1], quad[3]);
      net_.quads.push_back(quad);
    }
  }

  // Mean over the edges on a sheet of place(axis, u, v).
  template <class Place>
  static glm::dvec3 mean_over_edges(unsigned corners, const Sheets& sheets, int sheet, const Place& place) {
    glm::dvec3 sum(0.0);
    double edges = 0.0;
    for (int edge = 0; edge < 12; ++edge) {
      const int axis = edge / 4;
      const int u = edge & 1;
      const int v = (edge >> 1) & 1;
      if (solid(corners, corner_at(axis, 0, u, v)) == solid(corners, corner_at(axis, 1, u, v))) continue;
      if (sheets.of(edge) != static_cast<std::uint32_t>(sheet)) continue;
      sum += place(axis, u, v);
      edges += 1.0;
    }
    return sum / edges;
  }

  // From the cell's centre to the mean of the midpoints of the edges on a sheet.
  static glm::dvec3 towards_edges(unsigned corners, const Sheets& sheets, int sheet) {
    return mean_over_edges(corners, sheets, sheet, [](int axis, int u, int v) {
      glm::dvec3 middle(0.0);
      middle[(axis + 1) % 3] = u - 0.5;
      middle[(axis + 2) % 3] = v - 0.5;
      return middle;
    });
  }

  // From corner 0 of a cell to the mean of the points where the edges on a sheet pass the end of the range.
  [[nodiscard]] glm::dvec3 mean_crossing(unsigned corners, const Sheets& sheets, int sheet,
                                         const std::array<int, 3>& cell) const {
    return mean_over_edges(corners, sheets, sheet, [&](int axis, int u, int v) {
      const int near = corner_at(axis, 0, u, v), far = corner_at(axis, 1, u, v);
      const bool near_is_in = solid(corners, near);
      const double from_in =
          crossing(at_corner(cell, near_is_in ? near : far), at_corner(cell, near_is_in ? far : near));
      glm::dvec3 point(0.0);
      point[axis] = near_is_in ? from_in : 1.0 - from_in;
      point[(axis + 1) % 3] = u;
      point[(axis + 2) % 3] = v;
      return point;
    });
  }

  // Intensity at a corner of a cell; empty outside the lattice.
  [[nodiscard]] std::optional<double> at_corner(const std::array<int, 3>& cell, int corner) const {
    const std::array<int, 3> at{cell[0] + (corner & 1), cell[1] + ((corner >> 1) & 1),
                                cell[2] + (corner >> 2)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (at[axis] < 0 || at[axis] >= volume_.dims[axis]) return std::nullopt;
    }
    return range_->intensities[volume_.index(at[0], at[1], at[2])];
  }

  // Where the intensity passes the end of the range, as a share of the way from a voxel inside to one
  // outside.
  [[nodiscard]] double crossing(std::optional<double> in, std::optional<double> out) const {
    constexpr double half_way = 0.5;
    if (!in || !out || !(*in >= range_->lower && *in <= range_->upper)) return half_way;
    if (*out >= range_->lower && *out <= range_->upper) return half_way;
    const double share = ((*out < range_->lower ? range_->lower : range_->upper) - *in) / (*out - *in);
    if (!std::isfinite(share)) return half_way;
    return std::clamp(share, kLeastCrossing, 1.0 - kLeastCrossing);
  }

  const LabelVolume& volume_;
  const IntensityRange* range_;
  std::size_t row_length_ = 0;
  std::vector<Cell> below_, here_;  // one layer of cells each; only entries of cells that were added are read
  Net net_;
};

// Moves each vertex by `share` of the way to the mean of its neighbours, within its cell. All vertices move
// at once, so their order does not matter. Every edge of the net is in two quads. So a sum over quads counts
// each neighbour twice, and its mean is the mean of the neighbours.
void relax(Net& net, double share, std::vector<glm::dvec3>& sum, std::vector<std::uint32_t>& count) {
  // Unit: spacing. The reach ends short of the cell's wall, because at the wall the vertices of two cells
  // could meet.
  constexpr double kReach = 0.49;
  sum.assign(net.positions.size(), glm::dvec3(0.0));
  count.assign(net.positions.size(), 0);
  for (const Quad& quad : net.quads) {
    for (std::size_t corner = 0; corner < 4; ++corner) {
      sum[quad[corner]] += net.positions[quad[(corner + 1) % 4]] + net.positions[quad[(corner + 3) % 4]];
      count[quad[corner]] += 2;
    }
  }
  for (std::size_t v = 0; v < sum.size(); ++v) {
    const glm::dvec3 centre = glm::dvec3(net.cells[v][0], net.cells[v][1], net.cells[v][2]) + 0.5;
    const glm::dvec3 mean = sum[v] / static_cast<double>(count[v]);
    net.positions[v] = glm::clamp(glm::mix(net.positions[v], mean, share), centre - kReach, centre + kReach);
  }
}

// Plain Laplacian passes shrink: a ball of ten voxels' radius loses 10 % of its volume in twenty passes. So
// each pass shrinks and then expands slightly more, which preserves long waves (Taubin 1995, pass band 0.1).
void smooth(Net& net, int passes) {
  std::vector<glm::dvec3> sum;
  std::vector<std::uint32_t> count;
  for (int pass = 0; pass < passes; ++pass) {
    relax(net, 0.6307, sum, count);
    relax(net, -0.6732, sum, count);
  }
}

polygon::TriangleMesh surface_of(const LabelVolume& volume, const IntensityRange* range, int smoothing) {
  check_volume(volume);
  if (volume.labels.empty()) return {};
  Net net = NetBuilder(volume, range).build();
  smooth(net, smoothing);
  polygon::TriangleMesh mesh;
  mesh.vertices = std::move(net.positions);
  for (glm::dvec3& vertex : mesh.vertices) vertex *= volume.spacing_m;
  net.cells = {};
  mesh.triangles.reserve(2 * net.quads.size());
  const auto squared = [](const glm::dvec3& d) { return d.x * d.x + d.y * d.y + d.z * d.z; };
  for (const Quad& q : net.quads) {  // split along the shorter diagonal, which follows ridges
    const auto& p = mesh.vertices;
    const unsigned turn = squared(p[q[0]] - p[q[2]]) <= squared(p[q[1]] - p[q[3]]) ? 0U : 1U;
    mesh.triangles.push_back({q[turn], q[turn + 1], q[(turn + 2) % 4]});
    mesh.triangles.push_back({q[turn], q[(turn + 2) % 4], q[(turn + 3) % 4]});
  }
  return mesh;
}

}  // namespace

polygon::TriangleMesh surface_from_labels(const LabelVolume& volume, int smoothing) {
  return surface_of(volume, nullptr, smoothing);
}

polygon::TriangleMesh surface_from_intensities(const LabelVolume& volume, const IntensityRange& range,
                                               int smoothing) {
  if (range.intensities.size() != volume.labels.size())
    refuse("there are ", range.intensities.size(), " intensities for ", volume.labels.size(), " labels");
  return surface_of(volume, &range, smoothing);
}

}  // namespace hybrid
