// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "device/loop/stop_signal.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/report_page.h"
#include "hybrid/program/stability_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/stability/plot.h"
#include "hybrid/stability/stability.h"
#include "hybrid/stability/table.h"

namespace hybrid {
namespace {

struct PlottedSweep {
  StabilitySweep sweep;
  const char* x_label;
  const char* varied;
};
constexpr PlottedSweep kPlotted[] = {
    {StabilitySweep::wall_damping, "damping B of the wall (N s/m)", "over the wall's damping"},
    {StabilitySweep::damping, "damping b of the mechanism (N s/m)", "over the mechanism's damping"},
    {StabilitySweep::rate, "rate (kHz)", "over the rate"}};

double varied_in(StabilitySweep sweep, const LoopSetting& setting) {
  if (sweep == StabilitySweep::damping) return setting.mechanism.viscous_N_s_per_m;
  return sweep == StabilitySweep::rate ? setting.rate_hz : setting.wall_damping_N_s_per_m;
}

std::vector<BoundaryGroup> figure_of(const StabilityReport& report) {
  std::vector<BoundaryGroup> groups;
  for (const PlottedSweep& plotted : kPlotted) {
    const double unit = plotted.sweep == StabilitySweep::rate ? 1e-3 : 1.0;
    for (const Boundary kind : {Boundary::stable, Boundary::passive}) {
      BoundaryPanel panel{
          .title = fmt::format("{}, {}", kind == Boundary::stable ? "Stable" : "Passive", plotted.varied),
          .curves = {}};
      for (const TheoryCurve& theory : report.curves) {
        if (theory.sweep != plotted.sweep || theory.kind != kind) continue;
        BoundaryCurve curve{.name = theory.delay_ticks == 0   ? "no delay"
                                    : theory.delay_ticks == 1 ? "1 tick of delay"
                                                              : fmt::format("{} ticks", theory.delay_ticks),
                            .x = theory.x,
                            .theory_N_per_m = theory.stiffness_N_per_m,
                            .measured_x = {},
                            .measured_N_per_m = {}};
        for (double& x : curve.x) x *= unit;
        for (const StabilityRow& row : report.rows) {
          if (row.sweep != plotted.sweep || row.kind != kind || !row.measured ||
              row.setting.delay_ticks != theory.delay_ticks)
            continue;
          curve.measured_x.push_back(varied_in(plotted.sweep, row.setting) * unit);
          curve.measured_N_per_m.push_back(*row.measured);
        }
        panel.curves.push_back(std::move(curve));
      }
      if (panel.curves.empty()) continue;
      // The sweep of the wall's damping goes far beyond the passive range before the loop is unstable. So
      // each of its panels has its own axes.
      if (groups.empty() || groups.back().x_label != plotted.x_label ||
          plotted.sweep == StabilitySweep::wall_damping)
        groups.push_back({.x_label = plotted.x_label, .panels = {}});
      groups.back().panels.push_back(std::move(panel));
    }
  }
  return groups;
}

Figure drawn(const Scene& scene, const StabilityReport& report) {
  const Agreement stable = agreement(report, Boundary::stable),
                  passive = agreement(report, Boundary::passive);
  return stability_figure(
      figure_of(report),
      fmt::format("{}: how stiff before it is unstable, or active",
                  scene.title.empty() ? scene.file.stem().string() : scene.title),
      {"Lines: theory (discrete eigenvalues; passivity after Colgate & Schenkel, with the delay). Dots: "
       "measured by the program's own loop.",
       fmt::format("Largest difference: {:.2f} % of {} stable, {:.2f} % of {} passive. 75 g, {:.0f} Hz where "
                   "the rate is not varied.",
                   100.0 * stable.worst, stable.rows, 100.0 * passive.worst, passive.rows, scene.rate_hz)});
}

}  // namespace

int stability(const StabilityCommand& command) {
  const Scene scene = load_scene(command.scene);
  if (!command.plot.empty() && !scene.soft.empty()) {
    throw std::runtime_error(
        fmt::format("--plot: {} has soft objects, and the plot is of what theory knows: rigid walls; leave "
                    "it out, or use "
                    "scenes/wall.toml",
                    scene.file.string()));
  }
  Outputs outputs;
  outputs.ask_plot(command.plot);
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
  const device::StopOnSignal stop;  // after a signal, finished rows are kept
  const StabilityReport report =
      measure_stability(scene, {.quick = command.quick, .progress = progress_on_terminal()});
  end_progress();
  nlohmann::ordered_json json = report_head("stability");
  add_to_json(report, json);
  if (command.quick) json["quick"] = true;
  if (report.stopped_by != 0) json["stopped"] = true;
  outputs.write_json(command.json, json);
  outputs.write("plot", command.plot,
                [&](const std::filesystem::path& file) { save_svg(file, drawn(scene, report)); });
  outputs.attempt([&] {
    if (command.report.folder.empty()) return;
    const auto figure = scene.soft.empty() ? std::optional(drawn(scene, report)) : std::nullopt;
    write_report(outputs, command.report, stability_page(scene, report, figure), json);
  });
  fmt::print(outputs.words(), "{}", stability_tables(report));
  outputs.say_files();
  if (report.stopped_by != 0)
    return outputs.say_stopped(report.stopped_by, fmt::format("{} rows", report.rows.size()));
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
