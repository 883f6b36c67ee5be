// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/build/build_objects.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/compare/closed_form.h"
#include "hybrid/compare/nearest_surface_rendering.h"
#include "hybrid/compare/thesis_rendering.h"

namespace hybrid {
namespace {

// Voxel spacing of a rigid object: this share of its longest side.
constexpr double kMeshVoxelShare = 1.0 / 40.0;
constexpr double kHardYoung_Pa =
    1e6;  // Young's modulus of a rigid object as voxels: feels about hard with a tool of millimeters

// The scene without objects, on an ideal device. The caller adds the one object.
Scene bare(const Scene& scene) {
  Scene one = on_ideal_device(scene);
  one.rigid.clear();
  one.soft.clear();
  return one;
}

// The rigid object as a soft object of the same shape and of material "hard". Empty for a sheet, for a body
// thinner than two voxels, and for a mesh, which may be open.
std::optional<SoftDescription> as_soft(const RigidDescription& rigid) {
  SoftDescription soft{.name = rigid.name,
                       .source = {},
                       .pose = rigid.pose,
                       .materials = {},
                       .material = "hard",
                       .anchors = {},
                       .place = rigid.place,
                       .source_place = rigid.source_place};
  if (const auto* ball = std::get_if<BallPrimitive>(&rigid.source)) {
    const double size = 2.0 * ball->radius_m;
    soft.source = voxel::Formula{.shape = voxel::Formula::Shape::ball,
                                 .size_m = glm::dvec3(size),
                                 .spacing_m = glm::dvec3(size * kMeshVoxelShare),
                                 .layers = {},
                                 .inclusions = {}};
    return soft;
  }
  const auto* box = std::get_if<BoxPrimitive>(&rigid.source);
  if (box == nullptr) return std::nullopt;
  const double spacing = kMeshVoxelShare * std::max({box->size_m.x, box->size_m.y, box->size_m.z});
  if (std::min({box->size_m.x, box->size_m.y, box->size_m.z}) < 2.0 * spacing) return std::nullopt;
  soft.source =
      voxel::Formula{.size_m = box->size_m, .spacing_m = glm::dvec3(spacing), .layers = {}, .inclusions = {}};
  return soft;
}

ModelResult run_model(const std::string& name, const Scene& scene, const Progress& progress) {
  if (progress) progress(fmt::format("feeling it as {}", name));
  BuiltScene built = build_scene(scene, {});
  SessionResult session = run_session(scene, built, {.seconds = std::nullopt, .progress = {}});
  device::stop_if_asked();
  ModelResult model{
      .name = name, .rows = std::move(session.rows), .depth_m = {}, .tick_us = session.tick_us.percentiles()};
  return model;
}

// The object's pose in each tick. All poses are equal if the object does not move.
std::vector<Pose> poses_along(const RigidDescription& rigid, const Scene& scene, std::size_t ticks) {
  std::vector<Pose> poses(ticks, rigid.pose);
  if (!std::holds_alternative<PathMotion>(rigid.motion)) return poses;
  const RigidMotion motion(rigid, rigid.pose, {}, false);
  double t_s = 0.0;
  // The times are summed as in the tick.
  for (Pose& pose : poses) pose = motion.pose_at(t_s += 1.0 / scene.rate_hz);
  return poses;
}
ClosedForm at_pose(const ClosedForm& form, const Pose& pose) {
  ClosedForm moved = form;
  moved.pose = pose;
  return moved;
}

ModelResult closed_model(const ClosedForm& form, const Tool& tool, const std::vector<TraceRow>& like,
                         const std::vector<Pose>& poses) {
  ModelResult model{.name = law_of(form, tool), .rows = {}, .depth_m = {}, .tick_us = {}};
  for (std::size_t i = 0; i < like.size(); ++i) {
    const TraceRow& row = like[i];
    const Depth depth = depth_in(at_pose(form, poses[i]), tool, row.device_m);
    TraceRow felt{.t_s = row.t_s, .device_m = row.device_m};
    felt.force_N = force_at(form, tool, depth.depth_m) * depth.out;
    felt.proxy_m = row.device_m + felt.force_N / tool.stiffness_N_per_m;
    felt.contacts = depth.depth_m > 0.0 ? 1U : 0U;
    model.rows.push_back(felt);
  }
  return model;
}

// The tool as it feels the object.
Tool tool_on(const RigidDescription& rigid, const Tool& tool) {
  Tool felt = tool;
  if (rigid.feel.stiffness_N_per_m > 0.0) felt.stiffness_N_per_m = rigid.feel.stiffness_N_per_m;
  return felt;
}

// Renders the object by the nearest surface, without a proxy. The surface is that of the model with a proxy.
ModelResult classic_model(const RigidDescription& rigid, const Tool& tool, const std::vector<TraceRow>& like,
                          const std::vector<Pose>& poses) {
  std::vector<BuildNote> notes;
  const RigidObject object = build_rigid(rigid, notes);
  ModelResult model{.name = "nearest-surface", .rows = {}, .depth_m = {}, .tick_us = {}};
  for (std::size_t i = 0; i < like.size(); ++i) {
    const TraceRow& row = like[i];
    const ClassicForce felt =
        nearest_surface_force(*object.surface, poses[i], row.device_m, tool.radius_m, tool.stiffness_N_per_m);
    model.rows.push_back({.t_s = row.t_s,
                          .device_m = row.device_m,
                          .proxy_m = row.device_m + felt.force_N / tool.stiffness_N_per_m,
                          .force_N = felt.force_N,
                          .contacts = felt.contact ? 1U : 0U});
  }
  return model;
}

// Does the rigid closed form hold along the motion? The form knows only the present position of the device,
// not the side from which the device came. It holds as long as its tool position never jumps further than the
// device moves, in the frame of the object. The tolerances allow for rounding and for rounded corners.
bool holds_along(const ClosedForm& form, const Tool& tool, const std::vector<TraceRow>& rows,
                 const std::vector<Pose>& poses) {
  if (form.young_Pa > 0.0) return true;
  constexpr double most = 4.0;
  const ClosedForm at_origin = at_pose(form, {});
  glm::dvec3 out_before(0.0), device_before(0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const glm::dvec3 device = glm::conjugate(poses[i].rotation) * (rows[i].device_m - poses[i].position_m);
    const Depth depth = depth_in(at_origin, tool, device);
    const glm::dvec3 out = std::max(0.0, depth.depth_m) * depth.out;
    const double moved = i > 0 ? glm::length(device - device_before) : 0.0;
    if (i > 0 && glm::length(out - out_before) > most * moved + 1e-3 * tool.radius_m) return false;
    out_before = out;
    device_before = device;
  }
  return true;
}

double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

}  // namespace

Scene on_ideal_device(const Scene& scene) {
  Scene ideal = scene;
  ideal.device_model = device::DeviceModel::ideal;
  ideal.real_device.reset();
  ideal.max_force_given = true;  // The ideal device has no limit, and a comparison needs the whole force.
  ideal.safety.max_force_N = 1e6;
  ideal.safety.max_slew_N_per_s = 1e12;
  ideal.safety.soft_start_s = 0.0;
  return ideal;
}

void measure(ModelResult& model, const ModelResult& reference, double floor_N) {
  std::vector<double> jnd, angle;
  double sum2 = 0.0;
  const std::size_t count = std::min(model.rows.size(), reference.rows.size());
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 &f = model.rows[i].force_N, &r = reference.rows[i].force_N;
    if (i + 1 < count) {
      model.work_J +=
          0.5 * glm::dot(f + model.rows[i + 1].force_N, model.rows[i + 1].device_m - model.rows[i].device_m);
    }
    if (f == glm::dvec3(0.0) && r == glm::dvec3(0.0)) continue;
    const double error = glm::length(f - r);
    sum2 += error * error;
    model.max_N = std::max(model.max_N, error);
    jnd.push_back(jnd_of(f, r, floor_N));
    if (glm::length(f) <= floor_N || glm::length(r) <= floor_N) continue;
    angle.push_back(angle_between_deg(f, r));
  }
  if (jnd.empty()) return;
  model.rms_N = std::sqrt(sum2 / static_cast<double>(jnd.size()));
  model.share_above_1_jnd =
      static_cast<double>(std::count_if(jnd.begin(), jnd.end(), [](double x) { return x > 1.0; })) /
      static_cast<double>(jnd.size());
  model.jnd_p50 = percentile(jnd, 0.5);
  model.jnd_p99 = percentile(jnd, 0.99);
  model.direction_p50_deg = percentile(angle, 0.5);
  model.direction_p99_deg = percentile(angle, 0.99);
}

Comparison compare_models(const Scene& scene, const std::string& object, const Progress& progress) {
  const auto named = [&object](const auto& o) { return object.empty() || o.name == object; };
  const auto soft = std::find_if(scene.soft.begin(), scene.soft.end(), named);
  const auto rigid = std::find_if(scene.rigid.begin(), scene.rigid.end(), named);
  if (soft == scene.soft.end() && rigid == scene.rigid.end()) {
    std::string names;
    for (const auto& o : scene.rigid) names += fmt::format(" \"{}\"", o.name);
    for (const auto& o : scene.soft) names += fmt::format(" \"{}\"", o.name);
    throw std::runtime_error(
        fmt::format("{}: no object \"{}\"; it has{}", scene.file.string(), object, names));
  }
  // If the user named no object, the first soft one is taken, because its models differ.
  const bool is_soft = soft != scene.soft.end();
  Comparison result{.object = is_soft ? soft->name : rigid->name, .models = {}, .reference_text = {}};
  result.jnd_floor_N = jnd_floor_N(scene);

  const bool moves = !is_soft && !std::holds_alternative<std::monostate>(rigid->motion);
  if (moves && std::holds_alternative<FreeMotion>(rigid->motion)) {
    throw SceneError(
        scene.file, rigid->motion_place,
        fmt::format("\"{}\" is pushed by what touches it, so each model would have it somewhere else "
                    "and there is no one motion to compare; fix it or give it a path",
                    rigid->name));
  }
  const Tool tool = is_soft ? scene.tool : tool_on(*rigid, scene.tool);
  const bool punch = scene.tool.shape == Tool::Shape::punch;
  std::optional<ClosedForm> form = is_soft ? closed_form_of(scene, *soft) : closed_form_of(*rigid);
  if (!punch) {  // a punch does not feel rigid objects
    Scene as_proxy = bare(scene);
    as_proxy.rigid.push_back(is_soft ? as_rigid(*soft) : *rigid);
    as_proxy.rigid.back().as_mesh = true;
    result.models.push_back(run_model("mesh and proxy", as_proxy, progress));
    if (!is_soft) {
      const auto& rows = result.models.front().rows;
      result.models.push_back(
          classic_model(as_proxy.rigid.back(), tool, rows, poses_along(*rigid, scene, rows.size())));
    }
  }
  std::optional<SoftDescription> voxels = is_soft ? *soft : as_soft(*rigid);
  if (voxels && moves) {
    result.note = "it moves, which voxels do not: they are left out";
    voxels.reset();
  }
  if (voxels) {
    Scene as_voxels = bare(scene);
    as_voxels.soft.push_back(*voxels);
    if (!is_soft) as_voxels.materials["hard"] = Material{.young_Pa = kHardYoung_Pa, .place = {}};
    // There is no rigid object left that could hold the tissue.
    as_voxels.soft.back().anchors.rigid_within_m = 0.0;
    result.models.push_back(run_model("voxels", as_voxels, progress));
  }
  if (is_soft && !punch) {  // the tool of the thesis is a ball: a centre and six points around it
    if (progress) progress("feeling it as classic");
    result.models.push_back(classic_voxels(scene, *soft, result.models.back().rows));
  }
  if (result.models.empty()) {
    throw std::runtime_error(
        fmt::format("{}: \"{}\" has no voxels, and a punch feels nothing else; use [tool] shape = \"ball\"",
                    scene.file.string(), result.object));
  }
  const std::size_t ticks = result.models.front().rows.size();
  std::vector<Pose> poses;
  if (form) poses = is_soft ? std::vector<Pose>(ticks, form->pose) : poses_along(*rigid, scene, ticks);
  if (form && !holds_along(*form, scene.tool, result.models.front().rows, poses)) form.reset();
  if (form) result.models.push_back(closed_model(*form, tool, result.models.front().rows, poses));

  // The reference is the closed form where it is exact or nearly so. Otherwise it is the model with which the
  // scene itself renders the object.
  const bool by_form = form && form->caveat.find("left out") == std::string::npos;
  result.reference = by_form ? result.models.size() - 1 : (is_soft && !punch ? 1 : 0);
  result.reference_text =
      by_form
          ? fmt::format("{}{}{}", law_of(*form, scene.tool), form->caveat.empty() ? "" : ", ", form->caveat)
          : fmt::format("{}, as the scene has it", result.models[result.reference].name);
  for (ModelResult& model : result.models) {
    measure(model, result.models[result.reference], result.jnd_floor_N);
    if (!form) continue;
    for (std::size_t i = 0; i < model.rows.size(); ++i)
      model.depth_m.push_back(depth_in(at_pose(*form, poses[i]), scene.tool, model.rows[i].device_m).depth_m);
  }
  return result;
}

}  // namespace hybrid
