// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/evaluation.h"

#include <algorithm>

namespace hybrid {
namespace {

nlohmann::json felt_json(const FeltError& e) {
  return {e.ticks, e.p50_jnd, e.p99_jnd, e.max_jnd, e.max_t_s};
}

FeltError felt_from(const nlohmann::json& j) {
  return {j.at(0).get<std::uint64_t>(), j.at(1).get<double>(), j.at(2).get<double>(), j.at(3).get<double>(),
          j.at(4).get<double>()};
}

// The course with every tick that has a force marked as felt, not only those with a soft object.
ForceCourse felt_anywhere(ForceCourse course) {
  for (CourseTick& tick : course) tick.soft = tick.force_N != glm::dvec3(0.0);
  return course;
}

}  // namespace

Evaluation evaluation_of(Played played, const ForceCourse& truth, double floor_N, double dt_s,
                         bool other_coupling) {
  const SettingError at_soft = felt_error(played.course, truth, floor_N, dt_s);
  Evaluation evaluation{
      .error = other_coupling ? felt_error(felt_anywhere(played.course), felt_anywhere(truth), floor_N, dt_s)
                              : at_soft,
      .at_soft = at_soft,
      .tick_us = std::move(played.tick_us),
      .memory_bytes = played.memory_bytes,
      .soft_voxels = played.soft_voxels,
      .load_s = played.load_s,
      .on_patches = played.on_patches,
      .faults = std::move(played.faults),
      .refused = {}};
  std::vector<double> felt;
  for (std::size_t t = 0; t < std::min(evaluation.tick_us.size(), truth.size()); ++t) {
    if (truth[t].soft) felt.push_back(evaluation.tick_us[t]);
  }
  evaluation.felt_p99_us = percentiles(felt).p99;
  return evaluation;
}

nlohmann::json to_json(const Evaluation& e) {
  return {{"moving", felt_json(e.error.moving)},
          {"still", felt_json(e.error.still)},
          {"at_soft", {felt_json(e.at_soft.moving), felt_json(e.at_soft.still)}},
          {"tick_us", e.tick_us},
          {"felt_p99_us", e.felt_p99_us},
          {"memory_bytes", e.memory_bytes},
          {"soft_voxels", e.soft_voxels},
          {"load_s", e.load_s},
          {"on_patches", e.on_patches},
          {"faults", e.faults},
          {"refused", e.refused}};
}

Evaluation evaluation_from(const nlohmann::json& j) {
  Evaluation e;
  e.error = {felt_from(j.at("moving")), felt_from(j.at("still"))};
  e.at_soft = {felt_from(j.at("at_soft").at(0)), felt_from(j.at("at_soft").at(1))};
  j.at("tick_us").get_to(e.tick_us);
  j.at("felt_p99_us").get_to(e.felt_p99_us);
  j.at("memory_bytes").get_to(e.memory_bytes);
  j.at("soft_voxels").get_to(e.soft_voxels);
  j.at("load_s").get_to(e.load_s);
  j.at("on_patches").get_to(e.on_patches);
  j.at("faults").get_to(e.faults);
  j.at("refused").get_to(e.refused);
  return e;
}

Percentiles median_ticks(const std::vector<std::vector<double>>& passes) {
  std::vector<double> medians, of_tick(passes.size());
  for (std::size_t t = 0; t < passes.front().size(); ++t) {
    for (std::size_t p = 0; p < passes.size(); ++p) of_tick[p] = passes[p].at(t);
    std::ranges::nth_element(of_tick, of_tick.begin() + static_cast<std::ptrdiff_t>(of_tick.size() / 2));
    medians.push_back(of_tick[of_tick.size() / 2]);
  }
  return percentiles(medians);
}

}  // namespace hybrid
