// SPDX-License-Identifier: GPL-3.0-or-later
// Length units as headers of volume files spell them. Internal to the readers (read_volume.h).
#pragma once

#include <optional>
#include <string>

namespace voxel {

// The unit in meters. Known units are the meter, alone or with the prefixes kilo, deci, centi, milli, micro
// and nano (short or in full, in American or British spelling), the micron, the inch and the foot. Case,
// quotes and blanks do not matter. Empty if the word is no such unit.
std::optional<double> length_unit_m(const std::string& word);

// The unit as text, such as "mm". A unit without a metric name gives "0.0254 m".
std::string unit_in_words(double unit_m);

}  // namespace voxel
