// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses the cheapest setting of a scene whose force no hand can tell from the truth, on this machine.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/tune/front.h"
#include "hybrid/tune/truth.h"

namespace hybrid {

struct TuneOptions {
  double error_jnd = 1.0;
  std::optional<double> budget_us{};  // of a tick's p99.9; default: half of the device's period
  bool quick = false;                 // fewer settings, a coarser truth
  std::filesystem::path cache{};      // empty: nothing is kept
  Progress progress{};
};

struct TunedSetting {
  Setting setting;
  std::string words;
  bool own = false;            // as the scene has it
  std::string left_out;        // why it was not played to the end; empty: it was
  bool whole_session = false;  // it was played over the whole motion at least once
  SettingError error;          // against the truth; of a part of the motion where it was left out
  // Each tick does the same work in every pass: percentiles of the ticks' medians over the passes.
  Percentiles tick_us;
  std::vector<double> pass_p999_us;  // p99.9 of each pass by itself: the noise of the machine
  double felt_p99_us = 0.0;          // of the ticks in which something soft is felt, in the first pass
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  double load_s = 0.0;
  std::vector<std::string> faults;
  std::optional<std::size_t> dominated_by;  // another setting that is as cheap and as accurate
  [[nodiscard]] bool whole() const { return left_out.empty(); }
};

// The chosen setting on a motion that was not used to choose it.
struct Confirmation {
  std::string motion;  // in words
  SettingError error;
  Percentiles tick_us;
  std::string not_done;  // why there is none; empty if there is
};

struct TuneResult {
  std::vector<TunedSetting> settings;  // in the order in which they were tried
  std::vector<std::size_t> front;      // by rising cost
  std::size_t chosen = 0;
  Choice choice;  // its indices are those of `settings`
  Bounds bounds;
  Truth truth;
  Confirmation confirmation;
  std::vector<TunableObject> objects;
  std::vector<std::string> notes;
  double floor_N = 0.04, period_us = 1000.0, unit_m = 1e-3;
  double seconds = 0.0;  // that the search took
};

// `as_read`: of read_scene(). Throws SceneError; std::runtime_error: nothing soft to tune, or nothing soft is
// felt along the path.
TuneResult tune(const Scene& as_read, const TuneOptions& options);

// The settings with one scale and one energy for all objects, that of the scene first.
std::vector<Setting> common_settings(const std::vector<TunableObject>& objects, bool quick);
// From one setting: each object by itself one step coarser or finer, with the other energy, or as rigid.
std::vector<Setting> settings_beside(const std::vector<TunableObject>& objects, const Setting& from);

}  // namespace hybrid
