// SPDX-License-Identifier: GPL-3.0-or-later
// Cubes of tissue: from loading the scene to the first touch, and pressed by a vigorous hand.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "device/loop/stop_signal.h"
#include "hybrid/bench/soft.h"
#include "hybrid/bench/soft_engines.h"
#include "hybrid/compare/compare.h"
#include "hybrid/session/session.h"

namespace hybrid::bench {
namespace {

// Slack as a share of the rest length; speed of the tool (m/s); its radius (m).
constexpr double kSlack = 0.1, kSpeed = 0.5, kToolRadius = 8.0 * kSoftSpacing_m;
constexpr double kMostDepth = 20.0;  // unit: spacing

// At slack 0.1 a push reaches ten times as far as it is deep, and no chain is longer than the cube. So small
// cubes are pressed less deep: the tool must feel the tissue, not its anchors.
double depth_for(int edge) {
  return std::min(kMostDepth, edge / 16.0);
}

// A cube of `edge` voxels. Its top is pressed again and again at 0.5 m/s, each time at a slightly different
// place. The tool's travel upwards and sideways is proportional to its depth. So the share of time in contact
// is the same for all sizes. Otherwise median times would depend on that share, not on the size.
Scene cube_scene(int edge, double seconds) {
  Scene scene = on_ideal_device({});
  scene.file = fmt::format("cube of {} voxels an edge", edge);
  scene.tool.radius_m = kToolRadius;
  scene.materials["tissue"] = {
      .stretch_min = 1.0 - kSlack, .stretch_max = 1.0 + kSlack, .shear = kSlack, .place = {}};
  voxel::Formula cube{.size_m = glm::dvec3(edge * kSoftSpacing_m),
                      .spacing_m = glm::dvec3(kSoftSpacing_m),
                      .layers = {},
                      .inclusions = {}};
  scene.soft.push_back({.name = "cube",
                        .source = std::move(cube),
                        .pose = {},
                        .materials = {},
                        .material = "tissue",
                        .anchors = {},
                        .place = {},
                        .source_place = {}});
  const double top = 0.5 * edge * kSoftSpacing_m + kToolRadius, depth = depth_for(edge) * kSoftSpacing_m;
  const double above = top + 0.25 * depth, low = top - depth, aside = 0.5 * depth;
  device::WaypointPath path{.points = {}, .speed_m_per_s = kSpeed};
  const std::array<glm::dvec2, 4> places{glm::dvec2(0.0), glm::dvec2(aside, 0.0), glm::dvec2(aside, aside),
                                         glm::dvec2(-aside, 0.5 * aside)};
  double way = 0.0;
  for (std::size_t n = 0; way < seconds * kSpeed || n < 2; ++n) {
    const glm::dvec2 at = places[n % places.size()], next = places[(n + 1) % places.size()];
    path.points.push_back({{at, above}, 0.0});
    path.points.push_back({{at, low}, 0.0});
    path.points.push_back({{at, above}, 0.0});
    way += 2.0 * (above - low) + glm::length(next - at);
  }
  scene.path = std::move(path);
  return scene;
}

SoftRow empty_row(const char* name, int edge) {
  return {.test_case = name,
          .voxels = static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge) *
                    static_cast<std::size_t>(edge),
          .material = "homogeneous",
          .slack = kSlack};
}

std::size_t soft_bytes(const WorldState& state) {
  std::size_t bytes = 0;
  for (const auto& object : state.soft) bytes += object->memory_bytes();
  return bytes;
}

SoftRow session_row(int edge, const Scene& scene, BuiltScene& built, const SoftBenchOptions& options) {
  SoftRow row = empty_row("session", edge);
  row.depth_spacings = depth_for(edge);
  const SessionResult result = run_session(scene, built,
                                           {.seconds = options.session_s,
                                            .keep_rows = false,
                                            .keep_recording = false,
                                            .measure_error = true,
                                            .reference = Reference::full,
                                            .progress = {},
                                            .async_relaxation = true});
  device::stop_if_asked();
  row.repeats = result.ticks;
  row.time_us = result.tick_us.percentiles();
  row.truncated_share = static_cast<double>(built.state->truncated_ticks) /
                        static_cast<double>(std::max<std::uint64_t>(1, result.ticks));
  if (result.error.all.samples > 0) {
    row.force_error_N = result.error.p99_N;
    row.force_error_jnd = result.error.p99_jnd;
    row.reference = "the same session ten times slower";
  }
  row.bytes_per_voxel = static_cast<double>(soft_bytes(*built.state)) / static_cast<double>(row.voxels);
  row.note = fmt::format("ticks; error's p99 of {}, at most {:.2f} JND", result.error.all.samples,
                         result.error.all.max_jnd);
  return row;
}

}  // namespace

void bench_sessions(const SoftBenchOptions& options, bool sessions, bool loads, const AddRow& add) {
  std::vector<int> sizes = options.sizes;
  if (sizes.empty()) sizes = options.quick ? std::vector{32} : std::vector{64, 128};
  for (const int edge : sizes) {
    if (options.progress) options.progress(fmt::format("a session with {} voxels an edge", edge));
    const Scene scene = cube_scene(edge, options.session_s);
    SoftRow load = empty_row("load", edge);
    BuiltScene built;
    try {
      built = build_scene(scene);
    } catch (const SceneError& refused) {
      load.note = refused.what();
      if (loads) add(std::move(load));
      continue;
    }
    const double us = 1e6 * built.seconds;
    load.time_us = Percentiles{us, us, us, us};
    load.bytes_per_voxel = static_cast<double>(soft_bytes(*built.state)) / static_cast<double>(load.voxels);
    load.note = "from the scene to ready";
    if (loads) add(std::move(load));
    if (sessions) add(session_row(edge, scene, built, options));
  }
}

}  // namespace hybrid::bench
