// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of a [[rigid]] table that describe the feel of its surface.
#pragma once

#include <span>
#include <string_view>

#include "hybrid/feel/surface_feel.h"
#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

std::span<const std::string_view> feel_keys();

FeelDescription read_feel(const TableReader& table);

// Converts the description for the tick; reads the texture's image. Throws std::runtime_error with a message.
SurfaceFeel build_feel(const FeelDescription& description);

}  // namespace hybrid
