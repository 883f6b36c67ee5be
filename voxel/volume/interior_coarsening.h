// SPDX-License-Identifier: GPL-3.0-or-later
// Stiff regions with fewer voxels inside, so that they cost less.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace voxel {

struct ThinningOptions {
  std::vector<std::uint8_t> labels;  // the stiff ones
  int every = 3;                     // 2..64: inside, voxels stay in every n-th row and column only
  int shell = 1;  // 1..63: so many voxels under the surface of the stiff region stay as they are
  // Of what touches the object (unit: meter), and the longest a link of the shell may become, in rest
  // lengths: between them the tool must not fit through the shell, behind which there is nothing any more.
  double tool_radius_m = 0.0;
  double stretch_max = 1.0;
};

struct Thinned {
  LabelVolume volume;
  // [label]: the label that its struts were given, which none had before; 0 where it has none. For the
  // thinned object to be as stiff as it was, the struts' material must be `every`² times as stiff: a strut
  // stands for a column of n × n voxels, so that n of its links in a row are together the one link, n times
  // as long, of a lattice with an n times larger spacing, in stiffness (n²·E·h / n = E·n·h) and in limits
  // alike. Its links are whole ones, as those of any row of voxels (voxel/lattice/link_stiffness.h).
  std::array<std::uint8_t, 256> strut_label{};
  std::size_t stiff = 0;    // voxels of the stiff labels before
  std::size_t removed = 0;  // of them, that are empty now
  std::size_t joined = 0;   // voxels kept for no other reason than to hold the object together
};

// 'Lower density for stiff objects' (the thesis's figure 24: inside, some voxels are missing, and the links
// between those that are left are longer in proportion) on a lattice whose links all join neighbours: the
// long links are struts, rows of voxels along the edges of cubes of `every` voxels. Whatever touches
// something else than stiff material, corners included, stays as it is, `shell` deep: the surface, its
// contact and its anchors do not change. What was connected (by faces) still is: where a part, such as the
// wall of a small cavity, met no strut, the shortest path to the rest is kept too.
//
// What presses on n × n voxels of the surface must come together in one strut. Lines of strut material do
// that, n apart both ways in the innermost layer of the shell (in the layer beneath it where the shell has
// one layer only): with them, wherever planes of struts lie, the force on bare bone is within 7 % up to n = 4
// with a shell of one layer or of n − 1. Without, a link from the shell to a strut is as soft as the shell,
// n² times softer than what it stands for; so is what leads to it within the shell, whose inner side has
// links of half the weight; and the next lines to spread the load lie up to n layers deeper: −20 to −53 %.
//
// Throws std::invalid_argument in words: options out of range, a tool that fits through the shell, no stiff
// voxel, or no label left for the struts (254 in use).
Thinned thin_labels(LabelVolume volume, const ThinningOptions& options);

}  // namespace voxel
