// SPDX-License-Identifier: GPL-3.0-or-later
// Look-up of an object's anchors for the coarse levels of a CompositeGrid (coarse_material.h).
#include <algorithm>
#include <bit>
#include <limits>

#include "voxel/composite/coarse_material.h"

namespace voxel {
namespace {

using composite::index;

}  // namespace

void CoarseMaterial::mark_anchors() {
  for (std::size_t m = kFirstAnchorLevel; m < levels_.size(); ++m)
    levels_[m].anchored.assign(
        index(levels_[m].dims[0]) * index(levels_[m].dims[1]) * index(levels_[m].dims[2]), 0);
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    const std::uint32_t lanes = lattice_.anchored_lanes(row);
    if (lanes == 0) continue;
    const auto c = g.row_coordinates(row);
    for (int i = 0; i < kRow; ++i) {
      if ((lanes >> i & 1U) == 0) continue;
      const Index3 p{(c[0] - 1) * kRow + i, c[1], c[2]};
      for (std::size_t m = kFirstAnchorLevel; m < levels_.size(); ++m) {
        std::uint8_t& mark = levels_[m].anchored[levels_[m].at({p[0] >> m, p[1] >> m, p[2] >> m})];
        if (mark != 0) break;
        mark = 1;
      }
    }
  }
}

void CoarseMaterial::list_anchor_faces() {
  const auto in_whole_side = [this](const Index3& p) {
    for (std::size_t d = 0; d < 3; ++d) {
      if ((p[d] == 0 && anchored_share_[d][0] == 1.0) ||
          (p[d] == dims_[d] - 1 && anchored_share_[d][1] == 1.0))
        return true;
    }
    return false;
  };
  bool scattered = false;
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    for (std::uint32_t lanes = lattice_.anchored_lanes(row); lanes != 0; lanes &= lanes - 1) {
      const Index3 p = lattice_.coordinates(row * kRow + static_cast<VoxelId>(std::countr_zero(lanes)));
      scattered = scattered || !in_whole_side(p);
      for (std::uint8_t d = 0; d < 3; ++d) {
        for (std::uint8_t signs = 0; signs < 8; ++signs) add_anchor_face(p, d, signs);
      }
    }
  }
  if (!scattered) {
    anchor_faces_ = {};
    return;
  }
  sort_by_cube(anchor_faces_);
}

// Adds a quarter of a face if two things hold: the neighbour is tissue that may move, and the cell has all
// its voxels.
void CoarseMaterial::add_anchor_face(const Index3& voxel, std::uint8_t d, std::uint8_t signs) {
  const auto sign = [signs](int bit) { return (signs >> bit & 1) != 0 ? 1 : -1; };
  const auto at = [&](int along, int p, int q) {
    Index3 v = voxel;
    v[d] += along * sign(0);
    v[(d + 1U) % 3] += p * sign(1);
    v[(d + 2U) % 3] += q * sign(2);
    return lattice_.at(v[0], v[1], v[2]);
  };
  if (!lattice_.filled(at(1, 0, 0)) || lattice_.anchored(at(1, 0, 0))) return;
  for (const int along : {0, 1}) {
    if (!lattice_.filled(at(along, 1, 0)) || !lattice_.filled(at(along, 0, 1)) ||
        !lattice_.filled(at(along, 1, 1)))
      return;
  }
  PackedFace face{{}, static_cast<std::uint8_t>(d << 3U | signs), std::numeric_limits<std::uint8_t>::max()};
  for (const int along : {0, 1}) {
    for (const int p : {0, 1}) {
      for (const int q : {0, 1}) face.rank = std::min(face.rank, rank_[lattice_.label(at(along, p, q))]);
    }
  }
  for (std::size_t e = 0; e < 3; ++e) face.voxel[e] = static_cast<std::uint16_t>(voxel[e]);
  anchor_faces_.items.push_back(face);
}

bool CoarseMaterial::anchor_near(const Index3& p, const Index3& q, int span) const noexcept {
  std::size_t m = kFirstAnchorLevel;
  while ((1 << m) < span && m + 1 < levels_.size()) ++m;
  const CubeLevel& level = levels_[m];
  Index3 first{}, last{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = std::max((std::min(p[d], q[d]) - offset_[d] - span / 2) >> m, 0);
    last[d] = std::min((std::max(p[d], q[d]) - offset_[d] + span / 2) >> m, level.dims[d] - 1);
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      for (int i = first[0]; i <= last[0]; ++i) {
        if (level.anchored[level.at({i, j, k})] != 0) return true;
      }
    }
  }
  return false;
}

// Start of the nearest line along d that has tissue in it and is at most `links` / 2 away (voxels). If there
// is none, the start of the line at p.
CoarseMaterial::Index3 CoarseMaterial::nearest_tissue_line(const Index3& p, std::size_t d,
                                                           int links) const noexcept {
  const auto any = [&](Index3 q) {
    for (int t = 0; t <= links; ++t, ++q[d]) {
      if (is_filled(q)) return true;
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

CoarseMaterial::AnchorSearch CoarseMaterial::anchors_along(const Index3& p, std::size_t d,
                                                           int links) const noexcept {
  AnchorSearch found;
  Index3 end = p;
  end[d] += links;
  if (!anchor_near(p, end, links)) return found;
  if (fills_box_) return anchors_in_box(p, d, links);
  Index3 q = nearest_tissue_line(p, d, links);
  bool before = false;
  for (int t = 0; t <= links; ++t, ++q[d]) {
    const bool here = is_filled(q);
    if (here && before) ++found.links;
    before = here;
    if (!here) continue;
    if (!is_anchored(q)) continue;
    // An anchor at an end of the line belongs to the node there, not to the link.
    if (t > 0 && found.ahead == 0) found.ahead = t;
    if (t < links) found.back = links - t;
  }
  return found;
}

// anchors_along() of an object that fills its box: the links follow from the box, and cubes without anchors
// are skipped.
CoarseMaterial::AnchorSearch CoarseMaterial::anchors_in_box(const Index3& p, std::size_t d,
                                                            int links) const noexcept {
  AnchorSearch found;
  Index3 q = p;
  for (const std::size_t e : {(d + 1) % 3, (d + 2) % 3}) q[e] = std::clamp(q[e], low(e), high(e));
  const int first = std::max(low(d) - p[d], 0), last = std::min(high(d) - p[d], links);
  found.links = std::max(last - first, 0);
  if (first > last) return found;
  const CubeLevel& level = levels_[kFirstAnchorLevel];
  const auto anchor_at = [&](int t) {
    q[d] = p[d] + t;
    return is_anchored(q);
  };
  // Position of the first anchor from `from` to `to`, in steps of ±1; links + 1: there is none.
  const auto scan = [&](int from, int to, int step) {
    for (int t = from; step > 0 ? t <= to : t >= to;) {
      const int at = p[d] + t - offset_[d];
      Index3 cube{};
      for (std::size_t e = 0; e < 3; ++e) cube[e] = (q[e] - offset_[e]) >> kFirstAnchorLevel;
      cube[d] = at >> kFirstAnchorLevel;
      if (level.anchored[level.at(cube)] == 0) {
        const int edge = cube[d] << kFirstAnchorLevel;  // continue in the next cube
        t += step > 0 ? edge + (1 << kFirstAnchorLevel) - at : edge - 1 - at;
        continue;
      }
      if (anchor_at(t)) return t;
      t += step;
    }
    return links + 1;
  };
  // Anchors at the ends of the line belong to the nodes there.
  const int ahead = scan(std::max(first, 1), last, 1), back = scan(std::min(last, links - 1), first, -1);
  if (ahead <= links) found.ahead = ahead;
  if (back <= links) found.back = links - back;
  return found;
}

bool CoarseMaterial::is_unbroken(Index3 p, std::size_t d, int count) const noexcept {
  for (int t = 0; t < count; ++t, ++p[d]) {
    if (!is_filled(p)) return false;
  }
  return true;
}

}  // namespace voxel
