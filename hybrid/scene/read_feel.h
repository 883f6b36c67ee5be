// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of a [[rigid]] table that say what its surface feels like.
#pragma once

#include <span>
#include <string_view>

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"
#include "hybrid/feel/surface_feel.h"

namespace hybrid {

std::span<const std::string_view> feel_keys();

FeelDescription read_feel(const TableReader& table);

// What the tick needs of it; reads the texture's image. Throws std::runtime_error in words.
SurfaceFeel build_feel(const FeelDescription& description);

}  // namespace hybrid
