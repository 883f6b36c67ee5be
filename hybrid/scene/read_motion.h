// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of a [[rigid]] table that describe its motion.
#pragma once

#include <span>
#include <string_view>

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// The keys of all kinds of motion.
std::span<const std::string_view> motion_keys();

// Refuses keys that do not belong to the kind of motion that the table names.
MotionDescription read_motion(const TableReader& table, const Pose& pose);

}  // namespace hybrid
