// SPDX-License-Identifier: GPL-3.0-or-later
// Variants of a scene: one object is rendered by another model, and everything else stays as the scene has
// it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/tune/setting.h"

namespace hybrid {

struct Variant {
  std::string name;   // "six-link", "proxy", …; equal for equal variants of all objects
  std::string words;  // its values, such as "3 mm six-link"
  Scene scene{};      // on an ideal device, with all models decided
  // The values in the scene's file that make the variant. Empty: a few values cannot make it.
  std::optional<Setting> setting{};
  std::string left_out{};  // why the scene cannot have this variant, in words; empty: it can
};

// In the scene file of a variant, this text stands before the reason of each change (edited_scene()).
inline constexpr std::string_view kVariantMark = "# hybrid compare: ";

inline constexpr const char* kAsGiven = "as given";
inline constexpr const char* kProxyVariant = "proxy";
inline constexpr const char* kMatchedVariant = "proxy, matched";
inline constexpr const char* kVoxelVariant = "as voxels";

// The scene as it is, on an ideal device. The variant's `words` describe `object`.
Variant as_given(const Scene& as_read, const std::vector<TunableObject>& objects, const std::string& object);

// Variants of soft object number `index` of `objects`: six-link, trilinear, voxels 1.5 and 2 times as wide,
// without thinning (if the scene thins it), and proxy. kMatchedVariant is made by matched_variant().
std::vector<Variant> soft_variants(const Scene& as_read, const std::vector<TunableObject>& objects,
                                   std::size_t index);

// A proxy whose coupling has another stiffness.
Variant matched_variant(const Variant& proxy, double stiffness_N_per_m);

// The rigid object as voxels of Young's modulus kVoxelYoung_Pa, held at their lowest layer. `extent_m`: edges
// of the box around its surface.
Variant voxel_variant(const Scene& as_read, const std::string& rigid, const glm::dvec3& extent_m);
inline constexpr double kVoxelYoung_Pa = 1e6;  // feels about hard with a tool of millimetres

}  // namespace hybrid
