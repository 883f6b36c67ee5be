// SPDX-License-Identifier: GPL-3.0-or-later
// Length units as headers of volume files spell them. Internal to the readers (read_volume.h).
#pragma once

#include <optional>
#include <string>

namespace voxel {

// The unit in meters: any metric prefix from kilo to nano, short or in full, in American or British spelling,
// and the inch and the foot. Case, quotes and blanks do not matter. None if the word is no length.
std::optional<double> length_unit_m(const std::string& word);

// "mm", or "0.0254 m" for a unit without a metric name.
std::string unit_in_words(double unit_m);

}  // namespace voxel
