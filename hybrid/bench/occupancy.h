// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench occupancy`: times of looking up, updating and rebuilding the occupancy map, CGAL's AABB tree
// and brute force, over the number of occupied cells. The answers are compared, too.
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
const std::vector<std::string>& occupancy_cases();  // "lookup", "update", "rebuild"

struct OccupancyRow {
  std::string op;  // one of occupancy_cases()
  OccupancyEngine engine = OccupancyEngine::map;
  OccupancyPattern pattern = OccupancyPattern::coherent;
  OccupancyWhat what = OccupancyWhat::voxels_surface;
  std::size_t cells = 0, elements = 0;  // occupied cells of the map; number of voxels or triangles
  std::size_t object_voxels = 0;        // voxels of the object, for voxels-surface and voxels-all
  // Percentiles over batches of the mean time of `batch` operations. Operations that are shorter than a
  // reading of the clock cannot be timed one by one. With batch 1 the times are of single operations.
  double p50_ns = 0.0, p99_ns = 0.0;
  std::size_t batch = 1, batches = 0;
  double bytes_per_cell = 0.0;  // memory of the search structure, without positions or triangles
  int box_cells = 0;            // look-ups: cells along an edge of the box
  // Answers of this engine compared with those of the reference to the same questions. `missed` must be 0.
  // `extra` counts results that are not in the box but within a cell of it, which the map may report for
  // triangles.
  double found_mean = 0.0;
  std::string reference;
  std::size_t checked = 0, missed = 0, extra = 0;
  std::string note;
};

struct OccupancyBenchOptions {
  bool quick = false;                    // only up to 1e4 cells, and shorter
  std::vector<std::string> cases;        // empty: all
  std::vector<OccupancyEngine> engines;  // empty: all; brute force only where it is affordable
  std::vector<std::size_t> cells;        // empty: the powers of ten from 1e3 to 1e7
  Progress progress;
  std::function<void(const OccupancyRow&)> on_row;
};
std::vector<OccupancyRow> bench_occupancy(const OccupancyBenchOptions& options);

// ---- occupancy_table.cpp ----
nlohmann::ordered_json to_json(const OccupancyRow& row);
std::string occupancy_table_head();
std::string occupancy_table_line(const OccupancyRow& row);
// Compares two maps of each object: with all its voxels, and with only its surface. Then lists the rows in
// which the map is slower than another engine, and compares the memory of map and tree.
std::string occupancy_summary(const std::vector<OccupancyRow>& rows);

}  // namespace hybrid::bench
