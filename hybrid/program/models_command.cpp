// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid compare SCENE --models`.
#include <fmt/format.h>

#include <cctype>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "hybrid/base/whole_file.h"
#include "hybrid/models/models_text.h"
#include "hybrid/models/variants.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/models_page.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/tune/edit_scene.h"

namespace hybrid {
namespace {

std::string file_part(const std::string& words) {
  std::string part;
  for (const char c : words) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.';
    if (plain) part += c;
    if (!plain && !part.empty() && part.back() != '-') part += '-';
  }
  return part;
}

// Writes each variant as a scene beside the given one, because a scene names files relative to its folder.
void write_variants(const Scene& scene, const ModelsInScene& models, Outputs& outputs) {
  std::ifstream in(scene.file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const ObjectModels& object : models.objects) {
    for (const ModelRow& row : object.rows) {
      if (!row.left_out.empty() || !row.setting || row.name == kAsGiven) continue;
      const std::string name = fmt::format("{}-{}-{}.toml", scene.file.stem().string(),
                                           file_part(object.object), file_part(row.name));
      const std::string reason = fmt::format("\"{}\" as {} ({})", object.object, row.name, row.words);
      outputs.write("scene", scene.file.parent_path() / name, [&](const std::filesystem::path& file) {
        save_text(file, edited_scene(text, scene.file, models.tunable, *row.setting, reason, kVariantMark));
      });
    }
  }
}

}  // namespace

int compare_models_in_scene(const CompareCommand& command) {
  const Scene scene = read_scene(command.scenes.front());
  Outputs outputs;
  outputs.ask_plot(command.plot);
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
  const ModelsInScene models = models_in_scene(
      scene, {.object = command.object, .cache = command.cache, .progress = progress_on_terminal()});
  end_progress();
  nlohmann::ordered_json report = report_head("compare");
  report["scene"] = scene.file.string();
  report.update(models_json(models));
  outputs.write_json(command.json, report);
  const std::string title =
      (scene.title.empty() ? scene.file.stem().string() : scene.title) + ": models of its objects";
  outputs.write("plot", command.plot,
                [&](const std::filesystem::path& file) { save_svg(file, models_figure(models, title)); });
  outputs.attempt([&] {
    if (!command.report.folder.empty())
      write_report(outputs, command.report, models_in_scene_page(models, title), report);
  });
  if (command.write_variants) write_variants(scene, models, outputs);
  fmt::print(outputs.words(),
             "the whole scene {} along its path, one object at a time by other models; an ideal device, and "
             "relaxation as in `run`\n\n{}",
             scene.file.filename().string(), models_words(models));
  outputs.say_files();
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
