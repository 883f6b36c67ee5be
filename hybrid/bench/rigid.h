// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench rigid`: the proxy and its baselines along the paths of paths.h, over meshes of all sizes.
// Each time is stated with its error.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "hybrid/bench/rigid_table.h"
#include "hybrid/build/build_world.h"

namespace hybrid::bench {

// far, hover, slide, tap, edge, corner, corner_sym, cornerfast, moving
const std::vector<std::string>& rigid_paths();

struct RigidBenchOptions {
  bool quick = false;              // a short piece of each path, small meshes, one speed
  bool every_tick = false;         // compares every tick with the exact reference, without a limit of time
  std::vector<std::string> paths;  // empty: all
  // Names or files (meshes.h). Empty: the meshes of the default table.
  std::vector<std::string> meshes;
  double mesh_unit_m = 1e-3;    // length unit of mesh files
  std::vector<Engine> engines;  // empty: all; for meshes above kMostBaselineTriangles only hybrid and no_map
  std::filesystem::path trace;  // folder for one CSV a run; empty: none
  Progress progress;
  std::function<void(const std::string&)> on_note;  // defects of a file's mesh
  std::function<void(const RigidRow&)> on_row;      // called for each row as soon as it is measured
};

// Larger meshes are measured without CGAL's baselines, because CGAL's tree takes too long for them.
inline constexpr std::size_t kMostBaselineTriangles = 2'000'000;

// Throws std::invalid_argument (no such mesh, or nothing to do), polygon::MeshError (a file) and
// std::runtime_error (trace not writable).
std::vector<RigidRow> bench_rigid(const RigidBenchOptions& options);

}  // namespace hybrid::bench
