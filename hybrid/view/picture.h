// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of a session without a display, by an EGL context without a surface. On a machine without a
// graphics card, Mesa draws in software.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/view/view_settings.h"

namespace hybrid {

struct PictureOptions {
  int width = 1280, height = 960;  // (pixels), 1 to 8192 each
  std::optional<Camera> camera;    // default: frame_scene()
  ViewSettings view{};
  bool inset = true;  // draw a nearer view of the contact if it is kLeastNearer times nearer
};

// Throws std::runtime_error that names the remedy: no EGL or OpenGL on this machine, size out of range, file
// not writable.
void save_picture(const std::filesystem::path& png, const DrawnScene& scene, const Snapshot& snapshot,
                  const PictureOptions& options = {});

// Draws many snapshots of one scene; surfaces are uploaded only once. Keeps a reference to the scene. The
// context is current on the thread that made this object, and only that thread may call draw() and save().
class PictureMaker {
 public:
  explicit PictureMaker(const DrawnScene& scene, int height = PictureOptions{}.height);
  PictureMaker(const PictureMaker&) = delete;
  PictureMaker& operator=(const PictureMaker&) = delete;
  PictureMaker(PictureMaker&&) = delete;
  PictureMaker& operator=(PictureMaker&&) = delete;
  ~PictureMaker();

  // The picture as rows from the top, three bytes (RGB) a pixel.
  [[nodiscard]] std::vector<std::uint8_t> draw(const Snapshot& snapshot, const PictureOptions& options = {});
  void save(const std::filesystem::path& png, const Snapshot& snapshot, const PictureOptions& options = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hybrid
