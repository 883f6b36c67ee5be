// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer: builds the scene and opens the window, in which view_frames.cpp or view_live.cpp plays it.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "hybrid/program/commands.h"
#include "hybrid/program/view/offered_scenes.h"
#include "hybrid/program/view/viewed_scene.h"
#include "hybrid/program/view_files.h"
#include "hybrid/program/view_steps.h"
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

// Plays a scene, and each one that the user opens after it.
int play_in_turn(ViewCommand command, std::unique_ptr<ViewedScene> viewed, Window& window, ViewScript& script,
                 std::chrono::steady_clock::time_point began) {
  for (;;) {
    note_recent_scene(command.scene);
    LiveEnd end = play_live(command, std::move(viewed), window, script, began);
    if (end.next == nullptr) return end.status;
    command = end.next->command;
    viewed = std::move(end.next->viewed);
    print_notes(viewed->built);
  }
}

// Opens a window without a scene, in which the user chooses one.
int view_from_list(const ViewCommand& command) {
  if (command.frames || !command.drag.empty() || !command.record.empty() || !command.device.empty())
    throw std::runtime_error(
        "--frames, --drag, --record and --device need a scene: hybrid view SCENE.toml …");
  const GlfwLibrary display;
  const DrawnScene nothing{.title = "Choose a scene", .objects = {}};
  ViewScript script = read_script(command.script, nothing);
  Window window(nothing, {.width = command.width, .height = command.height});
  const device::StopOnSignal stop;
  auto began = std::chrono::steady_clock::now();
  bool shown = false;  // the driver takes its time for the first frame, which is not the script's
  SceneOpener opener(command);
  SessionNotes notes{.recent = recent_scenes(), .shipped = shipped_scenes(), .begins = true};
  for (;;) {
    script.play(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(), window);
    const WindowInput input = window.take_input();
    for (const std::filesystem::path& file : input.opened) {
      notes.error.clear();
      if (kind_of_file(file) == DroppedKind::scene) {
        opener.ask(file);
      } else {
        notes.error = kind_of_file(file) == DroppedKind::mesh
                          ? "A mesh is added to a scene. Open a scene first."
                          : why_not_opened(file);
      }
    }
    if (auto opened = opener.poll()) {
      window.show_scene(opened->viewed->drawn);
      window.act({.verb = ViewVerb::look, .text = "all"});
      print_notes(opened->viewed->built);
      return play_in_turn(opened->command, std::move(opened->viewed), window, script, began);
    }
    if (std::string error = opener.take_error(); !error.empty()) notes.error = std::move(error);
    notes.message = opener.loading() ? "opening the scene" : "Choose a scene in the list, or drop one here.";
    if (!window.frame({}, notes)) return 0;
    if (!std::exchange(shown, true)) began = std::chrono::steady_clock::now();
    if (const auto picture = window.take_screenshot(); picture && !picture->empty())
      save_frame(window, *picture);
    if (const int signal = device::stop_signal(); signal != 0) return exit_status_of_signal(signal);
  }
}

}  // namespace

int view(const ViewCommand& command) {
  if (command.scene.empty()) return view_from_list(command);
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
  return play_in_turn(command, std::move(viewed), window, script, std::chrono::steady_clock::now());
}

}  // namespace hybrid
