// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view/open_scene.h"

#include <stdexcept>
#include <utility>

#include "hybrid/base/file_ending.h"

namespace hybrid {

void SceneOpener::ask(const std::filesystem::path& file) {
  if (next_.valid()) {
    error_ = file.string() + ": not opened, because another scene is being loaded";
    return;
  }
  error_.clear();
  ViewCommand command;
  command.scene = file;
  command.width = command_.width;
  command.height = command_.height;
  command.record = command_.record;
  command.device = command_.device;
  next_ = std::async(std::launch::async, [command = std::move(command)] {
    auto opened = std::make_unique<OpenedScene>(OpenedScene{command, nullptr});
    opened->viewed = load_for_window(opened->command);
    return opened;
  });
}

std::unique_ptr<OpenedScene> SceneOpener::poll() {
  if (!next_.valid() || next_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return nullptr;
  try {
    return next_.get();
  } catch (const std::exception& e) {
    error_ = e.what();
    return nullptr;
  }
}

DroppedKind kind_of_file(const std::filesystem::path& file) {
  if (lower_ending(file) == ".toml") return DroppedKind::scene;
  if (is_mesh_name(file)) return DroppedKind::mesh;
  if (is_volume_name(file) || std::filesystem::is_directory(file)) return DroppedKind::volume;
  return DroppedKind::other;
}

std::string why_not_opened(const std::filesystem::path& file) {
  if (kind_of_file(file) == DroppedKind::volume)
    return file.string() + " is a volume. A scene of its labels is made by: hybrid compose " + file.string() +
           " --out FOLDER";
  return file.string() + " is no scene (.toml), mesh (.obj, .ply, .stl, .off) or volume";
}

}  // namespace hybrid
