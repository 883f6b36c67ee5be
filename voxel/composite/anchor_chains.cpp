// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/anchor_chains.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

namespace voxel {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

// Shortest paths from all anchors over the links, on one axis and in one direction. Each round relaxes the
// links of the voxels that the last round improved (Bellman & Ford).
class ChainSearch {
 public:
  explicit ChainSearch(const Lattice& lattice) : lattice_(lattice), away_m_(lattice.size(), kFar) {
    const Grid& g = lattice.grid();
    for (RowId row = 0; row < g.rows(); ++row) {
      for (std::uint32_t lanes = lattice.anchored_lanes(row); lanes != 0; lanes &= lanes - 1)
        anchors_.push_back(row * kRow + static_cast<VoxelId>(std::countr_zero(lanes)));
    }
  }

  // Extensions (m) by voxel. `grows`: of positive displacements, else of negative ones.
  const std::vector<float>& find(int axis, bool grows) {
    std::fill(away_m_.begin(), away_m_.end(), kFar);
    improved_ = anchors_;
    for (const VoxelId v : anchors_) away_m_[v] = 0.0F;
    while (!improved_.empty()) {
      front_.swap(improved_);
      improved_.clear();
      for (const VoxelId v : front_) {
        for (int d = 0; d < 3; ++d) {
          // u(up) − u(v) lies within bounds[0] … bounds[1].
          const VoxelId up = lattice_.up(v, d), down = lattice_.down(v, d);
          if (lattice_.filled(up)) relax(v, up, extension(v, d, axis, grows));
          if (lattice_.filled(down)) relax(v, down, extension(down, d, axis, !grows));
        }
      }
    }
    return away_m_;
  }

 private:
  [[nodiscard]] float extension(VoxelId low, int d, int axis, bool grows) const {
    const std::array<float, 2> bounds = lattice_.bounds(low, d, axis);
    return grows ? bounds[1] : -bounds[0];
  }
  void relax(VoxelId from, VoxelId to, float by_m) {
    const float away_m = away_m_[from] + by_m;
    if (away_m >= away_m_[to]) return;
    away_m_[to] = away_m;
    improved_.push_back(to);
  }

  const Lattice& lattice_;
  std::vector<float> away_m_;
  std::vector<VoxelId> anchors_, front_, improved_;
};

}  // namespace

std::vector<ChainExtension> chains_to_anchors(const Lattice& lattice) {
  const auto surface = lattice.surface();
  std::vector<ChainExtension> chains(surface.size());
  ChainSearch search(lattice);
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool grows : {false, true}) {
      const std::vector<float>& away_m = search.find(axis, grows);
      for (std::size_t s = 0; s < surface.size(); ++s)
        chains[s][static_cast<std::size_t>(axis)][grows ? 1 : 0] = away_m[surface[s]];
    }
  }
  return chains;
}

}  // namespace voxel
