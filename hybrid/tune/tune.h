// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses the cheapest setting of a scene on this machine among those whose force cannot be told from the
// truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/tune/felt_stiffness.h"
#include "hybrid/tune/front.h"
#include "hybrid/tune/truth.h"

namespace hybrid {

struct TuneOptions {
  double error_jnd = 1.0;
  std::optional<double> budget_us{};  // limit for the p99.9 of the tick; default: half of the device's period
  bool quick = false;                 // fewer settings and fewer passes
  std::filesystem::path cache{};      // empty: nothing is kept
  Progress progress{};
};

struct TunedSetting {
  Setting setting;
  std::string words;
  bool own = false;  // true: the setting that the scene has
  // How the setting's coupling was fitted. Empty: the coupling is as given.
  std::optional<StiffnessMatch> match{};
  std::string left_out;        // why it was not played to the end; empty if it was
  bool whole_session = false;  // played over the whole motion at least once
  // Errors against the truth, on the worse of the search's motions (Evaluation). The errors of a setting that
  // was left out may cover only a part of the motions.
  SettingError error, at_soft;
  // Percentiles over the ticks. Each tick does the same work in every pass, so its time is the median over
  // the passes.
  Percentiles tick_us;
  std::vector<double> pass_p999_us;  // p99.9 of each single pass: shows the noise of the machine
  double felt_p99_us = 0.0;          // p99 over the ticks in which the truth feels something soft; first pass
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  double load_s = 0.0;
  bool on_patches = false;  // an object is on nested patches
  std::vector<std::string> faults;
  std::optional<std::size_t> dominated_by;  // index of a setting that is no worse in cost and in accuracy
  [[nodiscard]] bool whole() const { return left_out.empty(); }
};

// The chosen setting, played on a motion that was not used to choose it.
struct Confirmation {
  std::string motion;  // in words
  SettingError error;
  Percentiles tick_us;
  std::string not_done;  // why there is no confirmation; empty if there is one
};

struct TuneResult {
  std::vector<TunedSetting> settings;  // in the order in which they were tried
  std::vector<std::size_t> front;      // indices, by rising cost
  std::size_t chosen = 0;
  Choice choice;  // its indices refer to `settings`
  Bounds bounds;
  Truth truth;
  // The search's second motion, in words. A setting whose lattice happens to suit only the first motion is
  // not accurate. Empty: there is none, as the path cannot be moved.
  std::string second_motion;
  Confirmation confirmation;
  std::vector<TunableObject> objects;
  std::vector<std::string> notes;
  double floor_N = 0.04, period_us = 1000.0, unit_m = 1e-3;
  double seconds = 0.0;  // duration of the search
};

// `as_read`: from read_scene(). Throws SceneError. Throws std::runtime_error: there is nothing soft to tune,
// or nothing soft is felt along the path.
TuneResult tune(const Scene& as_read, const TuneOptions& options);

// Settings with one scale and one energy for all objects. The scene's own setting comes first.
std::vector<Setting> common_settings(const std::vector<TunableObject>& objects, bool quick);
// `from` with less work in a tick for the voxels of all objects: smaller shares of it, and, with
// `on_patches`, also narrower patches, and both. Values of `from` that are as low already stay.
std::vector<Setting> settings_with_less_work(const Setting& from, bool on_patches);
// Variations of `from` in one object each: one step coarser or finer, with the other energy, or rendered by
// the proxy.
std::vector<Setting> settings_beside(const std::vector<TunableObject>& objects, const Setting& from);

}  // namespace hybrid
