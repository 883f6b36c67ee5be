// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/thesis_rendering.h"

#include <chrono>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/build/build_objects.h"
#include "voxel/baseline/thesis_chainmail.h"

namespace hybrid {
ModelResult classic_voxels(const Scene& scene, const SoftDescription& soft,
                           const std::vector<TraceRow>& like) {
  using Clock = std::chrono::steady_clock;
  std::vector<BuildNote> notes;
  const voxel::LabelVolume volume = build_volume(soft, notes);
  voxel::ThesisChainMail object(volume, lattice_options(scene, soft), {.damping = kThesisDamping});
  const glm::dquat to_body = glm::conjugate(volume.rotation);
  ModelResult model{.name = kThesisModel, .rows = {}, .depth_m = {}, .tick_us = {}};
  const ScopedFlushToZero flushed;  // as in a session
  LatencyHistogram times;
  object.touch(glm::dvec3(1e9), 0.0);  // touches nothing; builds the map before the first timed tick
  for (const TraceRow& row : like) {
    const Clock::time_point start = Clock::now();
    const auto felt = object.touch(to_body * (row.device_m - volume.origin_m), scene.tool.radius_m);
    object.relax_in_turn(soft.budget);
    times.add(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
    model.rows.push_back({.t_s = row.t_s,
                          .device_m = row.device_m,
                          .proxy_m = row.device_m,
                          .force_N = volume.rotation * felt.force_N,
                          .contacts = felt.contact ? 1U : 0U});
  }
  model.tick_us = times.percentiles();
  return model;
}

}  // namespace hybrid
