// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's lists: scenes that may be opened, and how often each thread does its work.
#include <array>
#include <string>
#include <vector>

#include "hybrid/base/number_text.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panels.h"

namespace hybrid {

using namespace controls;

void Panels::draw_open(const PanelFrame& frame, PanelResult& result) const {
  const auto list = [&](const char* heading, const std::vector<OfferedScene>& scenes) {
    if (scenes.empty()) return;
    label(heading);
    for (std::size_t n = 0; n < scenes.size(); ++n) {
      const OfferedScene& scene = scenes[n];
      const std::string id = scene.file.stem().string() + "##" + heading + std::to_string(n);
      if (button(id.c_str(), free_width()))
        result.actions.push_back({.verb = ViewVerb::open, .text = scene.file.string()});
      tip(scene.file.string());
      if (!scene.words.empty()) write(scene.words, true);
    }
  };
  list("Recent", frame.notes.recent);
  list("Scenes to begin from", frame.notes.shipped);
  write("Drop a scene onto the window to open it, or a mesh to add it to the scene that is felt.", true);
  write("A segmentation becomes a scene with: hybrid compose LABELS.nii.gz --out FOLDER", true);
}

void Panels::draw_rates(const Pen& pen, const PanelFrame& frame) const {
  std::vector<std::array<std::string, 3>> rows;
  for (const ThreadRate& rate : frame.notes.rates)
    rows.push_back({rate.name, rate.per_s >= 0.0 ? with_digits(rate.per_s, 3) + " /s" : std::string(),
                    rate.busy >= 0.0 ? with_decimals(100.0 * rate.busy, 0) + " % busy" : std::string()});
  if (!rows.empty()) write_rows(pen, "rates", rows);
}

}  // namespace hybrid
