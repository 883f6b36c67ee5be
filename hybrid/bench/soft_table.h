// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of `hybrid bench soft` as JSON and as a table, and the growth of work with relative deformation.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid::bench {

// `hybrid`: the product. `classic`: the thesis's own algorithm (voxel/baseline/thesis_chainmail.h).
enum class SoftEngine : std::uint8_t { hybrid, classic };
inline constexpr std::array kSoftEngines{SoftEngine::hybrid, SoftEngine::classic};
const char* engine_name(SoftEngine engine);

struct SoftRow {            // empty members: the row has no such figure
  std::string test_case{};  // "wave", "relax", "session" or "load"
  SoftEngine engine = SoftEngine::hybrid;
  std::size_t voxels = 0;
  std::string material{};
  std::optional<double> depth_spacings{}, slack{};  // slack in spacings, of the tightest material
  std::optional<int> axes{};
  int threads = 1;
  std::optional<std::size_t> moved{};     // voxels away from rest, by an independent inspection
  std::optional<std::size_t> violated{};  // links beyond their limits, by an independent inspection
  std::optional<Percentiles> time_us{};   // of waves or ticks, or of the work that the note names
  // The p50 of classic over this engine's, with the same inputs in the same run.
  std::optional<double> speedup{};
  std::optional<double> ns_per_voxel_update{};
  std::optional<double> truncated_share{};
  std::optional<double> force_error_N{}, force_error_jnd{};
  std::string reference{};  // reference of the force's error
  std::optional<double> bytes_per_voxel{};
  // Not in the table's columns:
  std::size_t repeats = 1;
  std::optional<double> ns_per_candidate{};  // only of classic's waves
  std::optional<bool> exact{};               // is the wave exactly as defined? See WaveState
  std::optional<double> source_off_spacings{};
  std::string note{};
};

nlohmann::ordered_json to_json(const SoftRow& row);

std::string soft_table_head();
std::string soft_table_line(const SoftRow& row);

// How the number of moved voxels and the time of a wave grow with the relative deformation, depth / slack.
// Only waves in one tissue along one axis count. A power law is a straight line in the logarithms of both
// quantities. The line is fitted by least squares, and the exponent is its slope. The thesis (chapter VI)
// states exponential growth, so an exponential is fitted, too. In the closed form of the wave the moved
// voxels fill an octahedron, whose volume grows with the cube of depth / slack.
struct Growth {
  std::size_t points = 0;
  double moved_exponent = 0.0, moved_r2 = 0.0;                        // line: log moved over log(depth/slack)
  double exponential_r2 = 0.0;                                        // line: log moved over depth/slack
  std::optional<double> hybrid_time_exponent, classic_time_exponent;  // log p50 over log(depth/slack)
};
// Empty: there are fewer than three ratios.
std::optional<Growth> growth_of(const std::vector<SoftRow>& rows);
nlohmann::ordered_json to_json(const Growth& growth);
std::string in_words(const Growth& growth);

}  // namespace hybrid::bench
