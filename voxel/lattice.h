// SPDX-License-Identifier: GPL-3.0-or-later
// The constant half of a soft object: which voxels there are, how stiff each link is, how far each link
// may stretch, what is anchored. Nothing here changes while a person touches it.
//
// Storage is a dense grid with an empty border of one voxel, so that every voxel has six neighbours and no
// bound is ever checked. Voxel v's neighbour along +d is v + stride(d).
#pragma once

#include <array>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "voxel/volume.h"

namespace voxel {

using VoxelId = std::uint32_t;  // index into the padded grid

// What a label is made of. Springs of E·A/h along a link and G·A/h across it (h its length, A the area a link
// stands for), G = E / (4(1−ν²)): pressing a face then feels the contact modulus E/(1−ν²) of the elastic
// half-space.
struct LinkMaterial {
  double young_Pa = 5e3;
  double poisson = 0.3;
  double stretch_min = 0.4;  // shortest, in rest lengths
  double stretch_max = 1.6;  // longest
  double shear = 0.6;        // most slip across the link, in its rest length
};

// Bounds of the displacement difference u(b) − u(a) of a link a→b in +d (unit: meter).
struct LinkLimit {
  float along_low = 0.0F, along_high = 0.0F;  // along the link; low <= 0 <= high
  float across = 0.0F;                        // across it, both ways; >= 0
};

struct LatticeOptions {
  std::array<LinkMaterial, 256> materials;  // by label; [0] unused
  std::vector<std::string> anchor_faces;    // "-x" … "+z": outermost voxels on that side of the lattice
  std::vector<std::uint8_t> anchor_labels;
  std::vector<std::size_t> anchor_voxels;  // indices into the volume's labels
};

// Springs of one level of the multigrid hierarchy; level 0 is the lattice itself.
struct Springs {
  std::array<int, 3> dims{0, 0, 0};  // padded
  std::array<std::size_t, 3> stride{1, 0, 0};
  std::array<std::vector<float>, 3> along;             // [d][v]: stiffness along link v → v+stride(d) (N/m)
  std::array<std::vector<float>, 3> across;            // [d][v]: across it
  std::array<std::vector<float>, 3> inverse_diagonal;  // [axis][v]: 1 / Σ stiffness; 0 where nothing may move
  std::vector<std::array<int, 2>> row;  // [k·dims[1] + j]: first and one past last filled voxel

  [[nodiscard]] std::size_t size() const { return row.size() * static_cast<std::size_t>(dims[0]); }
  [[nodiscard]] const float* stiffness(int axis, int d) const {
    const auto ud = static_cast<std::size_t>(d);
    return axis == d ? along[ud].data() : across[ud].data();
  }
};

class Lattice {
 public:
  // Throws std::invalid_argument in words: no voxel, no anchor (a free object has no equilibrium force), a
  // material out of range, more than 2^31 cells.
  Lattice(const LabelVolume& volume, const LatticeOptions& options);

  [[nodiscard]] const Springs& springs() const { return springs_; }
  [[nodiscard]] std::size_t stride(int d) const { return springs_.stride[static_cast<std::size_t>(d)]; }
  [[nodiscard]] std::size_t size() const { return label_.size(); }
  [[nodiscard]] std::size_t voxel_count() const { return voxel_count_; }
  [[nodiscard]] std::span<const VoxelId> surface() const { return surface_; }
  [[nodiscard]] bool filled(VoxelId v) const { return label_[v] != 0; }
  [[nodiscard]] bool anchored(VoxelId v) const { return anchored_[v] != 0; }
  [[nodiscard]] std::size_t anchored_count() const { return anchored_count_; }
  [[nodiscard]] std::uint8_t label(VoxelId v) const { return label_[v]; }
  [[nodiscard]] const glm::dvec3& spacing_m() const { return spacing_m_; }
  [[nodiscard]] double min_spacing_m() const { return min_spacing_m_; }
  [[nodiscard]] double max_spacing_m() const { return max_spacing_m_; }
  // Force that stretches an average link to twice its length (unit: newton): the scale by which residuals are
  // small.
  [[nodiscard]] double force_scale_N() const { return force_scale_N_; }

  // Centre of a voxel at rest, volume frame (unit: meter).
  [[nodiscard]] glm::dvec3 rest(VoxelId v) const {
    const auto c = coordinates(v);
    return {(c[0] - 1) * spacing_m_.x, (c[1] - 1) * spacing_m_.y, (c[2] - 1) * spacing_m_.z};
  }
  [[nodiscard]] std::array<int, 3> coordinates(VoxelId v) const {  // padded
    const auto nx = static_cast<std::uint32_t>(springs_.dims[0]),
               ny = static_cast<std::uint32_t>(springs_.dims[1]);
    return {static_cast<int>(v % nx), static_cast<int>((v / nx) % ny), static_cast<int>(v / (nx * ny))};
  }
  [[nodiscard]] VoxelId at(int i, int j, int k) const {  // padded coordinates
    return static_cast<VoxelId>(static_cast<std::size_t>(i) + static_cast<std::size_t>(j) * stride(1) +
                                static_cast<std::size_t>(k) * stride(2));
  }

  // Limit of the link v → v+stride(d); only meaningful where both ends are filled.
  [[nodiscard]] const LinkLimit& limit(VoxelId v, int d) const {
    return limits_[static_cast<std::size_t>(d)]
                  [limit_class_[label_[v]] * class_count_ + limit_class_[label_[v + stride(d)]]];
  }
  // Bounds of u(b) − u(a) on `axis` for the link v → v+stride(d).
  [[nodiscard]] std::array<float, 2> bounds(VoxelId v, int d, int axis) const {
    const LinkLimit& l = limit(v, d);
    return axis == d ? std::array<float, 2>{l.along_low, l.along_high}
                     : std::array<float, 2>{-l.across, l.across};
  }
  // No link in direction d is tighter than this: where it holds, no link needs to be looked at one by one.
  [[nodiscard]] const LinkLimit& tightest(int d) const { return tightest_[static_cast<std::size_t>(d)]; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  void fill_labels(const LabelVolume& volume);
  void fill_anchors(const LabelVolume& volume, const LatticeOptions& options);
  void fill_springs(const LatticeOptions& options);
  void fill_limits(const LatticeOptions& options);
  void find_surface();

  Springs springs_;
  glm::dvec3 spacing_m_{1e-3};
  double min_spacing_m_ = 1e-3, max_spacing_m_ = 1e-3;
  double force_scale_N_ = 0.0;
  std::size_t voxel_count_ = 0, anchored_count_ = 0, class_count_ = 1;
  std::vector<std::uint8_t> label_, anchored_;
  std::vector<VoxelId> surface_;
  std::array<std::size_t, 256> limit_class_{};    // label → class of equal limits
  std::array<std::vector<LinkLimit>, 3> limits_;  // [d][class a · class_count + class b]
  std::array<LinkLimit, 3> tightest_;
};

}  // namespace voxel
