// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/coarse_material.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace voxel {
namespace {

using composite::index;

// align_to() chooses an end if the voxel is further from the middle than size / (2 · kAlignFraction).
constexpr int kAlignFraction = 4;

}  // namespace

CoarseMaterial::CoarseMaterial(const Lattice& lattice) : lattice_(lattice), dims_(lattice.grid().dims) {
  fills_box_ = lattice.voxel_count() == index(dims_[0]) * index(dims_[1]) * index(dims_[2]);
  rank_materials();
  choose_offset();
  levels_.resize(kLevels);
  for (int m = 0; m < kLevels; ++m) {
    for (std::size_t d = 0; d < 3; ++d)
      levels_[index(m)].dims[d] = ((fills_box_ && !is_heterogeneous() ? dims_[d] - 1 : high(d)) >> m) + 1;
  }
  if (!fills_box_) count_cells();
  mark_anchors();
  list_thin_links();
  if (is_heterogeneous()) find_stiffness();
  if (has_own_limits()) add_limits();
  list_anchor_faces();
  const std::size_t widest = index(*std::max_element(dims_.begin(), dims_.end())) + 2 * (1 << (kLevels - 1));
  voxel_scratch_.reserve(4 * widest);
}

// The reference is the tissue of the first surface voxel.
void CoarseMaterial::rank_materials() {
  using Tissue = std::pair<double, TissueLimits>;  // modulus (Pa), limits
  const auto tissue_of = [](const LinkMaterial& m) {
    return Tissue{m.young_Pa,
                  {static_cast<float>(1.0 - m.stretch_min), static_cast<float>(m.stretch_max - 1.0),
                   static_cast<float>(m.shear)}};
  };
  const auto of_label = [&](std::uint8_t label) {
    return tissue_of(lattice_.materials()[lattice_.material_of(label)]);
  };
  const Tissue reference = of_label(lattice_.label(lattice_.surface().front()));
  std::vector<Tissue> tissues{{0.0, reference.second}};
  for (const LinkMaterial& m : lattice_.materials().subspan(1)) tissues.push_back(tissue_of(m));
  std::sort(tissues.begin() + 1, tissues.end());
  tissues.erase(std::unique(tissues.begin(), tissues.end()), tissues.end());
  for (const auto& [young_Pa, limits] : tissues) {
    stiffness_.push_back(static_cast<float>(young_Pa / reference.first));
    limits_.push_back(limits);
  }
  for (std::size_t label = 1; label < rank_.size(); ++label) {
    const auto l = static_cast<std::uint8_t>(label);
    if (lattice_.material_of(l) == 0) continue;
    const auto found = std::lower_bound(tissues.begin() + 1, tissues.end(), of_label(l));
    rank_[label] = static_cast<std::uint8_t>(found - tissues.begin());
  }
  const std::size_t ranks = stiffness_.size();
  series_pair_.assign(ranks * ranks, 0.0F);
  for (std::size_t a = 1; a < ranks; ++a) {
    series_pair_[a] = series_pair_[a * ranks] = stiffness_[a];
    for (std::size_t b = 1; b < ranks; ++b)
      series_pair_[a * ranks + b] = 4.0F / (1.0F / stiffness_[a] + 1.0F / stiffness_[b]);
  }
}

// The low end of the box gets coordinate 0. If it has more anchors than the high end, the high end becomes a
// node of all levels instead.
void CoarseMaterial::choose_offset() {
  for (std::size_t d = 0; d < 3; ++d) {
    const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
    std::array<double, 2> anchors{};
    for (const int end : {0, 1}) {
      Index3 p{};
      double voxels = 0.0;
      p[d] = end == 0 ? 0 : dims_[d] - 1;
      for (p[e] = 0; p[e] < dims_[e]; ++p[e]) {
        for (p[f] = 0; p[f] < dims_[f]; ++p[f]) {
          const VoxelId v = lattice_.at(p[0], p[1], p[2]);
          anchors[index(end)] += lattice_.anchored(v) ? 1.0 : 0.0;
          voxels += lattice_.filled(v) ? 1.0 : 0.0;
        }
      }
      anchored_share_[d][index(end)] = anchors[index(end)] / std::max(voxels, 1.0);
    }
    if (anchors[0] <= anchors[1]) continue;
    offset_[d] = offset_of_high_end(d);
  }
}

int CoarseMaterial::offset_of_high_end(std::size_t d) const noexcept {
  int whole = 1;
  while (whole < dims_[d] - 1) whole *= 2;
  return whole - (dims_[d] - 1);
}

bool CoarseMaterial::align_to(const Index3& voxel) noexcept {
  if (!fills_box_ || is_heterogeneous()) return false;
  const Index3 before = offset_;
  for (std::size_t d = 0; d < 3; ++d) {
    const int last = dims_[d] - 1, middle = 2 * voxel[d] - last;
    if (std::abs(middle) * kAlignFraction > last) offset_[d] = middle > 0 ? offset_of_high_end(d) : 0;
  }
  return offset_ != before;
}

bool CoarseMaterial::is_filled(const Index3& p) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    if (p[d] < low(d) || p[d] > high(d)) return false;
  }
  return lattice_.filled(lattice_.at(p[0] - offset_[0], p[1] - offset_[1], p[2] - offset_[2]));
}

bool CoarseMaterial::is_anchored(const Index3& p) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    if (p[d] < low(d) || p[d] > high(d)) return false;
  }
  return lattice_.anchored(lattice_.at(p[0] - offset_[0], p[1] - offset_[1], p[2] - offset_[2]));
}

// Stiffness ranks of a line of voxels along x; 0 where there is no voxel. Coordinates without the offset.
void CoarseMaterial::voxel_ranks(int x0, int nx, int j, int k, std::uint8_t* out) const noexcept {
  std::fill_n(out, nx, std::uint8_t{0});
  if (j < 0 || j >= dims_[1] || k < 0 || k >= dims_[2]) return;
  const int first = std::max(x0, 0), last = std::min(x0 + nx, dims_[0]);
  for (int x = first; x < last;) {
    const int lane = x % kRow, count = std::min(kRow - lane, last - x);
    const std::uint8_t* from = lattice_.labels(lattice_.grid().row(x / kRow + 1, j, k)) + lane;
    std::uint8_t* to = out + (x - x0);
    if (is_heterogeneous()) {
      for (int i = 0; i < count; ++i) to[i] = rank_[from[i]];
    } else {
      for (int i = 0; i < count; ++i) to[i] = from[i] != 0 ? 1 : 0;
    }
    x += count;
  }
}

// Stiffness ranks of a layer of cells. The rank of a cell is that of the softest of its eight voxels, or 0 if
// one is missing. Coordinates include the offset.
void CoarseMaterial::cell_ranks(int k, int x0, int nx, int y0, int ny, std::uint8_t* out) noexcept {
  const int width = nx + 1;
  voxel_scratch_.resize(3 * index(width));
  std::uint8_t *before = voxel_scratch_.data(), *here = before + width, *above = here + width;
  for (int j = 0; j <= ny; ++j) {
    voxel_ranks(x0 - offset_[0], width, y0 + j - offset_[1], k - offset_[2], here);
    voxel_ranks(x0 - offset_[0], width, y0 + j - offset_[1], k + 1 - offset_[2], above);
    for (int i = 0; i < width; ++i) here[i] = std::min(here[i], above[i]);
    for (int i = 0; i < nx; ++i) here[i] = std::min(here[i], here[i + 1]);
    if (j > 0) {
      std::uint8_t* to = out + index(j - 1) * index(nx);
      for (int i = 0; i < nx; ++i) to[i] = std::min(before[i], here[i]);
    }
    std::swap(before, here);
  }
}

void CoarseMaterial::count_cells() {
  CubeLevel& fine = levels_[kFirstLevel];
  constexpr int kEdge = 1 << kFirstLevel;
  fine.counts8.assign(index(fine.dims[0]) * index(fine.dims[1]) * index(fine.dims[2]), 0);
  const int nx = fine.dims[0] * kEdge, ny = fine.dims[1] * kEdge;
  std::vector<std::uint8_t> cells(index(nx) * index(ny));
  for (int k = low(2); k < high(2); ++k) {
    cell_ranks(k, 0, nx, 0, ny, cells.data());
    for (int j = 0; j < ny; ++j) {
      std::uint8_t* to = fine.counts8.data() + fine.at({0, j / kEdge, k / kEdge});
      const std::uint8_t* from = cells.data() + index(j) * index(nx);
      const auto there = [from](int i) { return from[i] != 0 ? 1 : 0; };
      for (int i = 0; i < fine.dims[0]; ++i)
        to[i] = static_cast<std::uint8_t>(to[i] + there(4 * i) + there(4 * i + 1) + there(4 * i + 2) +
                                          there(4 * i + 3));
    }
  }
  for (std::size_t m = kFirstLevel + 1; m < levels_.size(); ++m) {
    CubeLevel& coarse = levels_[m];
    const CubeLevel& below = levels_[m - 1];
    coarse.counts.assign(index(coarse.dims[0]) * index(coarse.dims[1]) * index(coarse.dims[2]), 0);
    for (int k = 0; k < below.dims[2]; ++k) {
      for (int j = 0; j < below.dims[1]; ++j) {
        for (int i = 0; i < below.dims[0]; ++i) {
          const std::size_t at = below.at({i, j, k});
          coarse.counts[coarse.at({i / 2, j / 2, k / 2})] +=
              m == kFirstLevel + 1 ? below.counts8[at] : below.counts[at];
        }
      }
    }
  }
}

// Number of cells in a cube of 2^m cells an edge.
float CoarseMaterial::cell_count(const CubeLevel& level, int m, const Index3& cube) const noexcept {
  if (!level.in(cube)) return 0.0F;
  if (!fills_box_)
    return m == kFirstLevel ? static_cast<float>(level.counts8[level.at(cube)])
                            : static_cast<float>(level.counts[level.at(cube)]);
  float cells = 1.0F;
  for (std::size_t d = 0; d < 3; ++d) {
    const int from = std::max(cube[d] << m, low(d)), to = std::min((cube[d] + 1) << m, high(d));
    cells *= static_cast<float>(std::max(0, to - from));
  }
  return cells;
}

void CoarseMaterial::reserve_planes(std::size_t cubes) {
  const std::size_t widest = cubes << (kFirstLevel - 1);  // cells; counts of larger cubes are stored
  cell_scratch_.reserve(2 * widest * widest);
  if (!thin_links_.items.empty()) thin_scratch_.reserve(2 * 3 * widest * widest);
}

void CoarseMaterial::cell_counts(int m, int z, int first_x, int nx, int first_y, int ny,
                                 float* out) noexcept {
  const int edge = 1 << m;
  if (fills_box_) {
    // Length along d of the part of a cube that lies within the box.
    const auto within = [&](std::size_t d, int number) {
      const int from = std::max(number * edge, low(d)), to = std::min((number + 1) * edge, high(d));
      return static_cast<float>(std::max(0, to - from));
    };
    const float deep = within(2, z);
    for (int j = 0; j < ny; ++j) {
      const float area = deep * within(1, first_y + j);
      for (int i = 0; i < nx; ++i) out[j * nx + i] = area * within(0, first_x + i);
    }
    return;
  }
  if (m >= kFirstLevel) {
    return read_cubes(m, z, first_x, nx, first_y, ny, out, [m](const CubeLevel& level, std::size_t cube) {
      return static_cast<float>(m == kFirstLevel ? level.counts8[cube] : level.counts[cube]);
    });
  }
  const int wide = nx * edge, high_y = ny * edge;
  cell_scratch_.resize(index(wide) * index(high_y));
  std::fill_n(out, nx * ny, 0.0F);
  for (int k = z * edge; k < (z + 1) * edge; ++k) {
    cell_ranks(k, first_x * edge, wide, first_y * edge, high_y, cell_scratch_.data());
    for (int j = 0; j < high_y; ++j) {
      const std::uint8_t* from = cell_scratch_.data() + index(j) * index(wide);
      float* to = out + (j >> m) * nx;
      for (int i = 0; i < wide; ++i) to[i >> m] += from[i] != 0 ? 1.0F : 0.0F;
    }
  }
}

std::size_t CoarseMaterial::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + anchor_faces_.memory_bytes() + thin_links_.memory_bytes();
  for (const CubeLevel& k : levels_) {
    bytes += k.counts8.capacity() + k.counts.capacity() * sizeof(std::uint32_t) + k.anchored.capacity();
    for (const auto* arrays : {&k.stiffness, &k.limits}) {
      for (const auto& array : *arrays) bytes += array.capacity() * sizeof(float);
    }
  }
  return bytes;
}

}  // namespace voxel
