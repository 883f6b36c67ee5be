// SPDX-License-Identifier: GPL-3.0-or-later
// A session as a file: the scene's text, every input and edit, and a running hash for each tick. A bug report
// is such a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid {

// Before this tick the session changed to another scene (take_over.h), or went back to a copy of its own
// state.
struct RecordedChange {
  std::uint64_t tick = 0;
  std::uint64_t edits_before = 0;  // number of edits that were applied in the scenes before
  std::string text;                // of the scene from then on; empty: the same scene, in a copy of its state
};

struct Recording {
  std::filesystem::path scene_file;  // the scene's file at the time of recording; replay reads it again
  // Text of that file at the time of recording, so that a change is noticed.
  std::string scene_text;
  double dt_s = 1e-3;
  device::DeviceLimits device{};  // limits of the device that was used
  bool async_relaxation = false;  // SessionOptions::async_relaxation
  std::uint64_t state_hash = 0;   // after the last tick
  glm::dvec3 start_m{0.0};        // SessionResult::start_m
  std::vector<RecordedTick> ticks;
  std::vector<Edit> edits{};              // in order of their ticks
  std::vector<RecordedChange> changes{};  // in order of their ticks
};

// save_recording() throws std::runtime_error if the file cannot be written, load_recording() if it is no
// recording, truncated, or of another version.
void save_recording(const std::filesystem::path& file, const Recording& recording);
Recording load_recording(const std::filesystem::path& file);

struct ReplayResult {
  std::uint64_t ticks = 0, state_hash = 0;  // ticks of the recording; final hash of the replay
  std::uint64_t replayed_ticks = 0;         // fewer than `ticks` if a signal ended the replay (StopOnSignal)
  bool equal = false;                       // are all replayed ticks equal to those recorded?
  std::uint64_t first_difference =
      0;  // first tick whose hash differs; the number of ticks when only the final hash differs
};

// Runs the same inputs through a freshly built scene. Throws SceneError, std::runtime_error (scene changed
// since).
ReplayResult replay(const Recording& recording, const Progress& progress);

}  // namespace hybrid
