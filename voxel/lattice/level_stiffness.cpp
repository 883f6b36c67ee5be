// SPDX-License-Identifier: GPL-3.0-or-later
// Classification of rows, and links and contents of coarse cells.
#include "voxel/lattice/level_stiffness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace voxel {

LevelStiffness::LevelStiffness(const Lattice& lattice, const LevelStiffness* finer)
    : lattice_(lattice),
      finer_(finer),
      level_(finer == nullptr ? 0 : finer->level_ + 1),
      grid_(finer == nullptr ? lattice.grid() : coarsened(finer->grid_)),
      kind_(grid_.rows()),
      label_(grid_.rows()),
      written_at_(grid_.rows()),
      written_(grid_.rows()),
      written_cells_(finer == nullptr ? 0 : grid_.rows()),
      written_stands_(grid_.rows()),
      written_by_hash_(std::bit_ceil(2 * grid_.rows())) {
  if (finer_ == nullptr) {
    if (!lattice.uniform_limits()) written_limits_ = LazyArray<RowLimits::Written>(grid_.rows());
    for (std::size_t label = 0; label < 256; ++label) {
      std::array<LinkLimit, 3> links;
      for (int d = 0; d < 3; ++d) {
        const auto l = static_cast<std::uint8_t>(label);
        links[static_cast<std::size_t>(d)] =
            lattice.uniform_limits() ? lattice.tightest(d) : lattice.limit_between(l, l, d);
      }
      for (int axis = 0; axis < 3; ++axis)
        label_limits_[label][static_cast<std::size_t>(axis)] = AxisLimits(links, axis);
    }
  }
  ones_.fill(1.0F);
  eighths_.fill(0.125F);
  for (Lanes& lanes : zeros_) lanes.fill(0.0F);
  movable_.fill(0);
  immovable_.fill(7);
  std::array<bool, 256> used{};
  if (finer_ == nullptr) {
    for (RowId row = 0; row < grid_.rows(); ++row) {
      if (lattice_.filled_in(row) == 0) continue;
      const std::uint8_t* at = lattice_.labels(row);
      for (int i = 0; i < kRow; ++i) used[at[i]] = true;
    }
    used[0] = false;
  }
  const auto scale = static_cast<float>(std::ldexp(1.0, level_));
  for (std::size_t label = 1; label < 256; ++label) {
    if (finer_ == nullptr ? !used[label] : finer_->constant_[label] == nullptr) continue;
    constant_[label] = std::make_unique<Constant>();
    Constant& c = *constant_[label];
    std::array<Spring, 3> springs;
    for (std::size_t d = 0; d < 3; ++d) {
      springs[d] = lattice_.spring_within(static_cast<std::uint8_t>(label), static_cast<int>(d));
      c.along[d].fill(scale * springs[d].along);
      c.across[d].fill(scale * springs[d].across);
    }
    for (int axis = 0; axis < 3; ++axis) {
      float sum = 0.0F;
      for (std::size_t d = 0; d < 3; ++d) sum += 2.0F * scale * springs[d].on(axis, static_cast<int>(d));
      c.inverse[static_cast<std::size_t>(axis)].fill(1.0F / sum);
    }
  }
  if (level_ >= kKept) keep_cells();
}

void LevelStiffness::keep_cells() {
  content_ = LazyArray<std::uint8_t>(grid_.size());
  for (auto& links : link_) links = LazyArray<Spring>(grid_.size());
  for (int k = 0; k < grid_.dims[2]; ++k) {
    for (int j = 0; j < grid_.dims[1]; ++j) {
      for (int i = 0; i < grid_.dims[0]; ++i) {
        const std::array<int, 3> cell{i, j, k};
        const Content all = content_from_finer(cell);
        if (all == nothing) continue;
        const VoxelId at = grid_.at(i, j, k);
        content_[at] = all;
        for (int d = 0; d < 3; ++d) link_[static_cast<std::size_t>(d)][at] = link_from_finer(cell, d);
      }
    }
  }
}

// A cell is `held` if all voxels in it are anchored. If only some are, boundary springs act on the cell
// (voxel/multigrid/boundary_springs.h).
LevelStiffness::Content LevelStiffness::content(const std::array<int, 3>& cell) const noexcept {
  const auto [i, j, k] = cell;
  if (level_ == 0) {
    const VoxelId v = grid_.at(i, j, k);
    return !lattice_.filled(v) ? nothing : lattice_.anchored(v) ? held : some;
  }
  return level_ >= kKept ? static_cast<Content>(content_[grid_.at(i, j, k)]) : content_from_finer(cell);
}

LevelStiffness::Content LevelStiffness::content_from_finer(const std::array<int, 3>& cell) const noexcept {
  const auto [i, j, k] = cell;
  Content all = nothing;
  for (int corner = 0; corner < 8 && all != some; ++corner) {
    const std::array<int, 3> fine{2 * i + (corner & 1), 2 * j + (corner >> 1 & 1), 2 * k + (corner >> 2)};
    if (fine[0] >= finer_->grid_.dims[0] || fine[1] >= finer_->grid_.dims[1] ||
        fine[2] >= finer_->grid_.dims[2])
      continue;
    all = together(all, finer_->content(fine));
  }
  return all;
}

// Link of a cell to its upper neighbour in d. It equals the written link to the last bit, even if the row is
// not written yet.
Spring LevelStiffness::link(const std::array<int, 3>& cell, int d) const noexcept {
  const auto ud = static_cast<std::size_t>(d);
  for (std::size_t a = 0; a < 3; ++a) {
    if (cell[a] < 0 || cell[a] >= grid_.dims[a]) return {};
  }
  const VoxelId v = grid_.at(cell[0], cell[1], cell[2]);
  const RowId row = v / kRow;
  if (level_ >= kKept) return link_[ud][v];
  if (kind(row) == one_label || kind(row) == mixed) {
    const float *along = nullptr, *across = nullptr;
    find_up(row, ud, along, across);
    return {along[v % kRow], across[v % kRow]};
  }
  if (kind(row) == empty) return {};
  return level_ == 0 ? lattice_.spring(v, d) : link_from_finer(cell, d);
}

Spring LevelStiffness::link_from_finer(const std::array<int, 3>& cell, int d) const noexcept {
  const auto ud = static_cast<std::size_t>(d);
  const std::size_t p = (ud + 1) % 3, q = (ud + 2) % 3;
  std::array<Spring, 4> fine;
  for (std::size_t n = 0; n < 4; ++n) {
    std::array<int, 3> at{};
    at[ud] = 2 * cell[ud] + 1;  // last layer of this cell; the link leads to the first layer of the next cell
    at[p] = 2 * cell[p] + static_cast<int>(n & 1);
    at[q] = 2 * cell[q] + static_cast<int>(n >> 1);
    fine[n] = finer_->link(at, d);
  }
  // Summed in pairs, so that four equal springs are exactly four times one.
  return {0.5F * ((fine[0].along + fine[1].along) + (fine[2].along + fine[3].along)),
          0.5F * ((fine[0].across + fine[1].across) + (fine[2].across + fine[3].across))};
}

bool LevelStiffness::is_one_label(RowId row, std::uint8_t& label) const noexcept {
  if (level_ == 0) {
    label = lattice_.inside(row);
    if (label == 0) return false;
    return lattice_.anchored_lanes(row) == 0;
  }
  const std::array<int, 3> c = grid_.row_coordinates(row);
  label = 0;
  for (int child = 0; child < 8; ++child) {
    const int j = 2 * c[1] + (child >> 1 & 1), k = 2 * c[2] + (child >> 2);
    const int column = 2 * (c[0] - 1) + 1 + (child & 1);
    if (j >= finer_->grid_.dims[1] || k >= finer_->grid_.dims[2] || column + 1 >= finer_->grid_.columns)
      return false;
    const RowId fine = finer_->grid_.row(column, j, k);
    std::uint8_t fine_label = 0;
    if (finer_->kind(fine) == one_label) {
      fine_label = finer_->label_[fine];
    } else if (finer_->kind(fine) != unknown || !finer_->is_one_label(fine, fine_label)) {
      return false;
    }
    if (child == 0) label = fine_label;
    if (fine_label != label) return false;
  }
  return true;
}

void LevelStiffness::make_ready(RowId row) noexcept {
  if (kind(row) == unknown) find(row);
  for (std::size_t d = 1; d < 3 && kind(row) == mixed; ++d) {
    if (kind(below(row, d)) == unknown) find(below(row, d));
  }
  kind_[row] |= ready;
}

void LevelStiffness::find(RowId row) noexcept {
  const std::array<int, 3> c = grid_.row_coordinates(row);
  std::uint8_t label = 0;
  Kind found = empty;
  const bool outside = c[0] < 1 || c[0] + 1 >= grid_.columns || c[1] < 0 || c[1] >= grid_.dims[1] ||
                       c[2] < 0 || c[2] >= grid_.dims[2];
  const bool any = !outside && (level_ > 0 || lattice_.filled_in(row) != 0);
  if (any && is_one_label(row, label)) {
    found = one_label;
    label_[row] = label;
  } else if (any && write_out(row)) {
    found = mixed;
    if (written_limits_.size() > 0) write_limits(row, written_limits_[written_count_]);
    written_at_[row] = find_written();
    written_count_ = std::max(written_count_, written_at_[row] + 1);
  }
  kind_[row] = found;
}

VoxelSprings LevelStiffness::springs_by_links(const std::array<int, 3>& cell, Content inside) const noexcept {
  VoxelSprings springs;
  if (inside == nothing) return springs;
  for (std::size_t d = 0; d < 3; ++d) {
    std::array<int, 3> below = cell;
    --below[d];
    springs.up[d] = link(cell, static_cast<int>(d));
    springs.down[d] = link(below, static_cast<int>(d));
  }
  if (inside != held) springs.set_inverse();
  return springs;
}

VoxelSprings LevelStiffness::springs_of(VoxelId cell) noexcept {
  return prepare(cell / kRow) ? known_springs(cell) : VoxelSprings{};
}

VoxelSprings LevelStiffness::find_springs(VoxelId cell) const noexcept {
  const RowId row = cell / kRow;
  if ((kind_[row] & ready) != 0 || kind(row) == empty) return known_springs(cell);
  if (level_ == 0) return lattice_.springs_of(cell);
  const std::array<int, 3> at = grid_.coordinates(cell);
  return springs_by_links(at, content(at));
}

VoxelSprings LevelStiffness::known_springs(VoxelId cell) const noexcept {
  VoxelSprings out;
  const RowId row = cell / kRow;
  if (kind(row) == empty) return out;
  RowStiffness s;
  all(row, s);
  const std::size_t i = cell % kRow;
  for (std::size_t d = 0; d < 3; ++d) {
    out.up[d] = {s.up_along[d * kRow + i], s.up_across[d * kRow + i]};
    out.down[d] = {s.down_along[d][i], s.down_across[d][i]};
    out.inverse[d] = s.inverse[d * kRow + i];
  }
  return out;
}

RowSprings LevelStiffness::springs(RowId row, int axis) const noexcept {
  RowStiffness s;
  all(row, s);
  const auto ua = static_cast<std::size_t>(axis);
  RowSprings out;
  for (std::size_t d = 0; d < 3; ++d) {
    out.up[d] = (ua == d ? s.up_along : s.up_across) + d * kRow;
    out.down[d] = (ua == d ? s.down_along : s.down_across)[d];
  }
  out.inverse = s.inverse + ua * kRow;
  return out;
}

std::size_t LevelStiffness::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + kind_.resident_bytes() + label_.resident_bytes() +
                      content_.resident_bytes() + written_at_.resident_bytes() + written_.resident_bytes() +
                      written_cells_.resident_bytes() + written_stands_.resident_bytes() +
                      written_limits_.resident_bytes() + written_by_hash_.resident_bytes();
  for (const auto& links : link_) bytes += links.resident_bytes();
  for (const auto& constant : constant_) bytes += constant != nullptr ? sizeof(Constant) : 0;
  return bytes;
}

std::vector<bool> LevelStiffness::rows_in_use() {
  std::vector<bool> rows(grid_.rows());
  for (int c = 1; c + 1 < grid_.columns; ++c) {
    for (int k = 0; k < grid_.dims[2]; ++k) {
      for (int j = 0; j < grid_.dims[1]; ++j) {
        const RowId row = grid_.row(c, j, k);
        if (!prepare(row)) continue;
        for (const RowId r : {row, row - 1, row + 1, row - grid_.row_z, row + grid_.row_z, row - grid_.row_x,
                              row + grid_.row_x})
          rows[r] = true;
      }
    }
  }
  return rows;
}

}  // namespace voxel
