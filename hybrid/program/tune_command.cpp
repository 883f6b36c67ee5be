// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "hybrid/base/whole_file.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/tune/edit_scene.h"
#include "hybrid/tune/tune_page.h"
#include "hybrid/tune/tune_plot.h"
#include "hybrid/tune/tune_report.h"

namespace hybrid {
namespace {

std::string scene_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Refuses an --out in another folder. The scene's file names other files relative to its own folder.
void refuse_other_folder(const TuneCommand& command) {
  const auto folder = [](const std::filesystem::path& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file).parent_path());
  };
  if (command.out.empty() || folder(command.out) == folder(command.scene)) return;
  throw std::runtime_error(fmt::format(
      "--out {}: a scene names its files relative to its own folder; write the new scene beside {}",
      command.out.string(), command.scene.string()));
}

nlohmann::ordered_json tune_report_of(const TuneCommand& command, const TuneResult& result) {
  nlohmann::ordered_json j = report_head("tune");
  j["command_line"] = command.command_line;
  j["scene"] = command.scene.string();
  j.update(tune_json(result));
  return j;
}

}  // namespace

int tune_scene(const TuneCommand& command) {
  const Scene scene = read_scene(command.scene);
  const std::string text = scene_text(command.scene);
  refuse_other_folder(command);  // before --out makes a folder
  Outputs outputs;
  outputs.ask_plot(command.plot);
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
  outputs.ask("--out", command.out, {".toml"});
  const TuneResult result = tune(scene, {.error_jnd = command.error_jnd,
                                         .budget_us = command.budget_us,
                                         .quick = command.quick,
                                         .cache = command.cache,
                                         .progress = progress_on_terminal()});
  end_progress();
  const nlohmann::ordered_json report = tune_report_of(command, result);
  const std::string title = scene.title.empty() ? command.scene.stem().string() : scene.title;
  outputs.write_json(command.json, report);
  outputs.write("plot", command.plot,
                [&](const std::filesystem::path& file) { save_text(file, tune_svg(result, title)); });
  outputs.attempt([&] {
    if (!command.report.folder.empty())
      write_report(outputs, command.report, tune_page(result, title + ": its settings"), report);
  });
  outputs.write("scene", command.apply ? command.scene : command.out, [&](const std::filesystem::path& file) {
    save_text(file, edited_scene(text, command.scene, result.objects, result.settings[result.chosen].setting,
                                 tune_reason(result)));
  });
  fmt::print(outputs.words(), "{}", tune_words(result));
  if (!command.apply && command.out.empty()) {
    fmt::print(outputs.words(), "\nthe choice, in the scene's file (--apply writes it):\n{}",
               as_toml(result.settings[result.chosen].setting));
  }
  outputs.say_files();
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
