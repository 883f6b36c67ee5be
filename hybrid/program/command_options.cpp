// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/command_options.h"

#include <CLI/CLI.hpp>
#include <memory>

namespace hybrid {

std::string& typed_command() {
  static std::string line;
  return line;
}

void add_report(CLI::App& sub, ReportRequest& report) {
  sub.add_option("--report", report.folder,
                 "write report.html, a page that explains itself, and its data into this folder");
  report.command = typed_command();
}

void add_compare(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand("compare",
                                 "One object as mesh and proxy, as voxels, and in closed form, along the "
                                 "same path; or two or more whole "
                                 "scenes along the path of the first");
  auto c = std::make_shared<CompareCommand>();
  sub->add_option("SCENE", c->scenes, "scene files (.toml)")->required();
  auto* object =
      sub->add_option("--object", c->object, "of one scene: name of the object; default: the first");
  auto* samples =
      sub->add_option(
             "--samples", c->samples,
             "of two or more scenes: ticks in which each is compared with itself played slowly, which takes "
             "several times as long as the session: all in contact, or 0")
          ->check(CLI::IsMember({"0", "all"}))
          ->capture_default_str();
  device::MeasuredFile& file = c->measured.measured;
  auto* measured = sub->add_option(
      "--measured", file.file, "compare the whole scene with forces measured along a motion (.traj, .csv)");
  sub->add_option("--along", c->measured.along,
                  "of --measured: the device's positions, from a file of their own")
      ->needs(measured);
  sub->add_option("--columns", file.columns,
                  "of --measured: its columns, as in t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N")
      ->needs(measured);
  sub->add_option("--force", file.force,
                  "of --measured: which force, by the first part of its columns' names")
      ->needs(measured);
  sub->add_option("--rate", file.rate_hz, "of --measured: samples a second, where it has no times")
      ->check(CLI::PositiveNumber)
      ->needs(measured);
  sub->add_flag("--on-object", file.on_object, "of --measured: its forces are those on the object")
      ->needs(measured);
  auto* plot = sub->add_option("--plot", c->plot, "write force over time and depth as SVG");
  auto* classic = sub->add_flag("--classic", c->classic,
                                "of --plot, one scene: draw the thesis's algorithm too, below the others")
                      ->needs(plot);
  auto* models = sub->add_flag("--models", c->models,
                               "of one scene: play it whole, each object that the path touches by other "
                               "models, against one reference; some minutes");
  sub->add_option("--cache", c->cache, "of --models: folder that keeps the reference; as in tune")
      ->needs(models);
  sub->add_flag("--write-variants", c->write_variants,
                "of --models: write each model as a scene beside the given one, comments kept")
      ->needs(models);
  measured->excludes(object)->excludes(classic)->excludes(models);
  models->excludes(classic);
  add_report(*sub, c->report);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([=, &status] {
    const bool whole = c->scenes.size() > 1;
    for (const CLI::Option* option : {object, measured, classic, models}) {
      if (whole && option->count() > 0)
        throw CLI::ValidationError(option->get_name(), "takes one scene only");
    }
    if (!whole && samples->count() > 0) throw CLI::ValidationError("--samples", "takes two or more scenes");
    status = compare(*c);
  });
}

void add_tissue_options(CLI::App& sub, ComposeOptions& options, CLI::Option* labels) {
  sub.add_option("--names", options.names, "of --labels: what they are called (CSV: number, name; or JSON)")
      ->needs(labels);
  sub.add_option("--rigid", options.rigid,
                 "of --labels: names, patterns (rib_*) and numbers, with commas between, that become rigid "
                 "surfaces; or none. Default: bones, by their names")
      ->delimiter(',')
      ->needs(labels);
  sub.add_option("--soft", options.soft,
                 "of --labels: those that become tissue; or none. Default: all that is not bone")
      ->delimiter(',')
      ->needs(labels);
  sub.add_option_function<std::vector<double>>(
         "--range",
         [&options](const std::vector<double>& v) {
           options.range = {v.at(0), v.at(1)};
         },
         "intensities LO,HI that are tissue, of a volume without labels; default: above Otsu's threshold")
      ->delimiter(',')
      ->expected(2);
  sub.add_option_function<double>(
         "--spacing", [&options](double mm) { options.spacing_m = mm * 1e-3; },
         "voxel size of tissue in mm; default: the file's, coarser above 1.5 million voxels of tissue")
      ->check(CLI::PositiveNumber);
}

void add_study(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "study", "Many segmented scans: composes, plays and judges each; a page over all, outliers first");
  auto c = std::make_shared<StudyCommand>();
  c->command_line = typed_command();
  StudyOptions& o = c->options;
  sub->add_option("SCANS", c->scans, "volumes, folders of a DICOM series, and folders of these")->required();
  auto* labels =
      sub->add_option("--labels", c->labels,
                      "label volumes and folders of them; each belongs to the scan whose name its own name "
                      "begins with, or beside which it lies. NAME=FILE: to the scan of this name");
  sub->add_option("--out", o.out, "folder to write; finished scans in it are not judged again")->required();
  add_tissue_options(*sub, o.compose, labels);
  auto* tune = sub->add_flag("--tune", o.tune, "also choose settings for each scene; takes minutes for each");
  sub->add_flag("--quick", o.quick, "of --tune: fewer settings and passes")->needs(tune);
  sub->add_option("--budget-us", o.budget_us,
                  "most microseconds of a tick's p99.9; default: half of the device's period")
      ->check(CLI::PositiveNumber);
  sub->add_option("--error-jnd", o.error_jnd, "error that may be felt: p99, in JND")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = study(*c); });
}

}  // namespace hybrid
