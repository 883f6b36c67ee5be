// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/coarse_material.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace voxel {
namespace {

constexpr int kLevels = 12;    // of cubes: 2^31 voxels have no more along an axis than the coarsest spans
constexpr int kNearerEnd = 4;  // an end is when a voxel is off the middle by one such part of the size
constexpr int kMostAlong = 1 << (kLevels - 1);

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

CoarseMaterial::CoarseMaterial(const Lattice& lattice) : lattice_(lattice), dims_(lattice.grid().dims) {
  fills_box_ = lattice.voxel_count() == index(dims_[0]) * index(dims_[1]) * index(dims_[2]);
  rank_materials();
  choose_offset();
  kept_.resize(kLevels);
  for (int m = 0; m < kLevels; ++m) {
    for (std::size_t d = 0; d < 3; ++d)
      kept_[index(m)].dims[d] = ((fills_box_ && !several() ? dims_[d] - 1 : high(d)) >> m) + 1;
  }
  if (!fills_box_) count_cells();
  if (several()) weigh_cells();
  mark_anchors();
  const std::size_t widest = index(*std::max_element(dims_.begin(), dims_.end())) + 2 * kMostAlong;
  lines_.reserve(4 * widest);
}

// The reference is what the first voxel of the surface is of.
void CoarseMaterial::rank_materials() {
  std::vector<double> young_Pa{0.0};
  for (const LinkMaterial& m : lattice_.materials().subspan(1)) young_Pa.push_back(m.young_Pa);
  std::sort(young_Pa.begin(), young_Pa.end());
  young_Pa.erase(std::unique(young_Pa.begin(), young_Pa.end()), young_Pa.end());
  const auto stiffness_of = [this](std::uint8_t label) {
    return lattice_.materials()[lattice_.material_of(label)].young_Pa;
  };
  const double reference_Pa = stiffness_of(lattice_.label(lattice_.surface().front()));
  for (const double young : young_Pa) stiffness_.push_back(static_cast<float>(young / reference_Pa));
  for (std::size_t label = 1; label < rank_.size(); ++label) {
    const auto l = static_cast<std::uint8_t>(label);
    if (lattice_.material_of(l) == 0) continue;
    const auto found = std::lower_bound(young_Pa.begin(), young_Pa.end(), stiffness_of(l));
    rank_[label] = static_cast<std::uint8_t>(found - young_Pa.begin());
  }
  const std::size_t ranks = stiffness_.size();
  pair_.assign(ranks * ranks, 0.0F);
  for (std::size_t a = 1; a < ranks; ++a) {
    pair_[a] = pair_[a * ranks] = stiffness_[a];
    for (std::size_t b = 1; b < ranks; ++b)
      pair_[a * ranks + b] = 4.0F / (1.0F / stiffness_[a] + 1.0F / stiffness_[b]);
  }
}

// The low end of the box is at 0, or, where more voxels are anchored there than at the high end, that one at
// a node of all levels.
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
      anchored_part_[d][index(end)] = anchors[index(end)] / std::max(voxels, 1.0);
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
  if (!fills_box_ || several()) return false;
  const Index3 before = offset_;
  for (std::size_t d = 0; d < 3; ++d) {
    const int last = dims_[d] - 1, middle = 2 * voxel[d] - last;
    if (std::abs(middle) * kNearerEnd > last) offset_[d] = middle > 0 ? offset_of_high_end(d) : 0;
  }
  return offset_ != before;
}

bool CoarseMaterial::filled(const Index3& p) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    if (p[d] < low(d) || p[d] > high(d)) return false;
  }
  return lattice_.filled(lattice_.at(p[0] - offset_[0], p[1] - offset_[1], p[2] - offset_[2]));
}

bool CoarseMaterial::anchored(const Index3& p) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    if (p[d] < low(d) || p[d] > high(d)) return false;
  }
  return lattice_.anchored(lattice_.at(p[0] - offset_[0], p[1] - offset_[1], p[2] - offset_[2]));
}

// How stiff voxels of a line along x are, as a rank; 0 where there is none. Without the offset.
void CoarseMaterial::line(int x0, int nx, int j, int k, std::uint8_t* out) const noexcept {
  std::fill_n(out, nx, std::uint8_t{0});
  if (j < 0 || j >= dims_[1] || k < 0 || k >= dims_[2]) return;
  const int first = std::max(x0, 0), last = std::min(x0 + nx, dims_[0]);
  for (int x = first; x < last;) {
    const int lane = x % kRow, count = std::min(kRow - lane, last - x);
    const std::uint8_t* from = lattice_.labels(lattice_.grid().row(x / kRow + 1, j, k)) + lane;
    std::uint8_t* to = out + (x - x0);
    if (several()) {
      for (int i = 0; i < count; ++i) to[i] = rank_[from[i]];
    } else {
      for (int i = 0; i < count; ++i) to[i] = from[i] != 0 ? 1 : 0;
    }
    x += count;
  }
}

// The same of cells, in a layer of them: the softest of the voxels round each. With the offset.
void CoarseMaterial::layer(int k, int x0, int nx, int y0, int ny, std::uint8_t* out) noexcept {
  const int width = nx + 1;
  lines_.resize(3 * index(width));
  std::uint8_t *before = lines_.data(), *here = before + width, *above = here + width;
  for (int j = 0; j <= ny; ++j) {
    line(x0 - offset_[0], width, y0 + j - offset_[1], k - offset_[2], here);
    line(x0 - offset_[0], width, y0 + j - offset_[1], k + 1 - offset_[2], above);
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
  Kept& fine = kept_[kKept];
  constexpr int kEdge = 1 << kKept;
  fine.small.assign(index(fine.dims[0]) * index(fine.dims[1]) * index(fine.dims[2]), 0);
  const int nx = fine.dims[0] * kEdge, ny = fine.dims[1] * kEdge;
  std::vector<std::uint8_t> cells(index(nx) * index(ny));
  for (int k = low(2); k < high(2); ++k) {
    layer(k, 0, nx, 0, ny, cells.data());
    for (int j = 0; j < ny; ++j) {
      std::uint8_t* to = fine.small.data() + fine.at({0, j / kEdge, k / kEdge});
      const std::uint8_t* from = cells.data() + index(j) * index(nx);
      const auto there = [from](int i) { return from[i] != 0 ? 1 : 0; };
      for (int i = 0; i < fine.dims[0]; ++i)
        to[i] = static_cast<std::uint8_t>(to[i] + there(4 * i) + there(4 * i + 1) + there(4 * i + 2) +
                                          there(4 * i + 3));
    }
  }
  for (std::size_t m = kKept + 1; m < kept_.size(); ++m) {
    Kept& coarse = kept_[m];
    const Kept& below = kept_[m - 1];
    coarse.count.assign(index(coarse.dims[0]) * index(coarse.dims[1]) * index(coarse.dims[2]), 0);
    for (int k = 0; k < below.dims[2]; ++k) {
      for (int j = 0; j < below.dims[1]; ++j) {
        for (int i = 0; i < below.dims[0]; ++i) {
          const std::size_t at = below.at({i, j, k});
          coarse.count[coarse.at({i / 2, j / 2, k / 2})] +=
              m == kKept + 1 ? below.small[at] : below.count[at];
        }
      }
    }
  }
}

// Of the smallest cubes that are kept, columns of 4 cells in series along each axis: of each how many cells
// there are, squared, by the sum of what they yield.
void CoarseMaterial::weigh_cells() {
  Kept& fine = kept_[kKept];
  constexpr int kEdge = 1 << kKept;
  const std::size_t cubes = index(fine.dims[0]) * index(fine.dims[1]) * index(fine.dims[2]);
  for (auto& axis : fine.stiff) axis.assign(cubes, 0.0F);
  const int nx = fine.dims[0] * kEdge, ny = fine.dims[1] * kEdge;
  const std::size_t area = index(nx) * index(ny);
  std::vector<std::uint8_t> cells(area);
  struct Column {
    float cells = 0.0F, yields = 0.0F;
    [[nodiscard]] float in_series() const { return cells > 0.0F ? cells * cells / yields : 0.0F; }
  };
  std::vector<Column> along_y(index(nx)), along_z(area);
  std::vector<float> yields;
  for (const float s : stiffness_) yields.push_back(s > 0.0F ? 1.0F / s : 0.0F);
  for (int k = 0; k < fine.dims[2] * kEdge; ++k) {
    layer(k, 0, nx, 0, ny, cells.data());
    for (int j = 0; j < ny; ++j) {
      const std::size_t row = fine.at({0, j / kEdge, k / kEdge});
      const std::uint8_t* ranks = cells.data() + index(j) * index(nx);
      Column along_x;
      for (int i = 0; i < nx; ++i) {
        const std::size_t cube = row + index(i / kEdge);
        const std::uint8_t rank = ranks[i];
        Column *const y = &along_y[index(i)], *const z = &along_z[index(j) * index(nx) + index(i)];
        for (Column* const c : {&along_x, y, z}) {
          c->cells += rank != 0 ? 1.0F : 0.0F;
          c->yields += yields[rank];
        }
        const auto end = [&](int at, std::size_t d, Column& c) {
          if (at % kEdge != kEdge - 1) return;
          fine.stiff[d][cube] += c.in_series();
          c = {};
        };
        end(i, 0, along_x);
        end(j, 1, *y);
        end(k, 2, *z);
      }
    }
  }
  for (std::size_t m = kKept + 1; m < kept_.size(); ++m) weigh_cubes_of_cubes(kept_[m - 1], kept_[m]);
}

// How many cells a cube of 2^m an edge has.
float CoarseMaterial::cells_in(const Kept& kept, int m, const Index3& cube) const noexcept {
  if (!kept.in(cube)) return 0.0F;
  if (!fills_box_)
    return m == kKept ? static_cast<float>(kept.small[kept.at(cube)])
                      : static_cast<float>(kept.count[kept.at(cube)]);
  float cells = 1.0F;
  for (std::size_t d = 0; d < 3; ++d) {
    const int from = std::max(cube[d] << m, low(d)), to = std::min((cube[d] + 1) << m, high(d));
    cells *= static_cast<float>(std::max(0, to - from));
  }
  return cells;
}

// ModeResponse an axis the two of a column in series, the four columns beside one another.
void CoarseMaterial::weigh_cubes_of_cubes(const Kept& below, Kept& coarse) const {
  const int m = static_cast<int>(&below - kept_.data());
  const std::size_t cubes = index(coarse.dims[0]) * index(coarse.dims[1]) * index(coarse.dims[2]);
  for (auto& axis : coarse.stiff) axis.assign(cubes, 0.0F);
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
            float cells = 0.0F, yields = 0.0F;
            for (int half = 0; half < 2; ++half, ++at[d]) {
              const float here = cells_in(below, m, at);
              if (here == 0.0F) continue;
              cells += here;
              yields += here * here / below.stiff[d][below.at(at)];
            }
            if (cells > 0.0F) sum += cells * cells / yields;
          }
          coarse.stiff[d][coarse.at(b)] = sum;
        }
      }
    }
  }
}

void CoarseMaterial::mark_anchors() {
  for (std::size_t m = kAnchorBlocks; m < kept_.size(); ++m)
    kept_[m].anchored.assign(index(kept_[m].dims[0]) * index(kept_[m].dims[1]) * index(kept_[m].dims[2]), 0);
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    const std::uint32_t lanes = lattice_.anchored_lanes(row);
    if (lanes == 0) continue;
    const auto c = g.row_coordinates(row);
    for (int i = 0; i < kRow; ++i) {
      if ((lanes >> i & 1U) == 0) continue;
      const Index3 p{(c[0] - 1) * kRow + i, c[1], c[2]};
      for (std::size_t m = kAnchorBlocks; m < kept_.size(); ++m) {
        std::uint8_t& mark = kept_[m].anchored[kept_[m].at({p[0] >> m, p[1] >> m, p[2] >> m})];
        if (mark != 0) break;
        mark = 1;
      }
    }
  }
}

void CoarseMaterial::make_room(std::size_t cubes) {
  const std::size_t widest = cubes << (kKept - 1);  // cells; larger cubes are counted
  cells_.reserve(2 * widest * widest);
}

void CoarseMaterial::plane(int m, int z, int first_x, int nx, int first_y, int ny, float* out) noexcept {
  const int edge = 1 << m;
  if (fills_box_) {
    // How much of a cube is in the box, axis by axis.
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
  if (m >= kKept) {
    const Kept& kept = kept_[index(std::min(m, kLevels - 1))];
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const Index3 b{first_x + i, first_y + j, z};
        out[j * nx + i] = !kept.in(b)  ? 0.0F
                          : m == kKept ? static_cast<float>(kept.small[kept.at(b)])
                                       : static_cast<float>(kept.count[kept.at(b)]);
      }
    }
    return;
  }
  const int wide = nx * edge, high_y = ny * edge;
  cells_.resize(index(wide) * index(high_y));
  std::fill_n(out, nx * ny, 0.0F);
  for (int k = z * edge; k < (z + 1) * edge; ++k) {
    layer(k, first_x * edge, wide, first_y * edge, high_y, cells_.data());
    for (int j = 0; j < high_y; ++j) {
      const std::uint8_t* from = cells_.data() + index(j) * index(wide);
      float* to = out + (j >> m) * nx;
      for (int i = 0; i < wide; ++i) to[i >> m] += from[i] != 0 ? 1.0F : 0.0F;
    }
  }
}

void CoarseMaterial::cell_plane(int z, int first_x, int nx, int first_y, int ny, float* out) noexcept {
  const std::size_t area = index(nx) * index(ny);
  cells_.resize(area);
  layer(z, first_x, nx, first_y, ny, cells_.data());
  if (several()) {
    for (std::size_t n = 0; n < area; ++n) out[n] = stiffness_[cells_[n]];
  } else {
    for (std::size_t n = 0; n < area; ++n) out[n] = cells_[n] != 0 ? 1.0F : 0.0F;
  }
}

void CoarseMaterial::stiff_plane(int m, int z, int first_x, int nx, int first_y, int ny,
                              const std::array<float*, 3>& out) noexcept {
  const std::size_t area = index(nx) * index(ny);
  if (m == 0) {
    cell_plane(z, first_x, nx, first_y, ny, out[0]);
    for (std::size_t d = 1; d < 3; ++d) std::copy_n(out[0], area, out[d]);
    return;
  }
  if (m >= kKept) {
    const Kept& kept = kept_[index(std::min(m, kLevels - 1))];
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const Index3 b{first_x + i, first_y + j, z};
        const bool in = kept.in(b);
        const std::size_t at = in ? kept.at(b) : 0;
        for (std::size_t d = 0; d < 3; ++d) out[d][j * nx + i] = in ? kept.stiff[d][at] : 0.0F;
      }
    }
    return;
  }
  // Eight cells: most often all of one tissue.
  const int wide = 2 * nx;
  const std::size_t layer_of = index(wide) * index(2 * ny), ranks = stiffness_.size();
  cells_.resize(2 * layer_of);
  layer(2 * z, 2 * first_x, wide, 2 * first_y, 2 * ny, cells_.data());
  layer(2 * z + 1, 2 * first_x, wide, 2 * first_y, 2 * ny, cells_.data() + layer_of);
  for (int j = 0; j < ny; ++j) {
    const std::uint8_t* const low = cells_.data() + index(2 * j) * index(wide);
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
          if ((n >> d & 1U) == 0) sum += pair_[c[n] * ranks + c[n | std::size_t{1} << d]];
        }
        out[d][at] = sum;
      }
    }
  }
}

bool CoarseMaterial::anchor_near(const Index3& p, const Index3& q, int span) const noexcept {
  std::size_t m = kAnchorBlocks;
  while ((1 << m) < span && m + 1 < kept_.size()) ++m;
  const Kept& kept = kept_[m];
  Index3 first{}, last{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = std::max((std::min(p[d], q[d]) - offset_[d] - span / 2) >> m, 0);
    last[d] = std::min((std::max(p[d], q[d]) - offset_[d] + span / 2) >> m, kept.dims[d] - 1);
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      for (int i = first[0]; i <= last[0]; ++i) {
        if (kept.anchored[kept.at({i, j, k})] != 0) return true;
      }
    }
  }
  return false;
}

// The nearest line along d, no further away than half of its links, that has tissue in it.
CoarseMaterial::Index3 CoarseMaterial::in_tissue(const Index3& p, std::size_t d, int links) const noexcept {
  const auto any = [&](Index3 q) {
    for (int t = 0; t <= links; ++t, ++q[d]) {
      if (filled(q)) return true;
    }
    return false;
  };
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  Index3 at = p;
  at[e] = std::clamp(at[e], low(e), high(e));
  at[f] = std::clamp(at[f], low(f), high(f));
  if (any(at)) return at;
  for (int away = 1; away <= links / 2; away *= 2) {
    for (int n = 0; n < 9; ++n) {
      Index3 q = at;
      q[e] += (n % 3 - 1) * away;
      q[f] += (n / 3 - 1) * away;
      if (any(q)) return q;
    }
  }
  return at;
}

CoarseMaterial::Anchored CoarseMaterial::anchors_along(const Index3& p, std::size_t d, int links) const noexcept {
  Anchored found;
  Index3 end = p;
  end[d] += links;
  if (!anchor_near(p, end, links)) return found;
  if (fills_box_) return anchors_in_box(p, d, links);
  Index3 q = in_tissue(p, d, links);
  bool before = false;
  for (int t = 0; t <= links; ++t, ++q[d]) {
    const bool here = filled(q);
    if (here && before) ++found.links;
    before = here;
    if (!here) continue;
    if (!anchored(q)) {
      found.low_free = found.low_free || t == 0;
      found.high_free = t == links;
      continue;
    }
    // The ends themselves are somebody else's.
    if (t > 0 && found.ahead == 0) found.ahead = t;
    if (t < links) found.back = links - t;
  }
  return found;
}

// The same where all is tissue: how much of the line there is needs no look, and of cubes without an anchor
// none of their voxels.
CoarseMaterial::Anchored CoarseMaterial::anchors_in_box(const Index3& p, std::size_t d, int links) const noexcept {
  Anchored found;
  Index3 q = p;
  for (const std::size_t e : {(d + 1) % 3, (d + 2) % 3}) q[e] = std::clamp(q[e], low(e), high(e));
  const int first = std::max(low(d) - p[d], 0), last = std::min(high(d) - p[d], links);
  found.links = std::max(last - first, 0);
  if (first > last) return found;
  const Kept& kept = kept_[kAnchorBlocks];
  const auto anchor_at = [&](int t) {
    q[d] = p[d] + t;
    return anchored(q);
  };
  // To the first anchor from `from` on, in steps of ±1; `links` + 1: there is none.
  const auto scan = [&](int from, int to, int way) {
    for (int t = from; way > 0 ? t <= to : t >= to;) {
      const int at = p[d] + t - offset_[d];
      Index3 cube{};
      for (std::size_t e = 0; e < 3; ++e) cube[e] = (q[e] - offset_[e]) >> kAnchorBlocks;
      cube[d] = at >> kAnchorBlocks;
      if (kept.anchored[kept.at(cube)] == 0) {
        const int edge = cube[d] << kAnchorBlocks;  // on to the next cube
        t += way > 0 ? edge + (1 << kAnchorBlocks) - at : edge - 1 - at;
        continue;
      }
      if (anchor_at(t)) return t;
      t += way;
    }
    return links + 1;
  };
  // The ends themselves are somebody else's.
  const int ahead = scan(std::max(first, 1), last, 1), back = scan(std::min(last, links - 1), first, -1);
  if (ahead <= links) found.ahead = ahead;
  if (back <= links) found.back = links - back;
  found.low_free = first == 0 && !anchor_at(0);
  found.high_free = last == links && !anchor_at(links);
  return found;
}

bool CoarseMaterial::unbroken(Index3 p, std::size_t d, int count) const noexcept {
  for (int t = 0; t < count; ++t, ++p[d]) {
    if (!filled(p)) return false;
  }
  return true;
}

std::size_t CoarseMaterial::memory_bytes() const {
  std::size_t bytes = sizeof(*this);
  for (const Kept& k : kept_) {
    bytes += k.small.capacity() + k.count.capacity() * sizeof(std::uint32_t) + k.anchored.capacity();
    for (const auto& axis : k.stiff) bytes += axis.capacity() * sizeof(float);
  }
  return bytes;
}

}  // namespace voxel
