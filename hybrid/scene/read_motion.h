// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of a [[rigid]] table that say how it moves.
#pragma once

#include <span>
#include <string_view>

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// All of them, whatever the motion.
std::span<const std::string_view> motion_keys();

// Refuses keys that do not go with the motion that the table names.
MotionDescription read_motion(const TableReader& table, const Pose& pose);

}  // namespace hybrid
