// SPDX-License-Identifier: GPL-3.0-or-later
// A table of tissues by name: whether they are bone, their stiffness with its source, and their customary
// colour in anatomical drawings.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>

namespace hybrid {

struct Tissue {
  std::string_view name;      // of the tissue family and of its material in a scene: "rib", "liver"
  std::string_view patterns;  // of label names, separated by spaces; '*' and '?' stand for any characters
  bool bone = false;          // true: felt as a rigid surface, without use of the figures below
  double young_Pa = 0.0;
  double poisson = 0.0;
  bool measured = false;    // true: figures of this tissue; false: stand-ins, which `source` explains
  std::string_view source;  // source of the figures
  glm::vec3 colour{0.0F};   // colour of the tissue in pictures; sRGB, 0 to 1
};

// The first row that fits a name is used. Young's moduli are those of small, slow deformations of living
// tissue, where such measurements exist. Elastography gives E = 3·ρ·c². Tissue that does not change its
// volume has a Poisson's ratio of 0.45, near the end of the range for which the lattice is calibrated.
std::span<const Tissue> tissue_table();

// Elastic constants for a tissue of six-link voxels. Where several tissues lie in layers, such voxels are
// accurate for Poisson's ratios near 0.3, and a fifth too soft at 0.45 (voxel/README.md). An object on nested
// patches can have only one ratio. So the ratio is 0.3, and Young's modulus is such that the contact modulus
// E/(1 − ν²), which a tool feels, does not change.
struct LatticeStiffness {
  double young_Pa = 0.0, poisson = 0.0;
};
LatticeStiffness as_six_links(const Tissue& tissue);

// The row that a label's name belongs to, however its words are joined; null when there is none.
const Tissue* find_tissue(std::string_view label_name);

// The tissue of a label that fits no row.
const Tissue& unknown_tissue();

// Does a name fit a pattern of '*' (any characters, also none) and '?' (one character)? Case is ignored.
bool fits_pattern(std::string_view name, std::string_view pattern);

}  // namespace hybrid
