// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/force_continuity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/bench/soft.h"
#include "hybrid/bench/soft_engines.h"
#include "hybrid/build/build_world.h"
#include "hybrid/compare/compare.h"
#include "hybrid/session/session.h"
#include "hybrid/tick/tick.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid::bench {
namespace {

constexpr double kTick = 1e-3;         // duration of a tick (s)
constexpr int kWide = 36, kHigh = 20;  // voxels of a block; a ball has the same width
// Pa. Forces are some newtons, so the JND is a share of the force, not its floor.
constexpr double kYoung = 1e5;
constexpr double kAway = 0.5;  // spacings above the surface at which strokes begin and end
// Share of the lattice's force scale; a reference with a smaller residual is at rest.
constexpr double kTolerance = 1e-4;
constexpr int kMostSettleCycles = 60;  // cycles in which a reference has to come to rest

// Visits the device positions along the corners, one for each tick.
template <class Visit>
void along(const std::vector<glm::dvec3>& corners, double speed, const Visit& visit) {
  for (std::size_t n = 1; n < corners.size(); ++n) {
    const double way = glm::distance(corners[n - 1], corners[n]);
    const int ticks = std::max(1, static_cast<int>(std::ceil(way / (speed * kTick))));
    for (int t = 1; t <= ticks; ++t)
      visit(corners[n - 1] + (static_cast<double>(t) / ticks) * (corners[n] - corners[n - 1]));
  }
}

// A copy of the object, which is brought to rest with the tool at each place.
class Equilibrium {
 public:
  Equilibrium(const World& world, const WorldState& state) : world_(world), object_(state.soft[0]->copy()) {}

  // Force on the tool at `point` (N). Both are in the scene's frame.
  glm::dvec3 at(const glm::dvec3& point) {
    const SoftBody& body = world_.soft[0];
    const voxel::ToolInBody tool = tool_in_body(world_, body, point);
    const double reach = object_->reach(tool.radius) + 2.0 * kSoftSpacing_m;
    near_.clear();
    for (const voxel::VoxelId v : object_->lattice().surface()) {
      if (glm::distance(object_->position(v), tool.centre) < reach) near_.push_back(v);
    }
    object_->touch(near_);
    if (!object_->settle(tool, kTolerance * object_->lattice().force_scale_N(), kMostSettleCycles))
      ++unsettled;
    return body.pose.rotation * object_->reaction(tool).force_N;
  }
  std::uint64_t unsettled = 0;

 private:
  const World& world_;
  std::unique_ptr<voxel::SoftObject> object_;
  std::vector<voxel::VoxelId> near_;
};

// Normal of the surface where the stroke begins.
glm::dvec3 outwards(Smooth block) {
  return block == Smooth::oblique ? glm::normalize(glm::dvec3(0.8, 0.35, 1.0)) : glm::dvec3(0.0, 0.0, 1.0);
}

}  // namespace

const char* smooth_name(Smooth block) {
  switch (block) {
    case Smooth::homogeneous:
      return "homogeneous";
    case Smooth::layered:
      return "layers";
    case Smooth::oblique:
      break;
  }
  return "oblique";
}

Scene stroke_scene(const StrokeCase& stroke) {
  Scene scene = on_ideal_device({});
  scene.file = fmt::format("stroke over a {} object", smooth_name(stroke.block));
  scene.tool.radius_m = stroke.radius_spacings * kSoftSpacing_m;
  scene.materials["tissue"] = {.young_Pa = kYoung, .place = {}};
  scene.materials["firm"] = {.young_Pa = 4.0 * kYoung, .place = {}};
  voxel::Formula formula{.size_m = glm::dvec3(kWide, kWide, kHigh) * kSoftSpacing_m,
                         .spacing_m = glm::dvec3(kSoftSpacing_m),
                         .layers = {},
                         .inclusions = {}};
  Anchors anchors;
  std::map<std::uint8_t, std::string> materials;
  if (stroke.block == Smooth::layered) {
    // Skin, fat and muscle: a soft layer between two firm ones. The top layer is three voxels thick.
    formula.layers = {{0.5 * kHigh * kSoftSpacing_m, 2}, {(0.5 * kHigh - 3.0) * kSoftSpacing_m, 1}};
    formula.label = 2;
    materials[2] = "firm";
  } else if (stroke.block == Smooth::oblique) {
    formula.shape = voxel::Formula::Shape::ball;
    formula.size_m = glm::dvec3(kWide * kSoftSpacing_m);
    formula.inclusions = {{.size_m = glm::dvec3(0.4 * kWide * kSoftSpacing_m), .label = 3}};
    materials[3] = "tissue";
    anchors.labels = {3};
  }
  scene.soft.push_back({.name = "tissue",
                        .source = std::move(formula),
                        .pose = {},
                        .materials = std::move(materials),
                        .material = "tissue",
                        .anchors = std::move(anchors),
                        .place = {},
                        .source_place = {}});
  return scene;
}

std::vector<glm::dvec3> stroke_corners(const StrokeCase& stroke) {
  const glm::dvec3 n = outwards(stroke.block);
  const double surface = 0.5 * (stroke.block == Smooth::oblique ? kWide : kHigh) * kSoftSpacing_m;
  const double touched = surface + stroke.radius_spacings * kSoftSpacing_m;
  // The stroke must not be parallel to any axis of the lattice.
  const glm::dvec3 side = glm::normalize(glm::cross(n, glm::dvec3(0.3, 1.0, 0.2))),
                   other = glm::cross(n, side);
  const glm::dvec3 start = touched * n - 0.5 * stroke.slide_spacings * kSoftSpacing_m * side +
                           kSoftSpacing_m * (0.31 * side + 0.17 * other);
  const glm::dvec3 slide = stroke.slide_spacings * kSoftSpacing_m * side;
  std::vector<glm::dvec3> corners{start + kAway * kSoftSpacing_m * n,
                                  start - stroke.depth_spacings * kSoftSpacing_m * n};
  if (stroke.slide_spacings > 0.0) corners.push_back(corners[1] + slide);
  corners.push_back(corners.back() + (kAway + stroke.depth_spacings) * kSoftSpacing_m * n);
  return corners;
}

StrokeResult measure_stroke(const Scene& scene, const std::vector<glm::dvec3>& corners,
                            double speed_m_per_s) {
  const ScopedFlushToZero flushed;
  BuiltScene built = build_scene(scene);
  begin_session(scene, *built.world, *built.state, corners.front());
  Equilibrium equilibrium(*built.world, *built.state);
  StrokeResult result;
  std::vector<double> excess;
  glm::dvec3 felt_before(0.0), rest_before(0.0);
  std::uint64_t tick = 0;
  along(corners, speed_m_per_s, [&](const glm::dvec3& device) {
    const TickResult t = haptic_tick(*built.world, *built.state, {.position_m = device}, kTick);
    const glm::dvec3 felt = t.rigid_N + t.soft_N, rest = equilibrium.at(t.proxy_m);
    const double jnd = std::max(kJndShare * glm::length(rest), kJndFloor_N);
    const double beyond = std::max(0.0, glm::length(felt - felt_before) - glm::length(rest - rest_before));
    if (t.contacts != 0 || felt_before != glm::dvec3(0.0)) {
      ++result.ticks;
      excess.push_back(beyond / jnd);
      if (beyond / jnd > result.excess_max_jnd) {
        result.excess_max_jnd = beyond / jnd;
        result.excess_max_N = beyond;
        result.excess_at_tick = static_cast<double>(tick);
      }
      result.error_max_jnd = std::max(result.error_max_jnd, glm::length(felt - rest) / jnd);
      result.force_max_N = std::max(result.force_max_N, glm::length(felt));
    }
    felt_before = felt;
    rest_before = rest;
    ++tick;
  });
  const Percentiles p = percentiles(excess);
  result.excess_p50_jnd = p.p50;
  result.excess_p99_jnd = p.p99;
  result.unsettled_share =
      static_cast<double>(equilibrium.unsettled) / static_cast<double>(std::max<std::uint64_t>(1, tick));
  return result;
}

double work_of_stroke(const Scene& scene, const std::vector<glm::dvec3>& corners, double speed_m_per_s) {
  const ScopedFlushToZero flushed;
  BuiltScene built = build_scene(scene);
  begin_session(scene, *built.world, *built.state, corners.front());
  double work = 0.0;
  glm::dvec3 felt_before(0.0), device_before = corners.front();
  along(corners, speed_m_per_s, [&](const glm::dvec3& device) {
    const TickResult t = haptic_tick(*built.world, *built.state, {.position_m = device}, kTick);
    const glm::dvec3 felt = t.rigid_N + t.soft_N;
    work += 0.5 * glm::dot(felt + felt_before, device - device_before);
    felt_before = felt;
    device_before = device;
  });
  return work;
}

}  // namespace hybrid::bench
