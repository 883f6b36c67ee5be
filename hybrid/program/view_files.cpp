// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view_files.h"

#include <fmt/format.h>

#include <cstdio>
#include <stdexcept>

#include "hybrid/base/file_ending.h"
#include "hybrid/base/png_file.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/scene_text.h"

namespace hybrid {
namespace {

constexpr std::chrono::seconds kShown{6}, kErrorShown{20};  // time for which a result, an error is shown
constexpr int kMostNames = 10'000;                          // numbers that are tried for a new file name

}  // namespace

void save_frame(Window& window, const std::filesystem::path& png) {
  const FramePicture frame = window.picture();
  save_png(png, frame.width, frame.height, frame.rgb);
}

ViewFiles::ViewFiles(const ViewCommand& command) : command_(command) {
  require_ending_of_none("--record", command.record);
  Outputs().ask("--record", command.record, {});
}

void ViewFiles::say(std::string words) {
  message_ = std::move(words);
  shown_until_ = std::chrono::steady_clock::now() + kShown;
}

void ViewFiles::say_error(std::string words) {
  message_ = std::move(words);
  shown_until_ = std::chrono::steady_clock::now() + kErrorShown;
}

std::string ViewFiles::message() const {
  return std::chrono::steady_clock::now() < shown_until_ ? message_ : std::string();
}

// A file name that does not exist yet, in the frames' folder or else in the current one.
std::filesystem::path ViewFiles::free_name(const char* ending) const {
  for (int n = 1; n < kMostNames; ++n) {
    std::filesystem::path file =
        command_.out / fmt::format("{}-{}{}", command_.scene.stem().string(), n, ending);
    if (!std::filesystem::exists(file)) return file;
  }
  throw std::runtime_error(fmt::format("there are {} files like {}; move some away", kMostNames,
                                       command_.scene.stem().string() + "-1" + ending));
}

template <class Save>
void ViewFiles::attempt(const std::string& what, std::filesystem::path file, const char* ending,
                        const Save& save) {
  try {
    if (file.empty()) file = free_name(ending);
    save(file);
    say(what + " written: " + file.string());
  } catch (const std::exception& e) {
    say(what + " not written: " + e.what());
  }
}

void ViewFiles::save_what_was_asked(Window& window, const WindowInput& input, const ViewedScene& viewed,
                                    const Snapshot& snapshot, const std::function<bool()>& hold) {
  if (const auto picture = window.take_screenshot())
    attempt("Picture", *picture, ".png", [&](const auto& file) { save_frame(window, file); });
  if (input.recording) {
    attempt("Recording", *input.recording, ".rec", [&](const auto& file) {
      if (!hold()) throw std::runtime_error("the session does not answer; try again");
      save_recording(file, viewed.player->recording(viewed.began_with));
    });
  }
  if (input.save_scene) save_scene(viewed, snapshot);
}

// Writes changes and edited values into the scene's file. The window then loads the changed scene again, so
// that recordings begin with the new text.
void ViewFiles::save_scene(const ViewedScene& viewed, const Snapshot& snapshot) try {
  std::vector<ValueInScene> values;
  for (std::size_t n = 0; n < viewed.drawn.editable.size() && n < snapshot.values.size(); ++n) {
    const EditableValue& value = viewed.drawn.editable[n];
    const std::string object =
        value.object == Edit::kTool ? std::string() : viewed.drawn.objects[value.object].name;
    values.push_back({object, value.quantity, snapshot.values[n], value.in_scene});
  }
  EditedText edited = write_values(viewed.text, command_.scene, viewed.scene.unit_m, values);
  edited.changed.insert(edited.changed.begin(), viewed.changes.begin(), viewed.changes.end());
  std::string words = edited.changed.empty()
                          ? "Nothing of the scene's file has been edited."
                          : fmt::format("{} written; the session begins anew. Changed: {}.",
                                        command_.scene.string(), fmt::join(edited.changed, ", "));
  if (!edited.left.empty()) words += fmt::format(" Not in the file: {}.", fmt::join(edited.left, ", "));
  if (!edited.changed.empty()) {
    if (text_of(command_.scene) != viewed.file_text)
      throw std::runtime_error("its file has changed since it was loaded; wait until it is loaded again");
    save_text(command_.scene, edited.text);
  }
  say(words);
} catch (const std::exception& e) {
  say(std::string("Scene not written: ") + e.what());
}

bool ViewFiles::save_at_end(const ViewedScene& viewed) const {
  if (command_.record.empty()) return true;
  Outputs outputs;
  outputs.write("recording", command_.record,
                [&](const auto& file) { save_recording(file, viewed.player->recording(viewed.began_with)); });
  outputs.say_files();
  return !outputs.failed();
}

}  // namespace hybrid
