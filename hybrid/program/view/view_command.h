// SPDX-License-Identifier: GPL-3.0-or-later
// The options of `hybrid view`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace hybrid {

struct ViewCommand {
  std::filesystem::path scene;  // empty: the window offers scenes
  std::optional<std::uint64_t>
      frames;  // number of frames before the window closes; each is written to `out` if that is given
  int width = 1280, height = 960;  // of the window (screen units; pixels on most displays)
  std::filesystem::path out;
  std::filesystem::path video;   // the frames as a video; empty: none
  std::filesystem::path drag;    // CSV of positions (t, x, y, z) that replace the mouse
  std::filesystem::path script;  // actions of a user at given times; empty: none
  std::filesystem::path record;  // recording of the session, written when the window closes; empty: none
  std::string device;            // replaces the scene's device; empty: the scene's
};
}  // namespace hybrid
