// SPDX-License-Identifier: GPL-3.0-or-later
// Whole scenes timed beside baselines: the same scene with other models of its objects, along the same path
// on an ideal device. All sessions of a scene take turns, so that a machine that gets slower or faster
// favours none.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/session/session.h"
#include "hybrid/tune/felt_error.h"

namespace hybrid::bench {

// A percentile of a tick over the repeats of a session: its median, its least and its greatest value (us).
struct OverRepeats {
  double median = 0.0, least = 0.0, most = 0.0;
};

// One scene with one of its models.
struct SceneRow {
  // model: "as given", "voxel by voxel", "six-link", "trilinear", "proxy" or "as voxels".
  std::string scene{}, model{};
  std::string values{};                        // in words
  std::string left_out{};                      // why it was not played; empty if it was
  std::uint64_t ticks = 0, contact_ticks = 0;  // of one session
  int repeats = 0;
  OverRepeats p50_us{}, p99_us{}, p999_us{}, max_us{};
  // p99 over that of the scene as given, in the same turn: median of the turns. `sure`: the ratio is on the
  // same side of 1 in every turn.
  double p99_ratio = 1.0;
  bool sure = false;
  ForceError own_error{};                           // against the same session, played slowly
  SettingError from_given{};                        // difference of its force from that of the scene as given
  std::uint64_t memory_bytes = 0, soft_voxels = 0;  // of objects and map before the session
  double load_s = 0.0;
  std::vector<std::string> faults{};
};

// If the p99 of a row differs more between repeats than this share of its median, the machine was too noisy
// to tell smaller differences.
inline constexpr double kNoisy = 0.2;
[[nodiscard]] bool noisy(const SceneRow& row);

struct ScenesBenchOptions {
  std::vector<std::filesystem::path> scenes{};
  int repeats = 5;  // timed sessions of each row, after one that is not timed; odd
  Progress progress{};
  std::function<void(const SceneRow&)> on_row{};  // called for each row of a scene once the scene is done
};

// A scene that cannot be played is a row with the reason, unless it is the only one. Throws SceneError,
// std::exception; device::StopAsked after a signal.
std::vector<SceneRow> bench_scenes(const ScenesBenchOptions& options);

// The scenes that come with the program: beside the executable as installed, or in the source tree that it
// was built in. Empty: there are none.
std::vector<std::filesystem::path> shipped_scenes();

std::string scenes_table_head();
std::string scenes_table_line(const SceneRow& row);
// The meaning of the columns, and whether the machine was too noisy.
std::string scenes_summary(const std::vector<SceneRow>& rows);
nlohmann::ordered_json to_json(const SceneRow& row);

}  // namespace hybrid::bench
