// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer: builds the scene and opens the window, in which view_frames.cpp or view_live.cpp plays it.
#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "hybrid/program/commands.h"
#include "hybrid/program/view_steps.h"
#include "hybrid/program/viewed_scene.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/real_device.h"
#include "hybrid/window/glfw_library.h"
#include "hybrid/window/video.h"
#include "hybrid/window/view_script.h"
#include "hybrid/window/window.h"

namespace hybrid {
namespace {

ViewScript read_script(const std::filesystem::path& file, const DrawnScene& drawn) {
  return file.empty() ? ViewScript() : ViewScript(text_of(file), file.string(), drawn);
}

// Refuses a video that cannot be written, before the scene is built.
void ask_video(const ViewCommand& command) {
  if (command.video.empty()) return;
  if (!command.frames)
    throw std::runtime_error("--video needs --frames N, the number of frames of the video");
  Outputs().ask("--video", command.video, {".mp4", ".mkv", ".webm"});
  require_ffmpeg();
}

}  // namespace

int view(const ViewCommand& command) {
  std::unique_ptr<ViewedScene> viewed = read_viewed_scene(command);
  Scene& scene = viewed->scene;
  // --frames writes reproducible pictures. With a real device they would not be reproducible.
  if (command.frames && scene.real_device) {
    throw SceneError(scene.file, scene.real_device->place,
                     "--frames needs a simulated device; add --device premium-1.5");
  }
  ask_video(command);
  const GlfwLibrary display;  // a missing display is refused before the scene is built
  if (!command.out.empty()) std::filesystem::create_directories(command.out);
  const auto real = open_real_device(scene);
  build_viewed_scene(command, *viewed, progress_on_terminal());
  end_progress();
  print_notes(viewed->built);
  ViewScript script = read_script(command.script, viewed->drawn);
  // With --frames the pictures show only the scene, unless a script acts as the window's user.
  Window window(viewed->drawn, {.width = command.width,
                                .height = command.height,
                                .visible = !command.frames || (command.out.empty() && command.video.empty()),
                                .panels = !command.frames || !command.script.empty()});
  const device::StopOnSignal stop;
  if (real) {
    const BuiltScene& built = viewed->built;
    std::fprintf(stderr, "note: %s\n", place_real_device(scene, *built.world, *real).c_str());
    await_free_tool(scene, *built.world, *built.state, *real, progress_on_terminal());
    end_progress();
  }
  viewed->player = std::make_unique<Player>(scene, viewed->built, viewed->drawn, real.get());
  if (command.frames) {
    viewed->player->relax_at_once();
    return play_frames(command, std::move(viewed), window, script);
  }
  return play_live(command, std::move(viewed), window, std::move(script));
}

}  // namespace hybrid
