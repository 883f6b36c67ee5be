// SPDX-License-Identifier: GPL-3.0-or-later
// Stiffness and limits of the cells in cubes, where tissues differ (coarse_material.h).
#include <algorithm>
#include <cstring>

#include "voxel/composite/coarse_material.h"

namespace voxel {
namespace {

using composite::index;

}  // namespace

// Finds the stiffness of the smallest stored cubes. Along each axis, the 4 cells of a column are in series,
// and the columns are in parallel. A column of n cells contributes n² / Σ compliance, so that n equal cells
// contribute n times their stiffness.
void CoarseMaterial::find_stiffness() {
  CubeLevel& fine = levels_[kFirstLevel];
  constexpr int kEdge = 1 << kFirstLevel;
  const std::size_t cubes = index(fine.dims[0]) * index(fine.dims[1]) * index(fine.dims[2]);
  for (auto& axis : fine.stiffness) axis.assign(cubes, 0.0F);
  const int nx = fine.dims[0] * kEdge, ny = fine.dims[1] * kEdge;
  const std::size_t area = index(nx) * index(ny);
  std::vector<std::uint8_t> cells(area);
  struct Column {
    float cells = 0.0F, compliance = 0.0F;
    [[nodiscard]] float in_series() const { return cells > 0.0F ? cells * cells / compliance : 0.0F; }
  };
  std::vector<Column> along_y(index(nx)), along_z(area);
  std::vector<float> compliance;
  for (const float s : stiffness_) compliance.push_back(s > 0.0F ? 1.0F / s : 0.0F);
  std::array<std::vector<float>, 3> thin;  // [d] by cell of the layer
  for (auto& axis : thin) axis.resize(thin_links_.items.empty() ? 0 : area);
  for (int k = 0; k < fine.dims[2] * kEdge; ++k) {
    cell_ranks(k, 0, nx, 0, ny, cells.data());
    for (auto& axis : thin) std::fill(axis.begin(), axis.end(), 0.0F);
    for_thin_cells({0, 0, k}, {nx - 1, ny - 1, k}, [&](const Index3& cell, std::size_t d, float share) {
      thin[d][index(cell[1]) * index(nx) + index(cell[0])] += share;
    });
    for (int j = 0; j < ny; ++j) {
      const std::size_t row = fine.at({0, j / kEdge, k / kEdge});
      const std::uint8_t* ranks = cells.data() + index(j) * index(nx);
      Column along_x;
      for (int i = 0; i < nx; ++i) {
        const std::size_t cube = row + index(i / kEdge);
        const std::uint8_t rank = ranks[i];
        const std::size_t cell = index(j) * index(nx) + index(i);
        Column *const y = &along_y[index(i)], *const z = &along_z[cell];
        const std::array<Column*, 3> columns{&along_x, y, z};
        for (std::size_t d = 0; rank != 0 && d < 3; ++d) {
          columns[d]->cells += 1.0F;
          const float more = thin[d].empty() ? 0.0F : thin[d][cell];
          columns[d]->compliance += more > 0.0F ? 1.0F / (stiffness_[rank] + more) : compliance[rank];
        }
        const auto end = [&](int at, std::size_t d, Column& c) {
          if (at % kEdge != kEdge - 1) return;
          fine.stiffness[d][cube] += c.in_series();
          c = {};
        };
        end(i, 0, along_x);
        end(j, 1, *y);
        end(k, 2, *z);
      }
    }
  }
  for (std::size_t m = kFirstLevel + 1; m < levels_.size(); ++m)
    coarsen_stiffness(levels_[m - 1], levels_[m]);
}

// Stiffness of cubes twice as large. Along an axis, the two cubes of a column are in series, and the four
// columns are in parallel.
void CoarseMaterial::coarsen_stiffness(const CubeLevel& below, CubeLevel& coarse) const {
  const int m = static_cast<int>(&below - levels_.data());
  const std::size_t cubes = index(coarse.dims[0]) * index(coarse.dims[1]) * index(coarse.dims[2]);
  for (auto& axis : coarse.stiffness) axis.assign(cubes, 0.0F);
  Index3 b{};
  for (b[2] = 0; b[2] < coarse.dims[2]; ++b[2]) {
    for (b[1] = 0; b[1] < coarse.dims[1]; ++b[1]) {
      for (b[0] = 0; b[0] < coarse.dims[0]; ++b[0]) {
        for (std::size_t d = 0; d < 3; ++d) {
          float sum = 0.0F;
          for (int column = 0; column < 4; ++column) {
            Index3 at{2 * b[0], 2 * b[1], 2 * b[2]};
            at[(d + 1) % 3] += column & 1;
            at[(d + 2) % 3] += column >> 1;
            float cells = 0.0F, compliance = 0.0F;
            for (int half = 0; half < 2; ++half, ++at[d]) {
              const float here = cell_count(below, m, at);
              if (here == 0.0F) continue;
              cells += here;
              compliance += here * here / below.stiffness[d][below.at(at)];
            }
            if (cells > 0.0F) sum += cells * cells / compliance;
          }
          coarse.stiffness[d][coarse.at(b)] = sum;
        }
      }
    }
  }
}

void CoarseMaterial::cell_stiffness(int z, int first_x, int nx, int first_y, int ny, float* out) noexcept {
  const std::size_t area = index(nx) * index(ny);
  cell_scratch_.resize(area);
  cell_ranks(z, first_x, nx, first_y, ny, cell_scratch_.data());
  if (is_heterogeneous()) {
    for (std::size_t n = 0; n < area; ++n) out[n] = stiffness_[cell_scratch_[n]];
  } else {
    for (std::size_t n = 0; n < area; ++n) out[n] = cell_scratch_[n] != 0 ? 1.0F : 0.0F;
  }
}

void CoarseMaterial::cube_stiffness(int m, int z, int first_x, int nx, int first_y, int ny,
                                    const std::array<float*, 3>& out) noexcept {
  const std::size_t area = index(nx) * index(ny);
  if (m == 0) {
    cell_stiffness(z, first_x, nx, first_y, ny, out[0]);
    for (std::size_t d = 1; d < 3; ++d) std::copy_n(out[0], area, out[d]);
    for_thin_cells({first_x, first_y, z}, {first_x + nx - 1, first_y + ny - 1, z},
                   [&](const Index3& cell, std::size_t d, float share) {
                     float& at = out[d][index(cell[1] - first_y) * index(nx) + index(cell[0] - first_x)];
                     if (at > 0.0F) at += share;
                   });
    return;
  }
  if (m >= kFirstLevel) {
    for (std::size_t d = 0; d < 3; ++d) {
      read_cubes(m, z, first_x, nx, first_y, ny, out[d],
                 [d](const CubeLevel& level, std::size_t cube) { return level.stiffness[d][cube]; });
    }
    return;
  }
  // Cubes of eight cells. In most cubes all eight have the same stiffness.
  const int wide = 2 * nx;
  const std::size_t layer_of = index(wide) * index(2 * ny), ranks = stiffness_.size();
  cell_scratch_.resize(2 * layer_of);
  cell_ranks(2 * z, 2 * first_x, wide, 2 * first_y, 2 * ny, cell_scratch_.data());
  cell_ranks(2 * z + 1, 2 * first_x, wide, 2 * first_y, 2 * ny, cell_scratch_.data() + layer_of);
  for (int j = 0; j < ny; ++j) {
    const std::uint8_t* const low = cell_scratch_.data() + index(2 * j) * index(wide);
    for (int i = 0; i < nx; ++i) {
      std::array<std::uint8_t, 8> c;
      std::memcpy(c.data(), low + 2 * i, 2);
      std::memcpy(c.data() + 2, low + wide + 2 * i, 2);
      std::memcpy(c.data() + 4, low + layer_of + 2 * i, 2);
      std::memcpy(c.data() + 6, low + layer_of + index(wide) + 2 * i, 2);
      std::uint64_t all = 0;
      std::memcpy(&all, c.data(), 8);
      const std::size_t at = index(j) * index(nx) + index(i);
      if (all == c[0] * 0x0101010101010101ULL) {
        for (float* const axis : out) axis[at] = 8.0F * stiffness_[c[0]];
        continue;
      }
      for (std::size_t d = 0; d < 3; ++d) {
        float sum = 0.0F;
        for (std::size_t n = 0; n < 8; ++n) {
          if ((n >> d & 1U) == 0) sum += series_pair_[c[n] * ranks + c[n | std::size_t{1} << d]];
        }
        out[d][at] = sum;
      }
    }
  }
  add_thin_to_cubes(z, first_x, nx, first_y, ny, out);
}

// Weighs again the cubes of eight cells that have thin links. cell_scratch_ still has the ranks of their
// cells.
void CoarseMaterial::add_thin_to_cubes(int z, int first_x, int nx, int first_y, int ny,
                                       const std::array<float*, 3>& out) noexcept {
  if (thin_links_.items.empty()) return;
  const int wide = 2 * nx;
  const std::size_t layer_of = index(wide) * index(2 * ny);
  thin_scratch_.assign(6 * layer_of, 0.0F);
  const auto number = [&](const Index3& cell) {
    return index(cell[2] - 2 * z) * layer_of + index(cell[1] - 2 * first_y) * index(wide) +
           index(cell[0] - 2 * first_x);
  };
  const Index3 low{2 * first_x, 2 * first_y, 2 * z}, high{low[0] + wide - 1, low[1] + 2 * ny - 1, low[2] + 1};
  for_thin_cells(low, high, [&](const Index3& cell, std::size_t d, float share) {
    thin_scratch_[d * 2 * layer_of + number(cell)] += share;
  });
  for_thin_cells(low, high, [&](const Index3& cell, std::size_t d, float /*share*/) {
    const Index3 first{cell[0] & ~1, cell[1] & ~1, cell[2] & ~1};
    float sum = 0.0F;
    for (int column = 0; column < 4; ++column) {
      Index3 at = first;
      at[(d + 1) % 3] += column & 1;
      at[(d + 2) % 3] += column >> 1;
      float cells = 0.0F, compliance = 0.0F;
      for (int half = 0; half < 2; ++half, ++at[d]) {
        const std::size_t n = number(at);
        if (cell_scratch_[n] == 0) continue;
        cells += 1.0F;
        compliance += 1.0F / (stiffness_[cell_scratch_[n]] + thin_scratch_[d * 2 * layer_of + n]);
      }
      if (cells > 0.0F) sum += cells * cells / compliance;
    }
    out[d][index((cell[1] >> 1) - first_y) * index(nx) + index((cell[0] >> 1) - first_x)] = sum;
  });
}

// Adds up the limits of the cells in each stored cube.
void CoarseMaterial::add_limits() {
  constexpr int kEdge = 1 << kFirstLevel;
  const auto allocate = [](CubeLevel& level) {
    for (auto& limits : level.limits)
      limits.assign(index(level.dims[0]) * index(level.dims[1]) * index(level.dims[2]), 0.0F);
  };
  CubeLevel& fine = levels_[kFirstLevel];
  allocate(fine);
  const int nx = fine.dims[0] * kEdge, ny = fine.dims[1] * kEdge;
  std::vector<std::uint8_t> cells(index(nx) * index(ny));
  for (int k = 0; k < fine.dims[2] * kEdge; ++k) {
    cell_ranks(k, 0, nx, 0, ny, cells.data());
    for (int j = 0; j < ny; ++j) {
      const std::size_t row = fine.at({0, j / kEdge, k / kEdge});
      for (int i = 0; i < nx; ++i) {
        const std::uint8_t rank = cells[index(j) * index(nx) + index(i)];
        for (std::size_t q = 0; rank != 0 && q < 3; ++q)
          fine.limits[q][row + index(i / kEdge)] += limits_[rank][q];
      }
    }
  }
  for (std::size_t m = kFirstLevel + 1; m < levels_.size(); ++m) {
    const CubeLevel& below = levels_[m - 1];
    CubeLevel& coarse = levels_[m];
    allocate(coarse);
    Index3 b{};
    for (b[2] = 0; b[2] < below.dims[2]; ++b[2]) {
      for (b[1] = 0; b[1] < below.dims[1]; ++b[1]) {
        for (b[0] = 0; b[0] < below.dims[0]; ++b[0]) {
          for (std::size_t q = 0; q < 3; ++q)
            coarse.limits[q][coarse.at({b[0] / 2, b[1] / 2, b[2] / 2})] += below.limits[q][below.at(b)];
        }
      }
    }
  }
}

void CoarseMaterial::voxel_limits(const Index3& p, int nx, const std::array<float*, 3>& out) noexcept {
  voxel_scratch_.resize(index(nx));
  voxel_ranks(p[0] - offset_[0], nx, p[1] - offset_[1], p[2] - offset_[2], voxel_scratch_.data());
  for (int i = 0; i < nx; ++i) {
    for (std::size_t q = 0; q < 3; ++q) out[q][i] = limits_[voxel_scratch_[index(i)]][q];
  }
}

void CoarseMaterial::cube_limits(int m, int z, int first_x, int nx, int first_y, int ny,
                                 const std::array<float*, 3>& out) noexcept {
  if (m >= kFirstLevel) {
    for (std::size_t q = 0; q < 3; ++q) {
      read_cubes(m, z, first_x, nx, first_y, ny, out[q],
                 [q](const CubeLevel& level, std::size_t cube) { return level.limits[q][cube]; });
    }
    return;
  }
  const int edge = 1 << m, wide = nx * edge, high_y = ny * edge;
  cell_scratch_.resize(index(wide) * index(high_y));
  for (float* const limits : out) std::fill_n(limits, nx * ny, 0.0F);
  for (int k = z * edge; k < (z + 1) * edge; ++k) {
    cell_ranks(k, first_x * edge, wide, first_y * edge, high_y, cell_scratch_.data());
    for (int j = 0; j < high_y; ++j) {
      for (int i = 0; i < wide; ++i) {
        const std::uint8_t rank = cell_scratch_[index(j) * index(wide) + index(i)];
        for (std::size_t q = 0; rank != 0 && q < 3; ++q) out[q][(j >> m) * nx + (i >> m)] += limits_[rank][q];
      }
    }
  }
}

}  // namespace voxel
