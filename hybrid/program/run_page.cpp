// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/run_page.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/plot/session_plot.h"
#include "hybrid/plot/svg_figure.h"
#include "hybrid/session/report.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/stress/scratch_folder.h"
#include "hybrid/view/picture.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

std::optional<double> number_at(const Json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_number() ? std::optional<double>(at->get<double>()) : std::nullopt;
}

double seconds_of(const SessionResult& result) {
  return static_cast<double>(result.ticks) * result.dt_s;
}

// ---- the verdict ----

std::string error_in_short(const ForceError& error) {
  if (error.all.samples == 0) return {};
  return fmt::format("; the tissue's force is {} {:.2f} JND {} equilibrium",
                     error.all.max_jnd <= 1.0 ? "within" : "up to", error.all.max_jnd,
                     error.all.max_jnd <= 1.0 ? "of" : "from");
}

// PageMark::good: something was touched, nothing failed, ticks were in time, and a hand would not feel the
// errors.
PageMark mark_of(const SessionResult& result, std::size_t faults, double p999_us) {
  if (faults > 0 || result.contact_ticks == 0) return PageMark::bad;
  const bool accurate = result.error.all.max_jnd <= 1.0, in_time = p999_us <= 1e6 * result.dt_s;
  return accurate && in_time ? PageMark::good : PageMark::none;
}

std::string verdict_of(const SessionResult& result, std::size_t faults) {
  if (result.contact_ticks == 0) return "Nothing was touched: the path leads to no object.";
  std::string text = fmt::format("The hand felt at most {:.2f} N in {:.2f} s of contact", result.max_force_N,
                                 static_cast<double>(result.contact_ticks) * result.dt_s);
  text += error_in_short(result.error);
  if (faults > 0) text += fmt::format("; {} {} below", faults, faults == 1 ? "fault is" : "faults are");
  return text + ".";
}

std::string tick_in_short(double p999_us, double period_us) {
  return fmt::format("999 of 1000 ticks took at most {:.0f} µs, {} the {:.0f} µs that a tick may take.",
                     p999_us, p999_us > period_us ? "more than" : "within", period_us);
}

std::vector<std::string> summary_of(const Scene& scene, const SessionResult& result, const Json& report,
                                    double p999_us) {
  std::vector<std::string> summary;
  summary.push_back(
      fmt::format("{} ticks of {:.3g} ms, {:.2f} s in all. The tool is a {} of radius {:.4g} mm on a "
                  "coupling of {:.4g} N/m. The device is {}.",
                  result.ticks, 1e3 * result.dt_s, seconds_of(result),
                  scene.tool.shape == Tool::Shape::ball ? "ball" : "flat punch", 1e3 * scene.tool.radius_m,
                  scene.tool.stiffness_N_per_m, result.device_name));
  summary.push_back(tick_in_short(p999_us, 1e6 * result.dt_s));
  if (result.end == device::ServoEnd::stopped) summary.emplace_back("A signal ended the session early.");
  if (result.end == device::ServoEnd::lost) summary.emplace_back("The device was lost during the session.");
  summary.push_back(fmt::format("Scene: {}", report.value("scene", "")));
  return summary;
}

// ---- sections ----

std::string file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

PagePart picture_of(const DrawnScene& drawn, const SessionResult& result) {
  try {
    const ScratchFolder scratch("page");
    const std::filesystem::path png = scratch.path() / "picture.png";
    save_picture(png, drawn, *result.moment);
    return PageFigure{
        .name = "picture",
        .caption = result.contact_ticks > 0
                       ? fmt::format("The scene after {:.3f} s, when most was in contact. The arrow is the "
                                     "force on the hand.",
                                     result.moment->t_s)
                       : fmt::format("The scene after {:.3f} s. Nothing was touched in the session.",
                                     result.moment->t_s),
        .alternative = result.contact_ticks > 0
                           ? "Drawing of the objects, the tool and the force at the moment of most contact"
                           : "Drawing of the objects and the tool",
        .png = file_bytes(png)};
  } catch (const std::exception& why) {
    return "There is no picture: " + std::string(why.what());
  }
}

PageSection force_section(const DrawnScene& drawn, const SessionResult& result, const std::string& title) {
  const auto objects = plotted_objects(drawn, result.rows, result.object_force_N);
  const Figure figure =
      session_figure(result.rows, objects, title, {.near = result.clearance, .period_s = result.dt_s});
  return {
      .heading = "Force on the hand",
      .parts = {PageFigure{.name = "force",
                           .caption = "Force over time, contacts, distance of the proxy and the time of each "
                                      "tick. Below, force over depth for each press, and over path length "
                                      "for each stroke.",
                           .alternative = fmt::format("Force over {:.2f} s, at most {:.2f} N",
                                                      seconds_of(result), result.max_force_N),
                           .svg = to_svg(figure)}}};
}

PageTable objects_table(const Json& report, double dt_s) {
  PageTable table{.name = "objects",
                  .caption = "Objects and their materials: how long and how hard the tool felt them",
                  .head = {"object", "kind", "elements", "felt (s)", "largest force (N)"},
                  .rows = {}};
  for (const Json& o : report["objects"]) {
    const bool soft = o["kind"] == "soft";
    table.rows.push_back({{.text = o["name"].get<std::string>()},
                          {.text = soft ? "soft, voxels" : "rigid, triangles"},
                          count_cell(o[soft ? "voxels" : "triangles"].get<std::uint64_t>()),
                          number_cell(o["contact_ticks"].get<double>() * dt_s, 3),
                          number_cell(number_at(o, "max_force_N"), 3)});
    if (!o.contains("materials") || o["materials"].size() < 2) continue;
    for (const Json& m : o["materials"]) {
      table.rows.push_back({{.text = o["name"].get<std::string>() + ": " + m["name"].get<std::string>()},
                            {.text = "material"},
                            {.text = "–"},
                            number_cell(m["contact_ticks"].get<double>() * dt_s, 3),
                            number_cell(number_at(m, "max_force_N"), 3)});
    }
  }
  return table;
}

std::optional<PageTable> between_table(const Json& report) {
  if (!report.contains("between_objects") || report["between_objects"]["pairs"].empty()) return std::nullopt;
  PageTable table{.name = "between-objects",
                  .caption = "Forces between objects, without the tool",
                  .head = {"soft object", "presses on", "largest force (N)", "at (s)", "at the end (N)"},
                  .rows = {}};
  for (const Json& pair : report["between_objects"]["pairs"]) {
    table.rows.push_back(
        {{.text = pair["soft"].get<std::string>()},
         {.text = pair["other"].is_string() ? pair["other"].get<std::string>() : "its anchors"},
         number_cell(number_at(pair, "max_N"), 3),
         number_cell(number_at(pair, "max_t_s"), 3),
         number_cell(number_at(pair, "end_N"), 3)});
  }
  return table;
}

PageSection objects_section(const Json& report, double dt_s) {
  PageSection section{.heading = "Forces by object", .parts = {objects_table(report, dt_s)}};
  if (auto between = between_table(report)) section.parts.emplace_back(std::move(*between));
  return section;
}

PageSection error_section(const Scene& scene, const SessionResult& result) {
  const ForceError& error = result.error;
  PageSection section{.heading = "How far the force is from equilibrium", .parts = {}};
  if (error.all.samples == 0) {
    section.parts.emplace_back("Not measured: " + error.not_measured + ".");
    return section;
  }
  section.parts.emplace_back(fmt::format(
      "Each tick with tissue in contact is compared with {}. One JND, the "
      "difference that a hand just notices, is {:.0f} % of the force and at least {:.3f} N. Found: {}.",
      reference_words(error), 100.0 * kJndShare, jnd_floor_N(scene), in_words(error)));
  PageTable table{.name = "force-error",
                  .caption = "Difference from equilibrium",
                  .head = {"device", "ticks compared", "largest (N)", "rms (N)", "largest (JND)", "at (s)"},
                  .rows = {}};
  const auto add = [&table](const char* name, const ErrorRange& range) {
    if (range.samples == 0) return;
    table.rows.push_back({{.text = name},
                          count_cell(static_cast<std::uint64_t>(range.samples)),
                          number_cell(range.max_N, 4),
                          number_cell(range.rms_N, 4),
                          number_cell(range.max_jnd, 2),
                          number_cell(range.worst_t_s, 3)});
  };
  add("moving", error.moving);
  add("held still", error.still);
  section.parts.emplace_back(std::move(table));
  return section;
}

PageSection ticks_section(const Json& report, double period_us) {
  PageTable table{
      .name = "ticks",
      .caption = fmt::format("Processor time of a tick and its stages; {:.0f} µs are there", period_us),
      .head = {"stage", "median (µs)", "99 % (µs)", "99.9 % (µs)", "largest (µs)"},
      .rows = {}};
  const auto add = [&table](const std::string& name, const Json& time) {
    table.rows.push_back({{.text = name},
                          number_cell(number_at(time, "p50"), 1),
                          number_cell(number_at(time, "p99"), 1),
                          number_cell(number_at(time, "p999"), 1),
                          number_cell(number_at(time, "max"), 1)});
  };
  add("whole tick", report["tick_us"]);
  for (const auto& [name, time] : report["stage_us"].items()) {
    std::string words = name;
    std::ranges::replace(words, '_', ' ');
    add(words, time);
  }
  return {.heading = "Time of a tick", .parts = {std::move(table)}};
}

PageSection notes_section(const Json& report) {
  PageTable table{.name = "notes",
                  .caption = "Faults, and notes of the build and the session",
                  .head = {"kind", "object", "text"},
                  .rows = {}};
  const auto add = [&table](const char* kind, const std::string& object, const Json& text, PageMark mark) {
    table.rows.push_back({{.text = kind},
                          {.text = object.empty() ? "scene" : object},
                          {.text = text.get<std::string>(), .mark = mark}});
  };
  for (const Json& fault : report["faults"]) add("fault", "", fault, PageMark::bad);
  for (const Json& note : report["notes"]) {
    const std::string severity = note["severity"].get<std::string>();
    add(severity == "info"      ? "note"
        : severity == "warning" ? "warning"
                                : "error",
        note["object"].get<std::string>(), note["text"], PageMark::none);
  }
  for (const Json& note : report["path_notes"]) add("path", "", note, PageMark::none);
  for (const Json& message : report["device"]["messages"]) add("device", "", message, PageMark::none);
  PageSection section{.heading = "Notes and faults", .parts = {}};
  if (table.rows.empty())
    section.parts.emplace_back("None.");
  else
    section.parts.emplace_back(std::move(table));
  return section;
}

}  // namespace

Page run_page(const Scene& scene, const BuiltScene& built, const SessionResult& result, const Json& report,
              const std::string& title) {
  const DrawnScene drawn = drawn_scene(scene, built, title);
  const std::size_t faults = report["faults"].size();
  const double p999_us = number_at(report["tick_us"], "p999").value_or(0.0);
  Page page{.title = title + ": a haptic session",
            .verdict = verdict_of(result, faults),
            .mark = mark_of(result, faults, p999_us),
            .summary = summary_of(scene, result, report, p999_us),
            .sections = {}};
  page.sections.push_back({.heading = "The scene", .parts = {picture_of(drawn, result)}});
  page.sections.push_back(force_section(drawn, result, title));
  page.sections.push_back(objects_section(report, result.dt_s));
  if (!built.state->soft.empty()) page.sections.push_back(error_section(scene, result));
  page.sections.push_back(ticks_section(report, 1e6 * result.dt_s));
  page.sections.push_back(notes_section(report));
  return page;
}

}  // namespace hybrid
