// SPDX-License-Identifier: GPL-3.0-or-later
// The result of models_in_scene() as JSON and as a figure.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/models/models_text.h"
#include "hybrid/models/variants.h"
#include "hybrid/plot/compare_plot.h"
#include "hybrid/session/report.h"
#include "hybrid/tune/truth_text.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json felt_json_of(const FeltModel& felt) {
  return {{"force_p50_N", felt.force_p50_N},
          {"force_max_N", felt.force_max_N},
          {"onset_s", optional_json(felt.onset_s)},
          {"stiffness_N_per_m", optional_json(felt.stiffness_N_per_m)}};
}

Json row_json(const ModelRow& row, const ObjectModels& object) {
  Json j{{"name", row.name}, {"values", row.words}};
  j["left_out"] = row.left_out.empty() ? Json(nullptr) : Json(row.left_out);
  j["coupling_N_per_m"] = optional_json(row.coupling_N_per_m());
  if (!row.left_out.empty()) return j;
  j.update(felt_json_of(row.felt));
  j["direction_p50_deg"] = optional_json(row.felt.direction_p50_deg);
  j["direction_p99_deg"] = optional_json(row.felt.direction_p99_deg);
  const Json errors = to_json(row.felt.error);
  j["error_moving"] = errors.at("moving");
  j["error_still"] = errors.at("still");
  j["told_apart_by"] = told_apart_by(row, object);
  j["tick_us"] = to_json(row.tick_us);
  j["load_s"] = row.load_s;
  j["memory_bytes"] = row.memory_bytes;
  j["soft_voxels"] = row.soft_voxels;
  j["faults"] = row.faults;
  return j;
}

Json object_json(const ModelsInScene& models, const ObjectModels& object) {
  Json j{{"object", object.object}, {"rigid", object.rigid}, {"verdict", models_verdict(models, object)}};
  const auto best = cheapest_untold(object);
  j["cheapest_not_told_apart"] = best ? Json(object.rows[*best].name) : Json(nullptr);
  j["reference"] = felt_json_of(object.reference_felt);
  j["match"] = object.match ? to_json(*object.match) : Json(nullptr);
  j["models"] = Json::array();
  for (const ModelRow& row : object.rows) j["models"].push_back(row_json(row, object));
  return j;
}

Json reference_json(const ModelsInScene& models) {
  if (!models.truth) return {{"setting", "the scene as given, which is exact"}, {"error_jnd", 0.0}};
  return to_json(*models.truth);
}

// A course as rows for a figure. The contact bit says that the object is touched.
ComparedModel drawn_course(std::string name, const ForceCourse& course, const ObjectModels& object,
                           double dt_s) {
  ComparedModel model{.name = std::move(name), .rows = {}};
  for (std::size_t t = 0; t < course.size(); ++t) {
    model.rows.push_back({.t_s = static_cast<double>(t) * dt_s,
                          .device_m = course[t].device_m,
                          .proxy_m = course[t].device_m,
                          .force_N = course[t].force_N,
                          .contacts = course[t].soft ? 1U : 0U});
  }
  if (object.depth_from_proxy) model.depth_m = object.depth_m;
  return model;
}

// Force over depth is drawn without the unmatched proxy. Its force is so large that all other lines would lie
// on the axis.
Figure object_figure(const ModelsInScene& models, const ObjectModels& object, const std::string& title) {
  const std::string prefix = models.objects.size() > 1 ? object.object + ": " : "";
  const ComparePlotOptions options{.reference = 0, .jnd_share = kJndShare, .jnd_floor_N = models.floor_N};
  const auto drawn = [&](const std::string& name, const ForceCourse& course) {
    return drawn_course(prefix + name, course, object, models.dt_s);
  };
  std::vector<ComparedModel> others{drawn(models.truth ? "truth" : "exact", object.reference)};
  const ModelRow* proxy = nullptr;
  for (const ModelRow& row : object.rows) {
    if (!row.left_out.empty()) continue;
    if (row.name == kProxyVariant) {
      proxy = &row;
    } else {
      others.push_back(drawn(row.name, row.course));
    }
  }
  std::vector<ComparedModel> all = others;  // the proxy last, so that the others keep their colours
  if (proxy != nullptr) all.push_back(drawn(proxy->name, proxy->course));
  Figure figure = compare_figure(all, {}, title, options);
  if (proxy == nullptr) return figure;
  Figure over_depth = compare_figure(others, {}, title, options);
  figure.groups.erase(figure.groups.begin() + 1, figure.groups.end());
  std::move(over_depth.groups.begin() + 1, over_depth.groups.end(), std::back_inserter(figure.groups));
  figure.notes.emplace_back(
      "Force over depth is drawn without \"proxy\": its slope is that of the coupling.");
  return figure;
}

}  // namespace

nlohmann::ordered_json models_json(const ModelsInScene& models) {
  Json j;
  j["jnd"] = {{"share", kJndShare},
              {"floor_N", models.floor_N},
              {"direction_deg", kDirectionJnd_deg},
              {"stiffness_tool", kStiffnessJndTool},
              {"stiffness_finger", kStiffnessJndFinger}};
  j["reference"] = reference_json(models);
  j["untouched"] = models.untouched;
  j["objects"] = Json::array();
  for (const ObjectModels& object : models.objects) j["objects"].push_back(object_json(models, object));
  return j;
}

Figure models_figure(const ModelsInScene& models, const std::string& title) {
  Figure figure;
  for (const ObjectModels& object : models.objects) {
    Figure one = object_figure(models, object, title);
    if (figure.groups.empty()) {
      figure = std::move(one);
      continue;
    }
    for (std::string& note : one.notes) {
      if (std::ranges::find(figure.notes, note) == figure.notes.end())
        figure.notes.push_back(std::move(note));
    }
    std::ranges::move(one.groups, std::back_inserter(figure.groups));
  }
  return figure;
}

}  // namespace hybrid
