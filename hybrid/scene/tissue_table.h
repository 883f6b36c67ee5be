// SPDX-License-Identifier: GPL-3.0-or-later
// Tissues by their names: bone or not, how stiff, with the source of the figure, and the customary colour in
// anatomical drawings.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>

namespace hybrid {

struct Tissue {
  std::string_view name;      // of the family: "rib", "liver", "vessel"; also of its material in a scene
  std::string_view patterns;  // of label names, with spaces between; '*' and '?' stand for any characters
  bool bone = false;          // felt as a rigid surface; the figures below are then not used
  double young_Pa = 0.0;
  double poisson = 0.0;
  bool measured = false;    // published for this tissue; else a stand-in, and `source` says which
  std::string_view source;  // where the figure is from
  glm::vec3 colour{0.0F};   // sRGB, 0 to 1: of the tissue in pictures
};

// The first row wins. Young's moduli are of small, slow deformation in living tissue where there is such a
// measurement; elastography gives E = 3·ρ·c². Poisson's ratio: what does not change its volume gets 0.45,
// near which the lattice's calibration ends.
std::span<const Tissue> tissue_table();

// A tissue as a scene of six-link voxels has it. They are right for Poisson's ratios up to 0.3 in layers,
// too, and a fifth too soft at 0.45 (voxel/README.md). Objects on nested patches have one ratio. So the ratio
// is 0.3, and Young's modulus keeps the contact modulus E/(1 − ν²), which a tool feels.
struct LatticeStiffness {
  double young_Pa = 0.0, poisson = 0.0;
};
LatticeStiffness as_six_links(const Tissue& tissue);

// The row that a label's name belongs to; null when there is none.
const Tissue* find_tissue(std::string_view label_name);

// What a label gets that no row knows.
const Tissue& unknown_tissue();

// Whether a name fits a pattern of '*' (any characters, also none) and '?' (one), capitals ignored.
bool fits_pattern(std::string_view name, std::string_view pattern);

}  // namespace hybrid
