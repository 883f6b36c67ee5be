// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench occupancy`: looking up, updating and rebuilding the occupancy map, beside CGAL's AABB tree
// and brute force, over the number of occupied cells; each time with how the answer compares.
#pragma once

#include <array>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hybrid/bench/occupancy_queries.h"
#include "hybrid/build/build_world.h"

namespace hybrid::bench {

enum class OccupancyEngine : std::uint8_t { map, cgal_aabb, brute };
inline constexpr std::array kOccupancyEngines{OccupancyEngine::map, OccupancyEngine::cgal_aabb,
                                              OccupancyEngine::brute};
const char* engine_name(OccupancyEngine engine);
const std::vector<std::string>& occupancy_cases();  // lookup, update, rebuild

struct OccupancyRow {
  std::string op;  // one of occupancy_cases()
  OccupancyEngine engine = OccupancyEngine::map;
  OccupancyPattern pattern = OccupancyPattern::coherent;
  OccupancyWhat what = OccupancyWhat::voxels_surface;
  std::size_t cells = 0, elements = 0;  // occupied cells of the map; voxels or triangles
  std::size_t object_voxels = 0;        // of the object that voxels-surface and voxels-all stand for
  // Percentiles of the mean over `batch` operations: what is shorter than the clock's own reading cannot be
  // timed alone. With 1 they are of single operations.
  double p50_ns = 0.0, p99_ns = 0.0;
  std::size_t batch = 1, batches = 0;
  double bytes_per_cell = 0.0;  // of the search alone, without the positions or triangles it is about
  int box_cells = 0;            // of look-ups: cells along an edge of the box
  // The answers of this engine beside the reference's, of the same questions. `missed` must be 0. `extra`
  // is what lies only within a cell of the box, which the map may name for triangles.
  double found_mean = 0.0;
  std::string reference;
  std::size_t checked = 0, missed = 0, extra = 0;
  std::string note;
};

struct OccupancyBenchOptions {
  bool quick = false;                    // up to 1e4 cells, and briefly
  std::vector<std::string> cases;        // empty: all
  std::vector<OccupancyEngine> engines;  // empty: all; brute only where it is affordable
  std::vector<std::size_t> cells;        // empty: the decades from 1e3 to 1e7
  Progress progress;
  std::function<void(const OccupancyRow&)> on_row;
};
std::vector<OccupancyRow> bench_occupancy(const OccupancyBenchOptions& options);

// ---- occupancy_table.cpp ----
nlohmann::ordered_json to_json(const OccupancyRow& row);
std::string occupancy_table_head();
std::string occupancy_table_line(const OccupancyRow& row);
// The same object with all its voxels in the map and with its surface only, and where the map is not better
// than what it was timed beside. Empty: no such rows.
std::string occupancy_summary(const std::vector<OccupancyRow>& rows);

}  // namespace hybrid::bench
