// SPDX-License-Identifier: GPL-3.0-or-later
// Weights of the links between the nodes of a CompositeGrid, from the cells of tissue round them.
#include <algorithm>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::index;

// Stiffness of a link from its two halves in series. Each half is given by its number of cells and by that
// number times their stiffness.
float in_series(float cells_a, float stiff_a, float cells_b, float stiff_b) {
  if (cells_a == 0.0F || cells_b == 0.0F) return stiff_a + stiff_b;
  const float cells = cells_a + cells_b;
  return cells * cells / (cells_a * cells_a / stiff_a + cells_b * cells_b / stiff_b);
}

}  // namespace

void CompositeGrid::weigh(Level& level) noexcept {
  if (material_.is_heterogeneous()) {
    weigh_shape(level, level.shape_weight);
    weigh_tissues(level);
  } else {
    weigh_shape(level, level.weight);
  }
}

// Weights by the amount of tissue alone, as if all had the reference stiffness.
void CompositeGrid::weigh_shape(const Level& level, std::array<Floats, 3>& weight) noexcept {
  if (material_.fills_box()) {
    weigh_box(level, weight);
  } else if (level.step == 1) {
    weigh_cells(level, weight, true);
    weigh_thin_links(level, weight, true);
  } else {
    weigh_halves(level, weight);
  }
}

// Weighs each link between two voxels by the mean stiffness of the four cells round it. `all_alike`: counts
// all cells as equally stiff.
void CompositeGrid::weigh_cells(const Level& level, std::array<Floats, 3>& weight, bool all_alike) noexcept {
  const auto& nodes = level.nodes;
  const int nx = nodes[0].count, ny = nodes[1].count, nz = nodes[2].count, wide = nx + 1;
  const auto area = index(wide) * index(ny + 1);
  Floats &below = half_cells_[0].cells, &above = half_cells_[1].cells;
  below.resize(std::max(below.size(), area));
  above.resize(std::max(above.size(), area));
  const auto read = [&](int z, Floats& to) {
    material_.cell_stiffness(z, nodes[0].begin - 1, wide, nodes[1].begin - 1, ny + 1, to.data());
    if (!all_alike) return;
    for (std::size_t n = 0; n < area; ++n) to[n] = to[n] > 0.0F ? 1.0F : 0.0F;
  };
  for (Floats& array : weight) std::fill(array.begin(), array.end(), 0.0F);
  read(nodes[2].begin - 1, below);
  for (int k = 0; k < nz; ++k) {
    read(nodes[2].begin + k, above);
    for (int j = 0; j < ny; ++j) {
      const float *const low = below.data() + j * wide, *const low_next = low + wide;
      const float *const high = above.data() + j * wide, *const high_next = high + wide;
      const std::size_t row = level.row(j, k);
      float *const x = weight[0].data() + row, *const y = weight[1].data() + row,
                   *const z = weight[2].data() + row;
      for (int i = 0; i + 1 < nx; ++i)
        x[i] = 0.25F * (low[i + 1] + low_next[i + 1] + high[i + 1] + high_next[i + 1]);
      if (j + 1 < ny) {
        for (int i = 0; i < nx; ++i)
          y[i] = 0.25F * (low_next[i] + low_next[i + 1] + high_next[i] + high_next[i + 1]);
      }
      if (k + 1 < nz) {
        for (int i = 0; i < nx; ++i) z[i] = 0.25F * (high[i] + high[i + 1] + high_next[i] + high_next[i + 1]);
      }
    }
    std::swap(below, above);
  }
}

// Adds the links of sheets and rows of single voxels.
void CompositeGrid::weigh_thin_links(const Level& level, std::array<Floats, 3>& weight,
                                     bool all_alike) const noexcept {
  const auto& nodes = level.nodes;
  Index3 low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = nodes[d].begin;
    high[d] = level.at(d, nodes[d].count - 1);
  }
  material_.for_thin_links(low, high, [&](const CoarseMaterial::ThinLink& link) {
    if (link.voxel[link.d] == high[link.d]) return;
    weight[link.d][level.node(link.voxel[0] - low[0], link.voxel[1] - low[1], link.voxel[2] - low[2])] +=
        all_alike ? link.shape : link.excess;
  });
}

// Level m of the half cells: cubes of which two lie along a link.
int CompositeGrid::half_cube(const Level& level) noexcept {
  int m = 0;
  while (level.step > 2 << m) ++m;
  return m;
}

// Weighs each link by the half cells round it: two along the link, two by two across it.
void CompositeGrid::weigh_halves(const Level& level, std::array<Floats, 3>& weight) noexcept {
  const auto& nodes = level.nodes;
  const int nx = nodes[0].count, ny = nodes[1].count, nz = nodes[2].count;
  const int hx = 2 * nx, hy = 2 * ny, m = half_cube(level), edge = 1 << m;
  const float scale = 1.0F / static_cast<float>(level.step * level.step);
  const auto area = index(hx) * index(hy);
  Floats &below = half_cells_[0].cells, &above = half_cells_[1].cells;
  const auto read = [&](int number, Floats& to) {
    to.resize(std::max(to.size(), area));
    material_.cell_counts(m, nodes[2].begin / edge + number - 1, nodes[0].begin / edge - 1, hx,
                          nodes[1].begin / edge - 1, hy, to.data());
  };
  for (Floats& array : weight) std::fill(array.begin(), array.end(), 0.0F);
  for (int k = 0; k < nz; ++k) {
    read(2 * k, below);
    read(2 * k + 1, above);
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const std::size_t at = level.node(i, j, k);
        const std::size_t h = index(2 * j * hx + 2 * i), g = h + index(hx);
        const auto both = [&](std::size_t n) { return below[n] + above[n]; };
        if (i + 1 < nx) weight[0][at] = scale * (both(h + 1) + both(h + 2) + both(g + 1) + both(g + 2));
        if (j + 1 < ny) {
          const std::size_t further = g + index(hx);
          weight[1][at] = scale * (both(g) + both(g + 1) + both(further) + both(further + 1));
        }
        const auto of = [&](const Floats& p) { return scale * (p[h] + p[h + 1] + p[g] + p[g + 1]); };
        if (k + 1 < nz) weight[2][at] += of(above);
        if (k > 0) weight[2][at - level.plane] += of(below);
      }
    }
  }
}

// Weighs links where tissues differ. Half cells side by side are in parallel, the two halves of a link are in
// series.
void CompositeGrid::weigh_tissues(Level& level) noexcept {
  if (level.step == 1) {
    weigh_cells(level, level.weight, false);
    return weigh_thin_links(level, level.weight, false);
  }
  const auto& nodes = level.nodes;
  const int nx = nodes[0].count, ny = nodes[1].count, nz = nodes[2].count;
  const int hx = 2 * nx, hy = 2 * ny, m = half_cube(level), edge = 1 << m;
  const float scale = 1.0F / static_cast<float>(level.step * level.step);
  const auto area = index(hx) * index(hy);
  const auto read = [&](int number, HalfCells& to) {
    for (Floats* const plane : {&to.cells, &to.stiffness[0], &to.stiffness[1], &to.stiffness[2]})
      plane->resize(std::max(plane->size(), area));
    const int z = nodes[2].begin / edge + number - 1;
    const int x = nodes[0].begin / edge - 1, y = nodes[1].begin / edge - 1;
    material_.cell_counts(m, z, x, hx, y, hy, to.cells.data());
    material_.cube_stiffness(m, z, x, hx, y, hy,
                             {to.stiffness[0].data(), to.stiffness[1].data(), to.stiffness[2].data()});
  };
  HalfCells &below = half_cells_[0], &above = half_cells_[1];
  for (Floats& array : level.weight) std::fill(array.begin(), array.end(), 0.0F);
  for (int k = 0; k < nz; ++k) {
    read(2 * k, below);
    // Links from the plane before up to this plane. `above` still holds their lower halves, `below` their
    // upper halves.
    const Floats &cells_before = above.cells, &stiff_before = above.stiffness[2];
    for (int j = 0; k > 0 && j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const std::size_t h = index(2 * j * hx + 2 * i), g = h + index(hx);
        const auto of = [&](const Floats& p) { return p[h] + p[h + 1] + p[g] + p[g + 1]; };
        level.weight[2][level.node(i, j, k - 1)] =
            scale * in_series(of(cells_before), of(stiff_before), of(below.cells), of(below.stiffness[2]));
      }
    }
    read(2 * k + 1, above);
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const std::size_t at = level.node(i, j, k);
        const std::size_t h = index(2 * j * hx + 2 * i), g = h + index(hx);
        // Sum over two half cells in each of the planes below and above.
        const auto of = [](const Floats& a, const Floats& b, std::size_t one, std::size_t other) {
          return a[one] + a[other] + b[one] + b[other];
        };
        const auto link = [&](std::size_t d, std::array<std::size_t, 2> near,
                              std::array<std::size_t, 2> far) {
          return scale * in_series(of(below.cells, above.cells, near[0], near[1]),
                                   of(below.stiffness[d], above.stiffness[d], near[0], near[1]),
                                   of(below.cells, above.cells, far[0], far[1]),
                                   of(below.stiffness[d], above.stiffness[d], far[0], far[1]));
        };
        if (i + 1 < nx) level.weight[0][at] = link(0, {h + 1, g + 1}, {h + 2, g + 2});
        if (j + 1 < ny) {
          const std::size_t further = g + index(hx);
          level.weight[1][at] = link(1, {g, g + 1}, {further, further + 1});
        }
      }
    }
  }
}

// Finds the mean limits of the tissue round each node.
void CompositeGrid::find_node_limits(Level& level) noexcept {
  if (level.step > 1) return find_coarse_limits(level);
  const auto& nodes = level.nodes;
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      const std::size_t row = level.row(j, k);
      material_.voxel_limits(
          {level.at(0, 0), level.at(1, j), level.at(2, k)}, nodes[0].count,
          {level.limit[0].data() + row, level.limit[1].data() + row, level.limit[2].data() + row});
    }
  }
}

// Eight half cells lie round a node of a coarse level.
void CompositeGrid::find_coarse_limits(Level& level) noexcept {
  const auto& nodes = level.nodes;
  const int nx = nodes[0].count, ny = nodes[1].count, hx = 2 * nx, hy = 2 * ny;
  const int m = half_cube(level), edge = 1 << m;
  const int x = nodes[0].begin / edge - 1, y = nodes[1].begin / edge - 1;
  HalfCells& plane = half_cells_[0];
  Floats& around = half_cells_[1].cells;  // cells round each node of the plane
  for (Floats* const array : {&plane.cells, &plane.stiffness[0], &plane.stiffness[1], &plane.stiffness[2]})
    array->resize(std::max(array->size(), index(hx) * index(hy)));
  around.resize(std::max(around.size(), index(nx) * index(ny)));
  for (int k = 0; k < nodes[2].count; ++k) {
    std::fill(around.begin(), around.end(), 0.0F);
    for (int j = 0; j < ny; ++j) {
      for (Floats& limit : level.limit) std::fill_n(limit.data() + level.row(j, k), nx, 0.0F);
    }
    for (const int half : {0, 1}) {
      const int z = nodes[2].begin / edge + 2 * k + half - 1;
      material_.cell_counts(m, z, x, hx, y, hy, plane.cells.data());
      material_.cube_limits(
          m, z, x, hx, y, hy,
          {plane.stiffness[0].data(), plane.stiffness[1].data(), plane.stiffness[2].data()});
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          const std::size_t h = index(2 * j * hx + 2 * i), g = h + index(hx);
          const auto of = [&](const Floats& p) { return p[h] + p[h + 1] + p[g] + p[g + 1]; };
          around[index(j * nx + i)] += of(plane.cells);
          for (std::size_t q = 0; q < 3; ++q) level.limit[q][level.node(i, j, k)] += of(plane.stiffness[q]);
        }
      }
    }
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const float cells = around[index(j * nx + i)];
        for (Floats& limit : level.limit) {
          float& at = limit[level.node(i, j, k)];
          at = cells > 0.0F ? at / cells : 1.0F;  // without tissue there are no links to limit
        }
      }
    }
  }
}

// In an object that fills its box a link's weight is the product of a length and two widths.
void CompositeGrid::weigh_box(const Level& level, std::array<Floats, 3>& weight) noexcept {
  const auto& nodes = level.nodes;
  Floats &length = half_cells_[0].cells,
         &width = half_cells_[1].cells;  // of all three axes, one after another
  for (Floats* const plane : {&length, &width})
    plane->resize(std::max(plane->size(), index(nodes[0].count + nodes[1].count + nodes[2].count)));
  const std::array<std::size_t, 3> from{0, index(nodes[0].count), index(nodes[0].count + nodes[1].count)};
  for (std::size_t d = 0; d < 3; ++d) {
    const auto within = [&](double low, double high) {
      return static_cast<float>(
          std::max(0.0, std::min<double>(high, material_.high(d)) - std::max<double>(low, material_.low(d))));
    };
    for (int i = 0; i < nodes[d].count; ++i) {
      const double at = level.at(d, i), half = 0.5 * level.step;
      length[from[d] + index(i)] = i + 1 < nodes[d].count ? within(at, at + level.step) : 0.0F;
      width[from[d] + index(i)] = within(at - half, at + half);
    }
  }
  for (Floats& array : weight) std::fill(array.begin(), array.end(), 0.0F);
  const float scale = 1.0F / static_cast<float>(level.step * level.step);
  const float *const lx = length.data(), *const wx = width.data();
  for (int k = 0; k < nodes[2].count; ++k) {
    const float lz = scale * length[from[2] + index(k)], wz = scale * width[from[2] + index(k)];
    for (int j = 0; j < nodes[1].count; ++j) {
      const float ly = length[from[1] + index(j)], wy = width[from[1] + index(j)];
      const std::size_t row = level.row(j, k);
      float *const x = weight[0].data() + row, *const y = weight[1].data() + row,
                   *const z = weight[2].data() + row;
      for (int i = 0; i < nodes[0].count; ++i) {
        x[i] = lx[i] * wy * wz;
        y[i] = wx[i] * ly * wz;
        z[i] = wx[i] * wy * lz;
      }
    }
  }
}

}  // namespace voxel
