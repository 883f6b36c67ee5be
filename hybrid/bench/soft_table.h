// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of `hybrid bench soft`: as JSON, as a table to read, and how work grows with relative deformation.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid::bench {

// What moves the voxels: the product; the thesis's own algorithm (voxel/baseline/thesis_chainmail.h).
enum class SoftEngine : std::uint8_t { hybrid, classic };
inline constexpr std::array kSoftEngines{SoftEngine::hybrid, SoftEngine::classic};
const char* engine_name(SoftEngine engine);

struct SoftRow {            // empty: the row has no such figure
  std::string test_case{};  // wave, relax, session, load
  SoftEngine engine = SoftEngine::hybrid;
  std::size_t voxels = 0;
  std::string material{};
  std::optional<double> depth_spacings{}, slack{};  // slack in spacings, of the tightest material
  std::optional<int> axes{};
  int threads = 1;
  std::optional<std::size_t> moved{};     // voxels away from rest, by an independent look at all of them
  std::optional<std::size_t> violated{};  // links, by an independent look at all of them
  std::optional<Percentiles> time_us{};   // of waves, ticks, or what the note says
  std::optional<double> speedup{};        // classic's p50 over this one's, of the same inputs in the same run
  std::optional<double> ns_per_voxel_update{};
  std::optional<double> truncated_share{};
  std::optional<double> force_error_N{}, force_error_jnd{};
  std::string reference{};  // of the force error
  std::optional<double> bytes_per_voxel{};
  // Beyond the columns:
  std::size_t repeats = 1;
  std::optional<double> ns_per_candidate{};  // of classic's waves
  std::optional<bool> exact{};               // the wave is its definition: see WaveState
  std::optional<double> source_off_spacings{};
  std::string note{};
};

nlohmann::ordered_json to_json(const SoftRow& row);

std::string soft_table_head();
std::string soft_table_line(const SoftRow& row);

// How moved voxels and times grow with relative deformation, depth / slack: least squares of the homogeneous
// waves along one axis. The thesis (chapter VI) says exponentially; the octahedron of the closed form says
// with the cube.
struct Growth {
  std::size_t points = 0;
  double moved_exponent = 0.0, moved_r2 = 0.0;                        // log moved over log(depth/slack)
  double exponential_r2 = 0.0;                                        // log moved over depth/slack
  std::optional<double> hybrid_time_exponent, classic_time_exponent;  // log p50 over log(depth/slack)
};
std::optional<Growth> growth_of(const std::vector<SoftRow>& rows);  // empty: fewer than three ratios
nlohmann::ordered_json to_json(const Growth& growth);
std::string in_words(const Growth& growth);

}  // namespace hybrid::bench
