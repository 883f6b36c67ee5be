// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/connected_components.h"

#include <algorithm>

namespace voxel {

ConnectedRuns::ConnectedRuns(const LabelVolume& volume, const std::vector<bool>& chosen) {
  const int nx = volume.dims[0], ny = volume.dims[1], nz = volume.dims[2];
  const auto rows = static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  row_begin_.assign(rows + 1, 0);
  DisjointSets sets;
  // Joins the overlapping runs of two rows that share a face.
  const auto join_rows = [&](std::size_t row, std::size_t other) {
    std::size_t a = row_begin_[row], b = row_begin_[other];
    const std::size_t end_a = runs_.size(), end_b = row_begin_[other + 1];
    while (a < end_a && b < end_b) {
      if (runs_[a].first <= runs_[b].last && runs_[b].first <= runs_[a].last)
        sets.join(runs_[a].piece, runs_[b].piece);
      (runs_[a].last < runs_[b].last ? a : b) += 1;
    }
  };
  std::size_t row = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j, ++row) {
      row_begin_[row] = runs_.size();
      const std::uint8_t* labels = &volume.labels[volume.index(0, j, k)];
      for (int i = 0; i < nx; ++i) {
        if (!chosen[labels[i]]) continue;
        const int first = i;
        while (i + 1 < nx && chosen[labels[i + 1]]) ++i;
        runs_.push_back({first, i, sets.add()});
      }
      row_begin_[row + 1] = runs_.size();
      if (j > 0) join_rows(row, row - 1);
      if (k > 0) join_rows(row, row - static_cast<std::size_t>(ny));
    }
  }
  // Numbers the components without gaps, in the order of their first run.
  std::vector<std::uint32_t> number(runs_.size(), kNone);
  for (Run& run : runs_) {
    std::uint32_t& n = number[sets.find(run.piece)];
    if (n == kNone) n = pieces_++;
    run.piece = n;
  }
}

std::uint32_t ConnectedRuns::piece_of(int i, std::size_t row) const {
  const auto begin = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[row]);
  const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[row + 1]);
  const auto run = std::lower_bound(begin, end, i, [](const Run& r, int at) { return r.last < at; });
  return run != end && run->first <= i ? run->piece : kNone;
}

}  // namespace voxel
