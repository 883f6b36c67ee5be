// SPDX-License-Identifier: GPL-3.0-or-later
// The constant half of a soft object: which voxels there are, how stiff each link is, how far each link
// may stretch, what is anchored. Nothing here changes while a person touches it.
//
// A voxel costs its label: a link's stiffness follows from the labels around it
// (voxel/lattice/link_stiffness.h), its limits from those at its two ends, and rest positions from the index
// (see row_grid.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/link_stiffness.h"
#include "voxel/lattice/row_grid.h"
#include "voxel/volume/label_volume.h"

namespace voxel {

// What a label is made of.
struct LinkMaterial {
  double young_Pa = 5e3;
  double poisson = 0.3;
  double stretch_min = 0.4;  // shortest, in rest lengths
  double stretch_max = 1.6;  // longest
  double shear = 0.6;        // most slip across the link, in its rest length
  // Strain beyond which a link keeps what is beyond (voxel/lattice/plasticity.h), of its rest length.
  double yield = std::numeric_limits<double>::infinity();
  // Cells of which it is the softest are of the accurate energy (voxel/fem/deferred_correction.h), not of
  // links.
  bool bricks = false;

  // Voxels of such materials that are linked to one another only move as one.
  [[nodiscard]] bool without_slack() const {
    return stretch_min >= 1.0 && stretch_max <= 1.0 && shear <= 0.0;
  }

  friend bool operator==(const LinkMaterial&, const LinkMaterial&) = default;
};

// Bounds of the displacement difference u(b) − u(a) of a link a→b in +d (unit: meter).
struct LinkLimit {
  float along_low = 0.0F, along_high = 0.0F;  // along the link; low <= 0 <= high
  float across = 0.0F;                        // across it, both ways; >= 0
};

// Towards 0.5 bricks are ever so much stiffer in volume than links, and it takes as many times longer until
// they are at rest.
inline constexpr double kMostPoissonOfBricks = 0.49;

struct LatticeOptions {
  std::array<LinkMaterial, 256> materials;  // by label; [0] unused
  std::vector<std::string> anchor_faces;    // "-x" … "+z": outermost voxels on that side of the lattice
  std::vector<std::uint8_t> anchor_labels;
  std::vector<std::size_t> anchor_voxels;  // indices into the volume's labels
};

// Stiffness of one link (unit: N/m).
struct Spring {
  float along = 0.0F, across = 0.0F;

  [[nodiscard]] float on(int axis, int d) const { return axis == d ? along : across; }

  friend bool operator==(const Spring&, const Spring&) = default;
};

// The six links of a voxel, by direction, and 1 / Σ of them on each axis, 0 where nothing may move.
struct VoxelSprings {
  std::array<Spring, 3> up, down;
  std::array<float, 3> inverse{};

  // Of a voxel that may move.
  void set_inverse() noexcept {
    for (int axis = 0; axis < 3; ++axis) {
      float sum = 0.0F;
      for (std::size_t d = 0; d < 3; ++d)
        sum += up[d].on(axis, static_cast<int>(d)) + down[d].on(axis, static_cast<int>(d));
      inverse[static_cast<std::size_t>(axis)] = sum > 0.0F ? 1.0F / sum : 0.0F;
    }
  }
};

class Lattice {
 public:
  // Throws std::invalid_argument in words: no voxel, no anchor (a free object has no equilibrium force), a
  // material out of range, more than 2^31 cells.
  Lattice(const LabelVolume& volume, const LatticeOptions& options);
  // The same; what was read of the volume gives its memory back meanwhile, and the volume holds nothing more.
  Lattice(LabelVolume&& volume, const LatticeOptions& options);

  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] std::size_t size() const { return label_.size(); }  // of the grid, the border included
  [[nodiscard]] std::size_t voxel_count() const { return voxel_count_; }
  [[nodiscard]] std::size_t anchored_count() const { return anchored_count_; }
  [[nodiscard]] bool filled(VoxelId v) const { return label_[v] != 0; }
  [[nodiscard]] bool anchored(VoxelId v) const {
    const Anchors which = anchors_of(v / kRow);
    if (which == Anchors::none) return false;
    return which == Anchors::all ? filled(v) : (listed_anchors(v / kRow) >> v % kRow & 1U) != 0;
  }
  [[nodiscard]] std::uint8_t label(VoxelId v) const { return label_[v]; }
  [[nodiscard]] const std::uint8_t* labels(RowId row) const {
    return label_.data() + row * std::size_t{kRow};
  }
  // Bits of a row's lanes: where there is a voxel, where an anchored one.
  [[nodiscard]] std::uint32_t filled_lanes(RowId row) const noexcept;
  [[nodiscard]] std::uint32_t anchored_lanes(RowId row) const noexcept {
    const Anchors which = anchors_of(row);
    if (which == Anchors::none) return 0;
    return which == Anchors::all ? filled_lanes(row) : listed_anchors(row);
  }
  [[nodiscard]] int filled_in(RowId row) const { return std::min(rows_[row] & kCount, kRow); }
  [[nodiscard]] const glm::dvec3& spacing_m() const { return spacing_m_; }
  [[nodiscard]] double min_spacing_m() const { return min_spacing_m_; }
  [[nodiscard]] double max_spacing_m() const { return max_spacing_m_; }
  // Force that stretches an average link, were it a whole one, to twice its length (unit: newton): the scale
  // by which residuals are small.
  [[nodiscard]] double force_scale_N() const { return force_scale_N_; }

  [[nodiscard]] VoxelId at(int i, int j, int k) const { return grid_.at(i, j, k); }
  [[nodiscard]] std::array<int, 3> coordinates(VoxelId v) const { return grid_.coordinates(v); }
  [[nodiscard]] VoxelId up(VoxelId v, int d) const { return grid_.up(v, d); }
  [[nodiscard]] VoxelId down(VoxelId v, int d) const { return grid_.down(v, d); }
  // Centre of a voxel at rest, volume frame (unit: meter).
  [[nodiscard]] glm::dvec3 rest(VoxelId v) const {
    const auto c = coordinates(v);
    return {c[0] * spacing_m_.x, c[1] * spacing_m_.y, c[2] * spacing_m_.z};
  }

  // Voxels with a missing neighbour, in the order of their ids, and the number of one of them among these;
  // kNoSurface for one inside.
  static constexpr std::uint32_t kNoSurface = 0xFFFFFFFFU;
  [[nodiscard]] std::span<const VoxelId> surface() const { return surface_; }
  [[nodiscard]] std::uint32_t surface_number(VoxelId v) const noexcept;
  // The numbers of those in a row: from the first on, up to but without the second.
  [[nodiscard]] std::array<std::uint32_t, 2> surface_in(RowId row) const noexcept;
  // Away from the object at a surface voxel at rest, by its 26 neighbours: unit, volume frame; 0 where these
  // do not say, in a sheet one voxel thick.
  [[nodiscard]] glm::dvec3 outward(VoxelId v) const noexcept;

  // Of the link v → up(v, d); nothing where an end is missing. It looks at up to eighteen labels: what a tick
  // asks for, it asks of LevelStiffness.
  [[nodiscard]] Spring spring(VoxelId v, int d) const noexcept;
  [[nodiscard]] VoxelSprings springs_of(VoxelId v) const noexcept;
  // The label that a row, the eight rows beside it and the voxels beyond all their ends are of, all of them;
  // 0 where they are not of one. Every link of the row's voxels is then within that label.
  [[nodiscard]] std::uint8_t inside(RowId row) const {
    return (rows_[row] & kCount) == kInside ? labels(row)[0] : std::uint8_t{0};
  }
  [[nodiscard]] const Spring& spring_within(std::uint8_t label, int d) const {
    return within_[static_cast<std::size_t>(d)][material_[label]];
  }
  // Number of a voxel's material; equal ones share it. 0: no voxel.
  [[nodiscard]] std::uint8_t material(VoxelId v) const { return material_[label_[v]]; }
  [[nodiscard]] std::uint8_t material_of(std::uint8_t label) const { return material_[label]; }
  // The materials by that number; of [0] nothing is true.
  [[nodiscard]] std::span<const LinkMaterial> materials() const { return materials_; }
  [[nodiscard]] bool has_bricks() const { return has_bricks_; }

  // Parts without slack: voxels whose links to one another are of one length, two at least, and which so only
  // move as one. Those that are anchored somewhere are anchored throughout. Of the others the kMaxBlocks with
  // most voxels have numbers from 1 on; 0: in none of these.
  static constexpr std::size_t kMaxBlocks = 1024;
  [[nodiscard]] std::size_t block_count() const { return block_count_; }
  [[nodiscard]] std::uint16_t part(VoxelId v) const {
    return block_count_ == 0 ? std::uint16_t{0} : part_[v];
  }
  // Of a link in +d whose parallels (link_stiffness.h) leave voxels of materials `from` and end in `to`.
  [[nodiscard]] Spring spring_among(const std::array<std::uint8_t, 9>& from,
                                    const std::array<std::uint8_t, 9>& to, int d) const noexcept;

  // Limit of the link v → up(v, d); only meaningful where both ends are filled.
  [[nodiscard]] const LinkLimit& limit(VoxelId v, int d) const {
    return limits_[static_cast<std::size_t>(d)][pair_of(label_[v], label_[grid_.up(v, d)])];
  }
  // Of a link in direction d between two labels.
  [[nodiscard]] const LinkLimit& limit_between(std::uint8_t a, std::uint8_t b, int d) const {
    return limits_[static_cast<std::size_t>(d)][pair_of(a, b)];
  }
  // Bounds of u(b) − u(a) on `axis` for the link v → up(v, d).
  [[nodiscard]] std::array<float, 2> bounds(VoxelId v, int d, int axis) const {
    const LinkLimit& l = limit(v, d);
    return axis == d ? std::array<float, 2>{l.along_low, l.along_high}
                     : std::array<float, 2>{-l.across, l.across};
  }
  // No link in direction d is tighter than this: where it holds, no link needs to be looked at one by one.
  [[nodiscard]] const LinkLimit& tightest(int d) const { return tightest_[static_cast<std::size_t>(d)]; }
  // Every link in a direction has the same limits: those of tightest().
  [[nodiscard]] bool uniform_limits() const { return uniform_limits_; }

  // Does any link yield; from which difference on, on any axis, the link v → up(v, d) does, that of its ends
  // which yields first (m, infinite: never); and from which on some link in that direction does.
  [[nodiscard]] bool yields() const { return yields_; }
  [[nodiscard]] float yield_m(VoxelId v, int d) const {
    return yield_m_[static_cast<std::size_t>(d)][pair_of(label_[v], label_[grid_.up(v, d)])];
  }
  [[nodiscard]] float first_yield_m(int d) const { return first_yield_m_[static_cast<std::size_t>(d)]; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // What is known of a row in one byte: how many voxels it has, and, beyond kRow, that it is full and inside
  // a label (see inside()); above that which of its voxels are anchored. A byte for each voxel was rejected:
  // anchors on a side of an object lie in all of its pages.
  enum class Anchors : std::uint8_t { none = 0, all = 1, some = 2 };
  static constexpr std::uint8_t kCount = 63, kInside = kRow + 1;
  static constexpr int kAnchorShift = 6;
  static constexpr std::size_t kListBlock = 64;  // rows
  [[nodiscard]] Anchors anchors_of(RowId row) const { return Anchors(rows_[row] >> kAnchorShift); }
  // Of a row in which some voxels are anchored and others are not.
  [[nodiscard]] std::uint32_t listed_anchors(RowId row) const noexcept;

  [[nodiscard]] std::size_t pair_of(std::uint8_t a, std::uint8_t b) const {
    return std::size_t{material_[a]} * material_count_ + material_[b];
  }
  Lattice(const LabelVolume& volume, const LatticeOptions& options, std::uint8_t* give_back);
  void fill_labels(const LabelVolume& volume, std::uint8_t* give_back);
  void fill_anchors(const LabelVolume& volume, const LatticeOptions& options);
  void list_anchors(const LazyArray<std::uint32_t>& lanes);
  void fill_inside();
  void fill_links(const LatticeOptions& options);
  void fill_force_scale();
  void find_surface();
  // ---- parts without slack (rigid_components.cpp) ----
  [[nodiscard]] bool without_slack(VoxelId v) const {
    return materials_[material_[label_[v]]].without_slack();
  }
  [[nodiscard]] bool any_without_slack() const;
  template <class Enter>
  void flood(std::vector<VoxelId>& voxels, const Enter& enter) const;
  void anchor_blocks(LazyArray<std::uint32_t>& lanes);
  void find_blocks();
  [[nodiscard]] std::uint32_t surface_from(VoxelId v) const noexcept;

  Grid grid_;
  glm::dvec3 spacing_m_{1e-3};
  double min_spacing_m_ = 1e-3, max_spacing_m_ = 1e-3;
  double force_scale_N_ = 0.0;
  bool uniform_limits_ = true, yields_ = false, has_bricks_ = false;
  std::size_t voxel_count_ = 0, anchored_count_ = 0, material_count_ = 1;
  LazyArray<std::uint8_t> label_, rows_;
  std::vector<std::uint32_t> listed_before_;  // [row / kListBlock] rows in anchored_ with smaller ids
  std::vector<std::uint32_t> anchored_;       // lanes of rows of which some are
  std::array<std::uint8_t, 256> material_{};  // label → number among equal materials; 0: empty
  std::vector<LinkMaterial> materials_;       // [material]
  std::vector<LinkModuli> moduli_;            // [material]; [0]: none
  std::array<double, 3> area_by_length_m_{};
  std::array<std::vector<Spring>, 3> within_;     // [d][material]
  std::array<std::vector<LinkLimit>, 3> limits_;  // [d][material a · material_count + material b]
  std::array<LinkLimit, 3> tightest_;
  std::array<std::vector<float>, 3> yield_m_;  // as limits_
  std::array<float, 3> first_yield_m_{};
  LazyArray<std::uint16_t> part_;  // [v]; empty: there is none
  std::size_t block_count_ = 0;
  std::vector<VoxelId> surface_;
  std::vector<std::uint32_t> surface_before_;  // [id / kSurfaceBlock] surface voxels with smaller ids
};

}  // namespace voxel
