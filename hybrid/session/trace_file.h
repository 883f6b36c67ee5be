// SPDX-License-Identifier: GPL-3.0-or-later
// A trace on file: one row a tick, CSV.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hybrid/session/forces_between.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// A column behind those of TraceRow.
struct TraceColumn {
  std::string name;
  std::span<const double> values;  // one for each row; NaN becomes an empty field
};

// The forces of all pairs of objects that touched at any tick: "between_SOFT_OTHER_N" or
// "between_SOFT_anchors_N". Empty unless the course keeps every tick. The columns refer to `between`.
[[nodiscard]] std::vector<TraceColumn> pair_columns(const World& world, const ForcesCourse& between);

// Columns t_s, device_{x,y,z}_m, proxy_{x,y,z}_m, force_{x,y,z}_N, rigid_N, soft_N, contacts, tick_us, and
// those of `more`. Throws std::runtime_error: not writable.
void save_trace(const std::filesystem::path& file, std::span<const TraceRow> rows,
                std::span<const TraceColumn> more = {});

}  // namespace hybrid
