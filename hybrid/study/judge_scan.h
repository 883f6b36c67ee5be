// SPDX-License-Identifier: GPL-3.0-or-later
// One scan of a study: composed into a scene, played once as by `hybrid run`, and judged by its figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/base/histogram.h"
#include "hybrid/compose/compose.h"
#include "hybrid/study/pair_scans.h"
#include "hybrid/tune/front.h"

namespace hybrid {

struct StudyOptions {
  std::vector<ScanPair> scans{};
  std::filesystem::path out{};  // a folder for each scan, by its name
  // Its members names, rigid, soft, range and spacing_m hold for all scans. Its other members are not used.
  ComposeOptions compose{};
  double error_jnd = 1.0;
  std::optional<double> budget_us{};  // limit for the p99.9 of the tick; default: kBudgetShare of the period
  bool tune = false;                  // also choose settings for each scene
  bool quick = false;                 // the shorter search of tune()
  Progress progress{};
};

// Force of the session against the same session played slowly.
struct SessionFigures {
  std::uint64_t ticks = 0, contact_ticks = 0;
  double seconds = 0.0;  // of the session
  Percentiles tick_us{};
  std::string not_measured{};  // why the error is not known, as nothing soft was felt; empty if it is known
  double p99_jnd = 0.0, moving_max_jnd = 0.0, still_max_jnd = 0.0;
  std::string worst_near{};  // the press nearest to the place of the largest error
  double max_force_N = 0.0;
};

// The choice of tune(); error and time as in TunedSetting.
struct TunedScan {
  std::string not_tuned{};  // why there is no choice; empty if there is one
  std::string verdict{}, words{};
  bool accurate_in_time = false;  // ChoiceRule::cheapest_accurate
  double error_jnd = 0.0, p999_us = 0.0;
};

struct JudgedScan {
  ScanPair pair{};
  std::string failed{};           // why there are no figures; empty if there are
  std::filesystem::path scene{};  // the scene that was composed; empty if there is none
  Bounds bounds{};
  std::uint64_t rigid_objects = 0, soft_objects = 0, soft_on_patches = 0;
  std::uint64_t soft_voxels = 0, memory_bytes = 0;
  double load_s = 0.0;
  SessionFigures session{};
  std::vector<std::string> faults{}, notes{};  // notes: of the composition
  std::optional<TunedScan> tuned{};
  [[nodiscard]] bool in_time() const { return session.tick_us.p999 <= bounds.budget_us; }
  [[nodiscard]] bool accurate() const { return session.p99_jnd <= bounds.error_jnd; }
  [[nodiscard]] bool good() const { return failed.empty() && faults.empty() && in_time() && accurate(); }
};

// Composes a scene from the scan, plays it, and judges it. The scan's folder has the scene (scene/), the
// record of its composition (compose.json) and finished parts (cache/). A scene is composed again only if its
// files or options changed, and played again only if the scene or the program changed. A scene that was
// edited since is judged as it is. Any error but a signal is a result with `failed`.
JudgedScan judge_scan(const ScanPair& pair, const StudyOptions& options);

}  // namespace hybrid
