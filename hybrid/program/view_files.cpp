// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view_files.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "hybrid/program/outputs.h"

namespace hybrid {
namespace {

constexpr std::chrono::seconds kShown{6};  // how long a message stays
constexpr int kMostNames = 10'000;

}  // namespace

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in || !text) throw std::runtime_error(file.string() + ": cannot be read; check its name and rights");
  return text.str();
}

ViewFiles::ViewFiles(const ViewCommand& command, const std::string& scene_text)
    : command_(command), scene_text_(scene_text) {
  Outputs().ask("--record", command.record, {".rec"});
}

void ViewFiles::say(std::string words) {
  message_ = std::move(words);
  said_ = std::chrono::steady_clock::now();
}

std::string ViewFiles::message() const {
  return std::chrono::steady_clock::now() - said_ < kShown ? message_ : std::string();
}

// Beside the frames, else in the current folder.
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

void ViewFiles::save_what_was_asked(Window& window, const WindowInput& input, const Player& player,
                                    const std::function<bool()>& hold) {
  if (const auto picture = window.take_screenshot())
    attempt("Picture", *picture, ".png", [&](const auto& file) { window.save_frame(file); });
  if (input.recording) {
    attempt("Recording", *input.recording, ".rec", [&](const auto& file) {
      if (!hold()) throw std::runtime_error("the session does not answer; try again");
      save_recording(file, player.recording(scene_text_));
    });
  }
}

bool ViewFiles::save_at_end(const Player& player) const {
  if (command_.record.empty()) return true;
  Outputs outputs;
  outputs.write("recording", command_.record,
                [&](const auto& file) { save_recording(file, player.recording(scene_text_)); });
  outputs.say_files();
  return !outputs.failed();
}

}  // namespace hybrid
