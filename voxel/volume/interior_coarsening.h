// SPDX-License-Identifier: GPL-3.0-or-later
// Interior coarsening: removes voxels inside stiff regions, so that the regions cost less.
// The surface of a stiff region is kept to a depth of `shell` voxels; inside, struts remain along the edges
// of cubes. Voxels that were connected by faces stay connected. Source: the thesis, figure 24 ('lower density
// for stiff objects').
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace voxel {

struct ThinningOptions {
  std::vector<std::uint8_t> labels;  // stiff labels
  int every = 3;                     // 2..64: inside, voxels stay in every n-th row and column only
  int shell = 1;                     // 1..63: depth of the unchanged surface layer (unit: voxel)
  // Radius of the tool (unit: meter), and the upper limit of a link's length (unit: rest length). The tool
  // must not fit between the voxels of a stretched shell: the space behind the shell is empty.
  double tool_radius_m = 0.0;
  double stretch_max = 1.0;
};

struct Thinned {
  LabelVolume volume;
  // [label] Label of the struts of `label`, which was unused before; 0 if `label` has no struts. A strut
  // replaces a column of n × n voxels, n = `every`. So the material of the struts must be n² times as stiff
  // as that of `label`. Then n links of a strut in series equal one link of a lattice with n times the
  // spacing, both in stiffness (n²·E·h / n = E·n·h) and in limits. Links of a strut have full weight, like
  // those of any row of voxels (voxel/lattice/link_stiffness.h).
  std::array<std::uint8_t, 256> strut_label{};
  std::size_t stiff = 0;    // voxels of the stiff labels before thinning
  std::size_t removed = 0;  // stiff voxels that are empty now
  std::size_t joined = 0;   // voxels kept only to preserve connectivity
};

// The thesis (figure 24) removes voxels inside stiff objects and lengthens the links between the remaining
// voxels. In this lattice all links join neighbours. So each long link is a strut: a row of voxels along an
// edge of a cube of `every` voxels. Stiff voxels within `shell` of other material or of empty space, corners
// included, do not change. So the surface, its contact and its anchors do not change either. Face
// connectivity is preserved: if a part, such as the wall of a small cavity, meets no strut, the shortest path
// to the rest is kept.
//
// The load on n × n voxels of the surface must be collected into one strut. A frame does this: lines of strut
// material, n apart along both axes, in the innermost layer of the shell. A shell of one layer has the frame
// in the layer beneath. Without a frame, links from the shell to a strut would be n² times too soft.
//
// Throws std::invalid_argument if an option is out of range, the tool fits through the shell, no voxel is
// stiff, or too few labels are left for the struts (each stiff label needs two unused labels).
Thinned thin_labels(LabelVolume volume, const ThinningOptions& options);

}  // namespace voxel
