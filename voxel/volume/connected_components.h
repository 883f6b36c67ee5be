// SPDX-License-Identifier: GPL-3.0-or-later
// Connected components of a label volume, by runs along its rows.
// Voxels are connected by faces. Memory grows with the number of runs, not of voxels. Components ("pieces")
// are numbered without gaps, in the order of their first run.
#pragma once

#include <cstdint>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace voxel {

// Face-connected components of the voxels whose label is in `chosen` (indexed by label).
class ConnectedRuns {
 public:
  struct Run {
    int first = 0, last = 0;  // first and last voxel in the row, inclusive
    std::uint32_t piece = 0;
  };
  ConnectedRuns(const LabelVolume& volume, const std::vector<bool>& chosen);

  [[nodiscard]] std::uint32_t pieces() const { return pieces_; }
  [[nodiscard]] const std::vector<Run>& runs() const { return runs_; }
  // Index of the first run of a row; row = j + k·dims[1].
  [[nodiscard]] std::size_t row_begin(std::size_t row) const { return row_begin_[row]; }
  [[nodiscard]] std::size_t rows() const { return row_begin_.size() - 1; }
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  // The component of a voxel; kNone if the voxel's label is not chosen.
  [[nodiscard]] std::uint32_t piece_of(int i, std::size_t row) const;

 private:
  std::vector<Run> runs_;
  std::vector<std::size_t> row_begin_;
  std::uint32_t pieces_ = 0;
};

// Union-find with path halving. Each set is represented by its smallest member.
class DisjointSets {
 public:
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  std::uint32_t find(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[a < b ? b : a] = a < b ? a : b;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace voxel
