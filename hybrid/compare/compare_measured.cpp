// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/compare_measured.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "device/loop/stop_signal.h"
#include "device/paths/path_file.h"

namespace hybrid {
namespace {

constexpr double kOpposite_deg = 150.0;  // median angle beyond which a sign must be wrong

glm::dvec3 between(const std::vector<glm::dvec3>& values, std::size_t before, double share) {
  if (share == 0.0) return values[before];
  return values[before] + share * (values[before + 1] - values[before]);
}

double between(const std::vector<double>& values, std::size_t before, double share) {
  return share == 0.0 ? values[before] : values[before] + share * (values[before + 1] - values[before]);
}

// The measured forces at the times of the rows of `felt`. Rows in a gap of the measurement are removed from
// both.
ModelResult measured_model(const device::MeasuredTrajectory& trajectory, const std::string& file,
                           ModelResult& felt, std::size_t& in_gaps) {
  ModelResult measured{.name = "measured: " + file, .rows = {}, .depth_m = {}, .tick_us = {}};
  std::vector<TraceRow> kept;
  for (const TraceRow& row : felt.rows) {
    std::size_t before = 0;
    double share = 0.0;
    if (!device::measured_at(trajectory, row.t_s, before, share)) {
      ++in_gaps;
      continue;
    }
    TraceRow at{.t_s = row.t_s, .device_m = row.device_m, .proxy_m = row.device_m};
    if (!trajectory.force_N.empty()) {
      at.force_N = between(trajectory.force_N, before, share);
    } else {
      // Only the strength was measured. It is taken along the rendered force, so that the difference is one
      // of strength.
      const double length = glm::length(row.force_N);
      const glm::dvec3 along = length > 0.0 ? row.force_N / length : glm::dvec3(0.0, 0.0, 1.0);
      at.force_N = between(trajectory.strength_N, before, share) * along;
    }
    measured.rows.push_back(at);
    kept.push_back(row);
  }
  felt.rows = std::move(kept);
  return measured;
}

double rms_over_all(const ModelResult& felt, const ModelResult& measured) {
  double sum2 = 0.0;
  for (std::size_t i = 0; i < felt.rows.size(); ++i) {
    const glm::dvec3 error = felt.rows[i].force_N - measured.rows[i].force_N;
    sum2 += glm::dot(error, error);
  }
  return felt.rows.empty() ? 0.0 : std::sqrt(sum2 / static_cast<double>(felt.rows.size()));
}

}  // namespace

MeasuredComparison compare_measured(const Scene& scene, const MeasuredOptions& options,
                                    const Progress& progress) {
  device::MeasuredTrajectory trajectory = device::read_measured(options.measured);
  MeasuredComparison result;
  result.notes = trajectory.notes;
  device::Trajectory motion{.t_s = trajectory.t_s, .position_m = trajectory.position_m, .notes = {}};
  if (!options.along.empty()) {
    device::MeasuredFile along = options.measured;
    along.file = options.along;
    along.needs_force = false;
    device::MeasuredTrajectory positions = device::read_measured(along);
    result.notes.insert(result.notes.end(), positions.notes.begin(), positions.notes.end());
    motion = {.t_s = std::move(positions.t_s), .position_m = std::move(positions.position_m), .notes = {}};
  }
  // The motion lasts until its last sample, which is a tick too.
  const double seconds = std::min(motion.t_s.back(), trajectory.t_s.back()) + 1.0 / scene.rate_hz;

  const Scene ideal = on_ideal_device(scene);
  BuiltScene built = build_scene(ideal, progress);
  SessionResult session = run_session(
      ideal, built, {.seconds = seconds, .progress = progress, .path = device::make_path(std::move(motion))});
  device::stop_if_asked();
  ModelResult felt{.name = "scene",
                   .rows = std::move(session.rows),
                   .depth_m = {},
                   .tick_us = session.tick_us.percentiles()};
  const std::string file = options.measured.file.filename().string();
  ModelResult measured = measured_model(trajectory, file, felt, result.in_gaps);
  result.samples = felt.rows.size();
  result.rms_N = rms_over_all(felt, measured);

  Comparison& comparison = result.comparison;
  comparison.object = "along " + file;
  comparison.jnd_floor_N = jnd_floor_N(scene);
  comparison.reference = 1;
  comparison.reference_text = measured.name;
  measure(felt, measured, comparison.jnd_floor_N);
  measure(measured, measured, comparison.jnd_floor_N);
  if (trajectory.force_N.empty()) {
    comparison.note = "only the strength of the force was measured: its direction is not compared";
  } else if (felt.direction_p50_deg > kOpposite_deg) {
    comparison.note =
        "the measured forces point against the rendered ones: if they are those on the object, and not on "
        "the hand, "
        "add --on-object";
  }
  comparison.models.push_back(std::move(felt));
  comparison.models.push_back(std::move(measured));
  return result;
}

}  // namespace hybrid
