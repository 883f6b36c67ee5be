// SPDX-License-Identifier: GPL-3.0-or-later
// A trace on file: one row a tick, CSV.
#pragma once

#include <filesystem>
#include <span>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Columns t_s, device_{x,y,z}_m, proxy_{x,y,z}_m, force_{x,y,z}_N, rigid_N, soft_N, contacts, tick_us.
// Throws std::runtime_error: not writable.
void save_trace(const std::filesystem::path& file, std::span<const TraceRow> rows);

}  // namespace hybrid
