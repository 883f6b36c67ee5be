// SPDX-License-Identifier: GPL-3.0-or-later
// The [path] table of a scene file.
#pragma once

#include "device/paths/path.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// Checks everything but the contents of a CSV file. Refuses a path longer than a day.
device::PathDescription read_path(const TableReader& table);

}  // namespace hybrid
