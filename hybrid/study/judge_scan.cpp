// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/study/judge_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <new>
#include <stdexcept>

#include "device/loop/stop_signal.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/page/page.h"
#include "hybrid/session/report.h"
#include "hybrid/session/session.h"
#include "hybrid/tune/cache.h"
#include "hybrid/tune/tune_page.h"
#include "hybrid/tune/tune_report.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;
using Record = nlohmann::json;

// A text that changes when the file, or a file in the folder, is replaced or edited.
std::string version_of(const fs::path& path) {
  if (path.empty()) return "none";
  std::uintmax_t bytes = 0;
  fs::file_time_type newest = fs::file_time_type::min();
  const auto add = [&](const fs::path& file) {
    bytes += fs::file_size(file);
    newest = std::max(newest, fs::last_write_time(file));
  };
  if (fs::is_directory(path)) {
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.is_regular_file()) add(entry.path());
    }
  } else {
    add(path);
  }
  return fmt::format("{} {} {}", fs::weakly_canonical(path).string(), bytes,
                     newest.time_since_epoch().count());
}

// Everything on which the composed scene depends.
std::string composed_from(const ScanPair& pair, const ComposeOptions& common) {
  Record key{{"scan", version_of(pair.scan)},
             {"labels", version_of(pair.labels)},
             {"names", version_of(common.names)},
             {"rigid", common.rigid},
             {"soft", common.soft},
             {"spacing_m", common.spacing_m.value_or(0.0)},
             {"version", report_head("study").at("version")}};
  if (common.range) key["range"] = *common.range;
  return key.dump();
}

Record read_json(const fs::path& file) {
  std::ifstream in(file);
  return in ? Record::parse(in, nullptr, false) : Record();
}

// The record compose.json: `key`, `notes`, and the presses of the path with their places.
Record compose_scan(const ScanPair& pair, const StudyOptions& options, const fs::path& folder,
                    const Progress& progress) {
  const fs::path scene = folder / "scene" / "scene.toml", record_file = folder / "compose.json";
  const std::string key = composed_from(pair, options.compose);
  Record record = read_json(record_file);
  const bool ours = record.is_object() && record.contains("key");
  if (fs::exists(scene) && ours && record.at("key") == key) return record;
  if (fs::exists(scene) && !ours) {
    throw std::runtime_error(fmt::format(
        "{}: a scene lies there that no study wrote; move it away, or name another folder with --out",
        scene.string()));
  }
  ComposeOptions own = options.compose;
  own.inputs.clear();
  if (!pair.scan.empty()) own.inputs.push_back(pair.scan);
  own.labels = pair.labels;
  own.out = scene.parent_path();
  own.force = ours;
  if (ours) fs::remove_all(own.out);  // files of a former composition
  const Composed composed = compose(own, progress);
  record = {{"key", key}, {"notes", composed.notes}, {"presses", Record::array()}};
  for (const PathPoint& point : composed.path.points) {
    if (point.hold_s > 0.0)
      record["presses"].push_back({point.comment, point.at_m.x, point.at_m.y, point.at_m.z});
  }
  save_text(record_file, record.dump(1) + '\n');
  return record;
}

std::string press_near(const Record& presses, const glm::dvec3& at_m) {
  std::string nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const Record& press : presses) {
    const glm::dvec3 place(press.at(1).get<double>(), press.at(2).get<double>(), press.at(3).get<double>());
    if (glm::distance(place, at_m) >= least) continue;
    least = glm::distance(place, at_m);
    press.at(0).get_to(nearest);
  }
  return nearest;
}

Record played(const Scene& as_read, const Record& presses, const Progress& progress) {
  const Scene scene = load_scene(as_read.file);
  BuiltScene built = build_scene(scene, progress);
  const SceneSize size = size_of(built);
  std::uint64_t on_patches = 0;
  for (const auto& object : built.state->soft) on_patches += object->uses_patches() ? 1 : 0;
  SessionOptions options;
  options.keep_recording = false;
  options.measure_error = true;
  options.reference = Reference::quick;
  options.progress = progress;
  options.async_relaxation = true;
  const SessionResult result = run_session(scene, built, options);
  device::stop_if_asked();
  const Percentiles tick = result.tick_us.percentiles();
  const ForceError& error = result.error;
  const auto worst = static_cast<std::size_t>(std::max(0.0, error.all.worst_t_s / result.dt_s));
  return {{"ticks", result.ticks},
          {"contact_ticks", result.contact_ticks},
          {"seconds", static_cast<double>(result.ticks) * result.dt_s},
          {"tick_us", {tick.p50, tick.p99, tick.p999, tick.max}},
          {"not_measured", error.not_measured},
          {"error_jnd", {error.p99_jnd, error.moving.max_jnd, error.still.max_jnd}},
          {"worst_near", error.all.samples > 0 && worst < result.rows.size()
                             ? press_near(presses, result.rows[worst].device_m)
                             : std::string()},
          {"max_force_N", result.max_force_N},
          {"objects", {built.world->rigid.size(), built.world->soft.size(), on_patches}},
          {"soft_voxels", size.soft_voxels},
          {"memory_bytes", size.memory_bytes},
          {"load_s", built.seconds},
          {"faults", fault_texts(built.state->faults)}};
}

void take(const Record& record, JudgedScan& judged) {
  SessionFigures& session = judged.session;
  record.at("ticks").get_to(session.ticks);
  record.at("contact_ticks").get_to(session.contact_ticks);
  record.at("seconds").get_to(session.seconds);
  const Record& tick = record.at("tick_us");
  session.tick_us = {tick.at(0).get<double>(), tick.at(1).get<double>(), tick.at(2).get<double>(),
                     tick.at(3).get<double>()};
  record.at("not_measured").get_to(session.not_measured);
  record.at("error_jnd").at(0).get_to(session.p99_jnd);
  record.at("error_jnd").at(1).get_to(session.moving_max_jnd);
  record.at("error_jnd").at(2).get_to(session.still_max_jnd);
  record.at("worst_near").get_to(session.worst_near);
  record.at("max_force_N").get_to(session.max_force_N);
  record.at("objects").at(0).get_to(judged.rigid_objects);
  record.at("objects").at(1).get_to(judged.soft_objects);
  record.at("objects").at(2).get_to(judged.soft_on_patches);
  record.at("soft_voxels").get_to(judged.soft_voxels);
  record.at("memory_bytes").get_to(judged.memory_bytes);
  record.at("load_s").get_to(judged.load_s);
  record.at("faults").get_to(judged.faults);
}

// Chooses settings and writes the page of the search beside the scene.
TunedScan tuned(const Scene& as_read, const StudyOptions& options, const fs::path& folder,
                const Progress& progress) {
  TunedScan out;
  try {
    const TuneResult result = tune(as_read, {.error_jnd = options.error_jnd,
                                             .budget_us = options.budget_us,
                                             .quick = options.quick,
                                             .cache = folder / "cache",
                                             .progress = progress});
    const TunedSetting& chosen = result.settings[result.chosen];
    out.verdict = tune_verdict(result);
    out.words = chosen.words;
    out.accurate_in_time = result.choice.rule == ChoiceRule::cheapest_accurate;
    out.error_jnd = chosen.error.worst_jnd();
    out.p999_us = chosen.tick_us.p999;
    Page page = tune_page(result, folder.filename().string() + ": settings");
    auto report = report_head("tune");
    report.update(tune_json(result));
    set_provenance(page,
                   fmt::format("hybrid tune {} --cache {}{}", as_read.file.string(),
                               (folder / "cache").string(), options.quick ? " --quick" : ""),
                   report);
    require_writable(folder / "tune" / kPageFile);  // makes the folder
    save_page(folder / "tune", page);
  } catch (const std::exception& error) {
    out.not_tuned = error.what();
  }
  return out;
}

void judge(JudgedScan& judged, const StudyOptions& options) {
  const fs::path folder = options.out / judged.pair.name;
  if (!judged.pair.unpaired.empty()) throw std::runtime_error(judged.pair.unpaired);
  const Progress& progress = options.progress;
  const Record composed = compose_scan(judged.pair, options, folder, progress);
  composed.at("notes").get_to(judged.notes);
  judged.scene = folder / "scene" / "scene.toml";
  const Scene scene = read_scene(judged.scene);
  judged.bounds = {options.error_jnd, options.budget_us.value_or(kBudgetShare * 1e6 / scene.rate_hz)};
  const EvaluationCache cache(folder / "cache", scene);
  const std::string key = "study: a session, compared with a slow run";
  auto record = cache.find(key);
  if (!record) {
    record = played(scene, composed.at("presses"), progress);
    cache.keep(key, *record);
  }
  take(*record, judged);
  if (options.tune) judged.tuned = tuned(scene, options, folder, progress);
}

}  // namespace

JudgedScan judge_scan(const ScanPair& pair, const StudyOptions& options) {
  JudgedScan judged{.pair = pair};
  try {
    judge(judged, options);
  } catch (const std::bad_alloc&) {
    judged.failed = "out of memory; use a coarser --spacing";
  } catch (const std::exception& error) {
    judged.failed = error.what();
  }
  return judged;
}

}  // namespace hybrid
