// SPDX-License-Identifier: GPL-3.0-or-later
// Whole sessions on an ideal device: forces of the tick on objects that have a closed form.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/compare/closed_form.h"
#include "hybrid/compare/compare.h"
#include "hybrid/session/session.h"
#include "hybrid/validate/cases.h"
#include "hybrid/validate/specimen.h"

namespace hybrid {
namespace {

constexpr const char* kLoopGroup = "haptic loop";
constexpr double kToolRadius_m = 8e-3, kCoupling_N_per_m = 1000.0;

Scene scene_with_path(double from_z_m, double to_z_m) {
  Scene scene;
  scene.file = "validate";
  scene.tool = {
      .shape = Tool::Shape::ball, .radius_m = kToolRadius_m, .stiffness_N_per_m = kCoupling_N_per_m};
  scene.path = device::PressPath{
      .from_m = {0.0, 0.0, from_z_m}, .to_m = {0.0, 0.0, to_z_m}, .speed_m_per_s = 0.02, .hold_s = 0.5};
  return on_ideal_device(scene);
}

SessionResult played(const Scene& scene, bool keep_rows) {
  BuiltScene built = build_scene(scene);
  SessionOptions options;
  options.keep_rows = keep_rows;
  options.keep_recording = false;
  options.async_relaxation = true;
  return run_session(scene, built, options);
}

// The last row with the deepest device position, which is the end of the hold.
const TraceRow& end_of_hold(const std::vector<TraceRow>& rows) {
  const auto deepest = std::ranges::min_element(
      rows, [](const TraceRow& a, const TraceRow& b) { return a.device_m.z < b.device_m.z; });
  const double z_m = deepest->device_m.z;
  const auto after =
      std::find_if(deepest, rows.end(), [z_m](const TraceRow& row) { return row.device_m.z > z_m; });
  return *std::prev(after);
}

void add_rigid(const char* name, const RigidSource& source, double top_m, ValidationReport& report) {
  Scene scene = scene_with_path(top_m + kToolRadius_m + 5e-3, top_m + kToolRadius_m - 2e-3);
  scene.rigid.push_back({.name = "object", .source = source, .pose = {}, .place = {}, .source_place = {}});
  const ClosedForm form = *closed_form_of(scene.rigid.front());
  const SessionResult result = played(scene, true);
  const TraceRow& row = end_of_hold(result.rows);
  report.rows.push_back(
      {.group = kLoopGroup,
       .name = name,
       .source = "F = K·depth",
       .quantity = "force on the hand, held",
       .unit = "N",
       .reference = force_at(form, scene.tool, depth_in(form, scene.tool, row.device_m).depth_m),
       .ours = glm::length(row.force_N),
       .bound = 1e-3,
       .stated = true});
}

// Compares the tick's force after a hold with that of the same tissue, relaxed alone with the tool at the
// same place.
void add_soft(Energy energy, ValidationReport& report) {
  constexpr double spacing_m = 2e-3, poisson = 0.3, young_Pa = 10e3;
  constexpr double wide_m = 60e-3, deep_m = 30e-3;
  Scene scene = scene_with_path(0.5 * deep_m + kToolRadius_m + 5e-3, 0.5 * deep_m + kToolRadius_m - 4e-3);
  scene.materials["tissue"] = {.young_Pa = young_Pa, .poisson = poisson, .energy = energy, .place = {}};
  SoftDescription soft;
  soft.name = "tissue";
  soft.material = "tissue";
  voxel::Formula formula;
  formula.size_m = {wide_m, wide_m, deep_m};
  formula.spacing_m = glm::dvec3(spacing_m);
  soft.source = formula;
  scene.soft.push_back(soft);
  const SessionResult result = played(scene, true);
  const TraceRow& row = end_of_hold(result.rows);
  const double force_N = glm::length(row.force_N);
  const double depth_m = 0.5 * deep_m + kToolRadius_m - row.device_m.z - force_N / kCoupling_N_per_m;
  // The lattice of a scene's object begins half a spacing inside its surface, but contact is at the surface.
  PressedSpecimen alone({.size_m = {wide_m - spacing_m, wide_m - spacing_m, deep_m - spacing_m},
                         .spacing_m = spacing_m,
                         .energy = energy,
                         .poisson = poisson,
                         .young_Pa = {young_Pa}});
  report.rows.push_back({.group = kLoopGroup,
                         .name = std::string("ball held in a soft block, ") + words_of(energy),
                         .source = "the same block relaxed to rest without a loop",
                         .quantity = "force on the hand, held 0.5 s",
                         .unit = "N",
                         .reference = alone.on_ball_N(kToolRadius_m + 0.5 * spacing_m, depth_m),
                         .ours = force_N,
                         .bound = 0.01,
                         .stated = true});
}

}  // namespace

void add_loop_cases(const ValidationOptions& options, ValidationReport& report) {
  say(options, "haptic loop: rigid ball and box");
  add_rigid("rigid ball, through the proxy", BallPrimitive{20e-3}, 20e-3, report);
  add_rigid("rigid box, through the proxy", BoxPrimitive{{40e-3, 40e-3, 20e-3}}, 10e-3, report);
  say(options, "haptic loop: soft block");
  add_soft(Energy::six_link, report);
  add_soft(Energy::trilinear, report);
}

}  // namespace hybrid
