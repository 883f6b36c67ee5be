// SPDX-License-Identifier: GPL-3.0-or-later
// Voxels and cells of a rigid block on each level, and its border; motion of a block within bounds.
#include "voxel/multigrid/rigid_blocks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {
namespace {

constexpr int kMostRounds = 200;   // rounds of coordinate ascent in move_within()
constexpr double kSettled = 1e-9;  // (unit: largest force of a bound) a smaller change ends the ascent
// A level knows a block if at least this share of the block's voxels lies in cells in which the block has at
// least half of the voxels. With a smaller share, the force of the whole block would act on the springs of a
// few cells and move the block much too far. So that level and all coarser ones do not know the block.
constexpr double kMostOf = 0.7;
constexpr int kCompact = 1;  // largest distance between cells of a compact block on an axis (unit: cell)
constexpr double kParallel = 1e-4;  // sin² of the angle below which a direction counts as already fixed

VoxelId above(const Grid& finer, const Grid& coarser, VoxelId cell) {
  const std::array<int, 3> c = finer.coordinates(cell);
  return coarser.at(c[0] / 2, c[1] / 2, c[2] / 2);
}

}  // namespace

glm::dvec3 move_within(const glm::dvec3& force_N, const glm::dvec3& stiffness_N_per_m,
                       std::span<BlockBound> bounds) noexcept {
  glm::dvec3 compliance(0.0);
  for (int axis = 0; axis < 3; ++axis)
    compliance[axis] = stiffness_N_per_m[axis] > 0.0 ? 1.0 / stiffness_N_per_m[axis] : 0.0;
  glm::dvec3 sum = force_N;
  for (const BlockBound& b : bounds) sum += b.force_N * b.normal;
  for (int n = 0; n < kMostRounds; ++n) {
    double most = 0.0, change = 0.0;
    for (BlockBound& b : bounds) {
      const double along = glm::dot(b.normal, compliance * b.normal);
      if (!(along > 0.0)) continue;
      double to = b.force_N - (glm::dot(b.normal, compliance * sum) + b.room_m) / along;
      if (!b.both) to = std::max(to, 0.0);
      sum += (to - b.force_N) * b.normal;
      change = std::max(change, std::fabs(to - b.force_N));
      b.force_N = to;
      most = std::max(most, std::fabs(to));
    }
    if (change <= kSettled * most) break;
  }
  return compliance * sum;
}

void HeldDirections::add(const glm::dvec3& normal) noexcept {
  if (count == of.size()) return;
  const glm::dvec3 rest = free_component(normal);
  const double size2 = glm::dot(rest, rest);
  if (size2 < kParallel) return;
  of[count++] = rest / std::sqrt(size2);
}

glm::dvec3 HeldDirections::free_component(glm::dvec3 way) const noexcept {
  if (count == of.size()) return glm::dvec3(0.0);
  for (std::size_t n = 0; n < count; ++n) way -= glm::dot(of[n], way) * of[n];
  return way;
}

RigidBlocks::RigidBlocks(const Lattice& lattice, const std::vector<LevelStiffness*>& levels)
    : lattice_(lattice), couplings_(levels), count_(lattice.block_count()), levels_(levels.size()) {
  for (std::size_t l = 0; l < levels.size(); ++l) {
    levels_[l].blocks.resize(count_);
    levels_[l].row.assign(levels[l]->grid().rows(), 0);
    if (l > 0) levels_[l].number = LazyArray<std::uint16_t>(levels[l]->grid().size());
  }
  surface_.resize(count_);
  sprawls_.resize(count_);
  loaded_.resize(count_);
  find_voxels();
  std::vector<std::vector<Share>> shares(count_);
  for (std::size_t p = 0; p < count_; ++p) {
    for (const Run& run : on(0, p).rows) {
      for (std::uint32_t lanes = run.lanes; lanes != 0; lanes &= lanes - 1)
        shares[p].push_back({run.row * kRow + static_cast<VoxelId>(std::countr_zero(lanes)), 1});
    }
  }
  std::vector<std::uint32_t> filled(lattice.size());
  for (std::size_t v = 0; v < filled.size(); ++v) filled[v] = lattice.filled(static_cast<VoxelId>(v)) ? 1 : 0;
  for (int l = 1; l < static_cast<int>(levels.size()); ++l) find_cells(l, shares, filled);
  for (int l = 0; l < static_cast<int>(levels.size()); ++l) find_border(l);
  for (int l = 0; l < static_cast<int>(levels.size()); ++l) find_filled_rows(l);
  if (lattice.has_bricks() || lattice.has_plasticity()) find_loaded();
}

void RigidBlocks::find_voxels() {
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    if (lattice_.filled_in(row) == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (lattice_.block(v) == 0) continue;
      OnLevel& block = levels_[0].blocks[lattice_.block(v) - 1U];
      if (block.rows.empty() || block.rows.back().row != row) block.rows.push_back({row, 0});
      block.rows.back().lanes |= 1U << v % kRow;
      ++block.count;
      levels_[0].row[row] = 1;
      const std::uint32_t s = lattice_.surface_number(v);
      if (s != Lattice::kNoSurface) surface_[lattice_.block(v) - 1U].push_back(s);
    }
  }
}

// Finds the blocks' cells on a level. `shares` and `filled` belong to the finer level before, and to this
// level afterwards.
void RigidBlocks::find_cells(int level, std::vector<std::vector<Share>>& shares,
                             std::vector<std::uint32_t>& filled) {
  const Grid &finer = couplings_[static_cast<std::size_t>(level - 1)]->grid(),
             &grid = couplings_[static_cast<std::size_t>(level)]->grid();
  std::vector<std::uint32_t> sums(grid.size());
  for (std::size_t v = 0; v < filled.size(); ++v) {
    if (filled[v] != 0) sums[above(finer, grid, static_cast<VoxelId>(v))] += filled[v];
  }
  filled = std::move(sums);
  Level& l = levels_[static_cast<std::size_t>(level)];
  for (std::size_t p = 0; p < count_; ++p) {
    std::vector<Share>& of = shares[p];
    for (Share& s : of) s.cell = above(finer, grid, s.cell);
    std::sort(of.begin(), of.end(), [](const Share& a, const Share& b) { return a.cell < b.cell; });
    std::size_t kept = 0;
    for (std::size_t n = 0; n < of.size(); ++n) {
      if (kept > 0 && of[kept - 1].cell == of[n].cell) {
        of[kept - 1].voxels += of[n].voxels;
      } else {
        of[kept++] = of[n];
      }
    }
    of.resize(kept);
    OnLevel& block = l.blocks[p];
    std::size_t all = 0, known = 0;
    for (const Share& s : of) {
      all += s.voxels;
      if (2 * s.voxels >= filled[s.cell] && l.number[s.cell] == 0) known += s.voxels;
    }
    if (of.empty()) continue;  // a finer level does not know it
    if (kMostOf * static_cast<double>(all) > static_cast<double>(known)) {
      sprawls_[p] = compact(grid, of) ? 0 : 1;
      of.clear();
      continue;
    }
    for (const Share& s : of) {
      if (2 * s.voxels < filled[s.cell] || l.number[s.cell] != 0) continue;
      l.number[s.cell] = static_cast<std::uint16_t>(p + 1);
      const RowId row = s.cell / kRow;
      if (block.rows.empty() || block.rows.back().row != row) block.rows.push_back({row, 0});
      block.rows.back().lanes |= 1U << s.cell % kRow;
      ++block.count;
      l.row[row] = 1;
    }
  }
}

// True if a block lies in at most two cells along each axis. Such cells move nearly alike.
bool RigidBlocks::compact(const Grid& grid, const std::vector<Share>& shares) {
  std::array<int, 3> low{}, high{};
  for (const Share& s : shares) {
    const std::array<int, 3> c = grid.coordinates(s.cell);
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = &s == &shares.front() ? c[d] : std::min(low[d], c[d]);
      high[d] = &s == &shares.front() ? c[d] : std::max(high[d], c[d]);
    }
  }
  for (std::size_t d = 0; d < 3; ++d) {
    if (high[d] - low[d] > kCompact) return false;
  }
  return true;
}

void RigidBlocks::find_border(int level) {
  LevelStiffness& couplings = *couplings_[static_cast<std::size_t>(level)];
  const Grid& g = couplings.grid();
  for (std::size_t p = 0; p < count_; ++p) {
    OnLevel& block = levels_[static_cast<std::size_t>(level)].blocks[p];
    bool any = false;
    for (const Run& run : block.rows) {
      for (std::uint32_t lanes = run.lanes; lanes != 0; lanes &= lanes - 1) {
        const VoxelId cell = run.row * kRow + static_cast<VoxelId>(std::countr_zero(lanes));
        const std::array<int, 3> c = g.coordinates(cell);
        for (std::size_t d = 0; d < 3; ++d) {
          block.box.first[d] = any ? std::min(block.box.first[d], c[d]) : c[d];
          block.box.last[d] = any ? std::max(block.box.last[d], c[d]) : c[d];
        }
        any = true;
        std::array<VoxelId, 6> beside;
        bool inside = true;
        for (int n = 0; n < 6; ++n) {
          beside[static_cast<std::size_t>(n)] = n % 2 != 0 ? g.up(cell, n / 2) : g.down(cell, n / 2);
          inside = inside && of(level, beside[static_cast<std::size_t>(n)]) == p + 1;
        }
        if (inside) continue;
        const VoxelSprings springs = couplings.find_springs(cell);
        for (std::size_t n = 0; n < 6; ++n) {
          const bool up = n % 2 != 0;
          const Spring& spring = (up ? springs.up : springs.down)[n / 2];
          if (of(level, beside[n]) == p + 1 || !(spring.along > 0.0F || spring.across > 0.0F)) continue;
          block.border.push_back({cell, beside[n], spring, static_cast<std::uint8_t>(n / 2), up});
          for (int axis = 0; axis < 3; ++axis)
            block.stiffness[axis] += static_cast<double>(spring.on(axis, static_cast<int>(n / 2)));
        }
      }
    }
  }
}

void RigidBlocks::find_filled_rows(int level) {
  const LevelStiffness& couplings = *couplings_[static_cast<std::size_t>(level)];
  const Grid& g = couplings.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    std::uint8_t& known = levels_[static_cast<std::size_t>(level)].row[row];
    if (known == 0) continue;
    bool all = true, above = level + 1 < static_cast<int>(levels_.size());
    for (VoxelId v = row * kRow; v < (row + 1) * kRow && all; ++v) {
      const std::uint16_t number = of(level, v);
      all = number != 0 || !couplings.has_voxel(g.coordinates(v));
      above = above && (number == 0 || on(level + 1, number - 1U).count > 0);
    }
    if (all) known = above ? kFilledKnown : kFilled;
  }
}

void RigidBlocks::find_loaded() {
  for (std::size_t p = 0; p < count_; ++p) {
    for (const Run& run : on(0, p).rows) {
      for (std::uint32_t lanes = run.lanes; lanes != 0; lanes &= lanes - 1) {
        const VoxelId v = run.row * kRow + static_cast<VoxelId>(std::countr_zero(lanes));
        const std::array<int, 3> c = lattice_.coordinates(v);
        bool inside = true;
        for (int n = 0; n < 27 && inside; ++n) {
          const VoxelId w = lattice_.at(c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1);
          inside = !lattice_.filled(w) || lattice_.block(w) == p + 1;
        }
        if (!inside) loaded_[p].push_back(v);
      }
    }
  }
}

std::size_t RigidBlocks::memory_bytes() const {
  std::size_t bytes = 0;
  for (const Level& l : levels_) {
    bytes += l.number.resident_bytes() + l.row.size();
    for (const OnLevel& block : l.blocks)
      bytes += sizeof(block) + block.rows.capacity() * sizeof(Run) + block.border.capacity() * sizeof(Link);
  }
  for (std::size_t p = 0; p < count_; ++p)
    bytes += loaded_[p].capacity() * sizeof(VoxelId) + surface_[p].capacity() * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace voxel
