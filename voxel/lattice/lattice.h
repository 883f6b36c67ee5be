// SPDX-License-Identifier: GPL-3.0-or-later
// The object at rest: its voxels, the stiffness and limits of their links, and the anchors.
//
// A lattice is constant after construction. A voxel stores its label only. The stiffness of a link follows
// from the labels around it (voxel/lattice/link_stiffness.h), its limits from the labels at its two ends, and
// rest positions from the index (see row_grid.h).
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

// Material of a label.
struct LinkMaterial {
  double young_Pa = 5e3;
  double poisson = 0.3;
  double stretch_min = 0.4;  // shortest, in rest lengths
  double stretch_max = 1.6;  // longest
  double shear = 0.6;        // largest slip across the link, in rest lengths
  // Yield strain: a link keeps the strain beyond it (voxel/lattice/plasticity.h).
  double yield = std::numeric_limits<double>::infinity();
  // Cells whose softest voxel has this material use the accurate energy (voxel/fem/deferred_correction.h)
  // instead of links.
  bool bricks = false;

  // If true, linked voxels of such materials move as one block.
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

// Towards ν = 0.5 bricks become many times stiffer in volume than links, and convergence slows by the same
// factor.
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

// Springs of the six links of a voxel, and per axis 1 / (sum of their stiffness); 0 if the voxel cannot move.
struct VoxelSprings {
  std::array<Spring, 3> up, down;
  std::array<float, 3> inverse{};

  // Call it for movable voxels only: the springs of others may add up to 0.
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
  // Throws std::invalid_argument, with a message for the user, if there is no voxel or no anchor (a free
  // object has no equilibrium force), a material is out of range, or there are more than 2^31 cells.
  Lattice(const LabelVolume& volume, const LatticeOptions& options);
  // Builds the same lattice, but returns the volume's memory to the system while reading it and leaves the
  // volume empty.
  Lattice(LabelVolume&& volume, const LatticeOptions& options);

  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] std::size_t size() const { return label_.size(); }  // cells of the grid, border included
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
  // Lane bits of a row: its voxels; its anchored voxels.
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
  // Force (N) that stretches an average link of full area to twice its length: the scale for residuals.
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

  // Surface voxels (at least one of six neighbours missing), by ascending id. surface_number() is the index
  // of v among them, kNoSurface for other voxels.
  static constexpr std::uint32_t kNoSurface = 0xFFFFFFFFU;
  [[nodiscard]] std::span<const VoxelId> surface() const { return surface_; }
  [[nodiscard]] std::uint32_t surface_number(VoxelId v) const noexcept;
  // Surface numbers of the voxels in a row: a half-open range [first, second).
  [[nodiscard]] std::array<std::uint32_t, 2> surface_in(RowId row) const noexcept;
  // Outward unit normal of a surface voxel at rest, from its 26 neighbours (volume frame). 0 if their
  // directions cancel, as in a sheet one voxel thick.
  [[nodiscard]] glm::dvec3 outward(VoxelId v) const noexcept;

  // Spring of the link v → up(v, d); 0 if an end is missing. Reads up to eighteen labels, so a tick uses
  // LevelStiffness instead.
  [[nodiscard]] Spring spring(VoxelId v, int d) const noexcept;
  [[nodiscard]] VoxelSprings springs_of(VoxelId v) const noexcept;
  // Common label of a row, of the eight rows beside it and of the voxels beyond the ends of all nine; 0 if
  // they differ. With a common label, every link of the row's voxels lies within this label.
  [[nodiscard]] std::uint8_t inside(RowId row) const {
    return (rows_[row] & kCount) == kInside ? labels(row)[0] : std::uint8_t{0};
  }
  [[nodiscard]] const Spring& spring_within(std::uint8_t label, int d) const {
    return within_[static_cast<std::size_t>(d)][material_[label]];
  }
  // Number of a voxel's material; equal materials share a number. 0: no voxel.
  [[nodiscard]] std::uint8_t material(VoxelId v) const { return material_[label_[v]]; }
  [[nodiscard]] std::uint8_t material_of(std::uint8_t label) const { return material_[label]; }
  // Materials by number; [0] is a placeholder.
  [[nodiscard]] std::span<const LinkMaterial> materials() const { return materials_; }
  [[nodiscard]] bool has_bricks() const { return has_bricks_; }

  // Blocks without slack: connected components of two or more voxels whose links have a fixed length, so that
  // they move as one. A component with an anchor is anchored throughout. The kMaxBlocks largest of the others
  // are numbered from 1 on; 0: in no block.
  static constexpr std::size_t kMaxBlocks = 1024;
  [[nodiscard]] std::size_t block_count() const { return block_count_; }
  [[nodiscard]] std::uint16_t block(VoxelId v) const {
    return block_count_ == 0 ? std::uint16_t{0} : block_[v];
  }
  // Spring of a link in +d whose parallels (link_stiffness.h) lead from materials `from` to materials `to`.
  [[nodiscard]] Spring spring_among(const std::array<std::uint8_t, 9>& from,
                                    const std::array<std::uint8_t, 9>& to, int d) const noexcept;

  // Limit of the link v → up(v, d); meaningful only if both ends are filled.
  [[nodiscard]] const LinkLimit& limit(VoxelId v, int d) const {
    return limits_[static_cast<std::size_t>(d)][pair_of(label_[v], label_[grid_.up(v, d)])];
  }
  // Limit of a link in direction d between two labels.
  [[nodiscard]] const LinkLimit& limit_between(std::uint8_t a, std::uint8_t b, int d) const {
    return limits_[static_cast<std::size_t>(d)][pair_of(a, b)];
  }
  // Bounds of u(b) − u(a) on `axis` for the link v → up(v, d).
  [[nodiscard]] std::array<float, 2> bounds(VoxelId v, int d, int axis) const {
    const LinkLimit& l = limit(v, d);
    return axis == d ? std::array<float, 2>{l.along_low, l.along_high}
                     : std::array<float, 2>{-l.across, l.across};
  }
  // Tightest limits of all links in direction d. A difference within them satisfies any link's own limit.
  [[nodiscard]] const LinkLimit& tightest(int d) const { return tightest_[static_cast<std::size_t>(d)]; }
  // True if all links of a direction have the same limits, which are then those of tightest().
  [[nodiscard]] bool uniform_limits() const { return uniform_limits_; }

  // has_plasticity(): some link has a finite yield. yield_m(): difference (m, on any axis) beyond which the
  // link v → up(v, d) yields. It is the smaller yield of the two ends' materials; infinite: the link never
  // yields. first_yield_m(): the smallest yield_m() in direction d.
  [[nodiscard]] bool has_plasticity() const { return has_plasticity_; }
  [[nodiscard]] float yield_m(VoxelId v, int d) const {
    return yield_m_[static_cast<std::size_t>(d)][pair_of(label_[v], label_[grid_.up(v, d)])];
  }
  [[nodiscard]] float first_yield_m(int d) const { return first_yield_m_[static_cast<std::size_t>(d)]; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // One byte a row. Low bits: number of voxels, or kInside if the row is full and inside a label (see
  // inside()). Top two bits: which of its voxels are anchored.
  enum class Anchors : std::uint8_t { none = 0, all = 1, some = 2 };
  // kCount: mask of the six bits that count voxels. kInside: value of these bits in rows inside one label.
  static constexpr std::uint8_t kCount = 63, kInside = kRow + 1;
  static constexpr int kAnchorShift = 6;         // position of the two bits of Anchors
  static constexpr std::size_t kListBlock = 64;  // rows per entry of listed_before_
  [[nodiscard]] Anchors anchors_of(RowId row) const { return Anchors(rows_[row] >> kAnchorShift); }
  // Anchored lanes of a row with Anchors::some.
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
  // ---- blocks without slack (rigid_components.cpp) ----
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
  bool uniform_limits_ = true, has_plasticity_ = false, has_bricks_ = false;
  std::size_t voxel_count_ = 0, anchored_count_ = 0, material_count_ = 1;
  LazyArray<std::uint8_t> label_, rows_;
  std::vector<std::uint32_t> listed_before_;  // [row / kListBlock] rows in anchored_ with smaller ids
  std::vector<std::uint32_t> anchored_;       // lanes of the rows with Anchors::some
  std::array<std::uint8_t, 256> material_{};  // [label] number of its material; 0: empty
  std::vector<LinkMaterial> materials_;       // [material]
  std::vector<LinkModuli> moduli_;            // [material]; [0]: none
  std::array<double, 3> area_by_length_m_{};
  std::array<std::vector<Spring>, 3> within_;     // [d][material]
  std::array<std::vector<LinkLimit>, 3> limits_;  // [d][material a · material_count + material b]
  std::array<LinkLimit, 3> tightest_;
  std::array<std::vector<float>, 3> yield_m_;  // indexed as limits_
  std::array<float, 3> first_yield_m_{};
  LazyArray<std::uint16_t> block_;  // [v]; empty: no block
  std::size_t block_count_ = 0;
  std::vector<VoxelId> surface_;
  std::vector<std::uint32_t> surface_before_;  // [id / kSurfaceBlock] surface voxels with smaller ids
};

}  // namespace voxel
